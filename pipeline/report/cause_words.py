"""The estimate of a parameter in words, with the setting or the device to check; and sets of parameters in words."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.maths.adjustment.parameters import of_head

AXES = {"x": "pitch", "y": "roll", "z": "yaw"}
FACES_OF_FAMILY = {"P1": "on the -y side", "P2": "of the wall", "P3": "on the +y side", "H": "that are horizontal"}
TURNS_OF_FAMILY = dict.fromkeys(  # turns of the normal along the tangents (maths/geometry/planes.py)
    ("P1", "P2", "P3"),
    (
        "the target: its wet faces {} are turned by {} counter-clockwise from above, against the dry ones",
        "the target: its wet faces {} lean away from the boat by {}, against the dry ones",
    ),
) | {
    "H": (
        "the target: its wet faces {} are tilted by {}, looking toward +x, against the dry ones",
        "the target: its wet faces {} are tilted by {}, looking toward +y, against the dry ones",
    )
}
OTHER_TURNS = (
    "the target: its wet faces {} are turned by {} (first tangent), against the dry ones",
    "the target: its wet faces {} are turned by {} (second tangent), against the dry ones",
)
WORDS = {  # by parameter: scale and unit of its estimate, and the words round it
    "mbes_latency": (1e3, "ms", "the sonar's clock: its latency is {} more than mbes.latency_s says"),
    "laser_latency": (1e3, "ms", "the laser's clock: its latency is {} more than laser.latency_s says"),
    "mbes_range": (1e3, "mm", "the sonar's ranges: they should be {} longer"),
    "laser_range": (1e3, "mm", "the laser's ranges: they should be {} longer"),
    "mbes_incidence": (
        1e3,
        "mm",
        "the sonar's ranges go with the angle at which it sees a face: at 45° they should be {} longer, against a face "
        "seen at right angles (at 75° seven times as much); look at its bottom detection, and at what coats the faces",
    ),
    "laser_incidence": (
        1e3,
        "mm",
        "the laser's ranges go with the angle at which it sees a face: at 45° they should be {} longer, against a face "
        "seen at right angles (at 75° seven times as much); look for faces that are glazed, wet or dark",
    ),
    "mbes_level_range": (
        1e3,
        "mm",
        "the sonar's ranges on horizontal faces: they should be {} longer; what it hears there may be the corner with "
        "the wall behind, and not the face",
    ),
    "sound_speed": (
        1e2,
        "%",
        "the sound speed: it is {} above that recorded, or given as mbes.sound_speed_m_s or mbes.svp; measure it at "
        "the head",
    ),
    "steering_speed": (
        1e2,
        "%",
        "the sound speed at the arrays, which steers the beams: it is {} above that of the water before them; measure "
        "it at the head, and look for warm water there",
    ),
    "sound_speed_gradient": (
        1.0,
        "m/s",
        "a sound speed that changes with depth, by {} per metre; take a (better) cast",
    ),
}
WORDS_OF_SETS = {  # with a place for the names of the strongest
    "wet_shifts": "the target: wet faces of more than one family stand off against the dry ones ({}); check its "
    "shape in the config, and its survey",
    "wet_turns": "the target: wet faces are turned or lean against the dry ones, in more than one way ({}); "
    "survey them",
    "wet_bows": "the target: wet faces of more than one family are bowed ({}); survey them",
    "mbes_detection": "the sonar's ranges go with the angle at which it sees a face, and are off on horizontal faces; "
    "look at its bottom detection, and at what coats the faces",
}
NAMED_OF_SET = 3
PLACES = {  # of the transmitter by component: where it sits if the estimate is positive, and if it is negative
    "projector_x": ("farther to starboard", "farther to port"),
    "projector_y": ("farther forward", "farther aft"),
    "projector_z": ("higher", "lower"),
}


def unit_of(name: str) -> tuple[float, str]:
    """Return the unit in which a parameter is shown, and how many of it are one rad, m, s, 1 or 1/s.

    >>> unit_of("mbes_latency"), unit_of("wet_return-south_shift")
    ((1000.0, 'ms'), (1000.0, 'mm'))
    """
    _, name = of_head(name)
    if name in WORDS:
        scale, unit, _ = WORDS[name]
        return scale, "(m/s)/m" if name == "sound_speed_gradient" else unit
    is_angle = name.startswith("laser_rotation") or name.endswith(("_turn_1", "_turn_2"))
    return (float(np.degrees(1.0)), "°") if is_angle else (1e3, "mm")


def words_of(row: Mapping[Any, Any]) -> str:
    """Return in words the estimate of one parameter, and the setting or device to check; a further head is named."""
    head, name = of_head(str(row["unknown"]))
    words = _words_of(name, float(row["value"]), float(row["sigma"]))
    return f"{head}: {words}" if head else words


def _words_of(name: str, value: float, sigma: float) -> str:
    if name in WORDS:
        scale, unit, words = WORDS[name]
        return words.format(size_words(scale * value, scale * sigma, unit))
    if name in PLACES:
        farther = PLACES[name][int(value < 0)]
        size = size_words(1e3 * abs(value), 1e3 * sigma, "mm").removeprefix("+")
        return (
            f"the transmitter sits {farther} than mbes.projector_offset_m says (null: where the receiver is), by "
            f"{size} in the sonar's own axes; measure it at the head, or find out to which point the head reduces its "
            "ranges"
        )
    if name.startswith("laser_rotation"):
        angle = size_words(np.degrees(value), np.degrees(sigma), "°")
        return f"laser.mount: it should be turned by {angle} about body {name[-1]} ({AXES[name[-1]]} of the boat)"
    if name.startswith("face_"):
        shift = size_words(1e3 * value, 1e3 * sigma, "mm")
        face = name.removeprefix("face_")
        return f"the target: face {face} stands out by {shift}; survey it, and give it in as_built.faces"
    if name.startswith("laser_lever_arm"):
        return f"laser.mount: {name[-1]}_m should be {size_words(1e3 * value, 1e3 * sigma, 'mm')} more"
    return _words_of_wet_faces(name, value, sigma)


def words_of_set(name: str, by_strength: Sequence[str], most: Sequence[str]) -> str:
    """Return in words that a set of parameters is wrong.

    Parameters
    ----------
    name : of the set
    by_strength : names of its parameters, the strongest first
    most : those of them that explain most; their families are named, three at most

    >>> names = ["wet_P1_turn_2", "wet_P1_turn_1", "wet_H_turn_1"]
    >>> words_of_set("wet_turns", names, names).partition(";")[0]
    'the target: wet faces are turned or lean against the dry ones, in more than one way (P1 and H)'
    """
    all_places, places = (list(dict.fromkeys(map(_place_of, names))) for names in (by_strength, most))
    *others, last = places[:NAMED_OF_SET]
    and_less = " most" if len(all_places) > len(places[:NAMED_OF_SET]) else ""
    return WORDS_OF_SETS[name].format((f"{', '.join(others)} and {last}" if others else last) + and_less)


def _place_of(name: str) -> str:
    """Return the family of the wet faces that a parameter belongs to."""
    return re.sub(r"_(shift|turn_.|bow)$", "", name.removeprefix("wet_"))


def _words_of_wet_faces(name: str, value: float, sigma: float) -> str:
    """Return in words a turn (rad), shift or bow (m) of a family's wet faces against its dry ones."""
    family, _, kind = name.removeprefix("wet_").replace("_turn_", "_turn ").rpartition("_")
    faces = FACES_OF_FAMILY.get(family, f"of {family}")
    if kind.startswith("turn"):
        angle = size_words(np.degrees(value), np.degrees(sigma), "°")
        return TURNS_OF_FAMILY.get(family, OTHER_TURNS)[kind == "turn 2"].format(faces, angle)
    shift = size_words(1e3 * value, 1e3 * sigma, "mm")
    if kind == "bow":
        return f"the target: its wet faces {faces} are bowed outward, by {shift} at half depth; survey them"
    if family == "H":
        return f"the target: its wet faces {faces} lie higher by {shift}; check its shape in the config, and its survey"
    return f"the target: its wet faces {faces} stand off by {shift}; check its shape in the config, and its survey"


def size_words(value: float, sigma: float, unit: str) -> str:
    """Return a value and its sigma as text, with as many decimals as the first digit of the sigma has."""
    digits = max(0, -int(np.floor(np.log10(max(sigma, 1e-9)))))
    gap = "" if unit == "°" else " "
    return f"{value:+.{digits}f} ± {sigma:.{digits}f}{gap}{unit}"
