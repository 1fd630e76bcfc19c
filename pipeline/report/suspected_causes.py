"""Suspected causes (fixed parameters that the residuals contradict), and the parameters that adjust.free names.

Table ``freed`` has the single-parameter test of each fixed parameter. The residuals contradict a parameter if its
estimate is farther from zero than noise and its a-priori sigma explain. One error often moves the estimates of several
parameters. The report names the cause that explains most, with the largest value over sigma. Where one parameter is
contradicted, this may be another that is not: a parameter with a large a-priori sigma, which explains the residuals
without being off its setting.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

SIGNIFICANT = 4.0  # sigmas: by chance one of 16 000 parameters, so one of 400 sessions with forty parameters each
UNITS = {"sound_speed": "1"} | dict.fromkeys(("mbes_latency", "laser_latency"), "s")
UNITS |= dict.fromkeys(("mbes_incidence", "mbes_level_range", "laser_incidence"), "m")
AXES = {"x": "pitch", "y": "roll", "z": "yaw"}
FACES_OF_FAMILY = {"P1": "on the -y side", "P2": "of the wall", "P3": "on the +y side", "H": "that are horizontal"}
WORDS = {  # by parameter: scale and unit of its estimate, and the words round it
    "mbes_latency": (1e3, "ms", "the sonar's clock: its latency is {} more than mbes.latency_s says"),
    "laser_latency": (1e3, "ms", "the laser's clock: its latency is {} more than laser.latency_s says"),
    "mbes_range": (1e3, "mm", "the sonar's ranges: they should be {} longer"),
    "laser_range": (1e3, "mm", "the laser's ranges: they should be {} longer"),
    "mbes_incidence": (
        1e3,
        "mm",
        "the sonar's ranges go with the angle at which it sees a face: at 45° they should be {} longer, against a face "
        "seen at right angles (at 75° seven times as much): its bottom detection, or what coats the faces",
    ),
    "laser_incidence": (
        1e3,
        "mm",
        "the laser's ranges go with the angle at which it sees a face: at 45° they should be {} longer, against a face "
        "seen at right angles (at 75° seven times as much): faces that are glazed, wet or dark",
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
        "a sound speed that changes with depth, by {} per metre: take a (better) cast",
    ),
}
PLACES = {  # of the transmitter by component: where it sits if the estimate is positive, and if it is negative
    "projector_x": ("farther to starboard", "farther to port"),
    "projector_y": ("farther forward", "farther aft"),
    "projector_z": ("higher", "lower"),
}


@dataclass(frozen=True)
class SuspectedCause:
    """A fixed parameter that would explain the residuals: its words, and its value over the sigma from noise."""

    words: str
    normalised: float


@dataclass(frozen=True)
class EstimatedParameter:
    """A parameter that ``adjust.free`` names.

    Attributes
    ----------
    unknown : name of the parameter
    value, sigma_total : estimate and total sigma in ``unit``
    words : the estimate, and the setting or device to check
    is_significant : whether the value is farther from zero than its sigma and its a-priori sigma explain
    """

    unknown: str
    value: float
    sigma_total: float
    unit: str
    words: str
    is_significant: bool


def suspected_causes(freed: pd.DataFrame) -> list[SuspectedCause]:
    """Return the suspected causes from table ``freed``, the one with the largest value over sigma first.

    There are none unless the residuals contradict at least one fixed parameter.
    """
    fixed = freed[~freed["estimated"]].to_dict("records")
    if not any(_is_significant(row) for row in fixed):
        return []
    causes = [
        SuspectedCause(_words(row), abs(row["value"]) / row["sigma"])
        for row in fixed
        if abs(row["value"]) > SIGNIFICANT * row["sigma"]
    ]
    return sorted(causes, key=lambda cause: -cause.normalised)


def estimated_parameters(freed: pd.DataFrame) -> list[EstimatedParameter]:
    """Return the parameters of ``adjust.free`` with their estimates (table ``freed``); empty without a result."""
    return [
        EstimatedParameter(
            unknown=row["unknown"],
            value=row["value"],
            sigma_total=row["sigma"],
            unit=UNITS[row["unknown"]],
            words=_words(row),
            is_significant=_is_significant(row),
        )
        for row in freed[freed["estimated"] & np.isfinite(freed["sigma"])].to_dict("records")
    ]


def _is_significant(row: Mapping[Any, Any]) -> bool:
    return bool(abs(row["value"]) > SIGNIFICANT * np.hypot(row["sigma"], row["considered"]))


def _words(row: Mapping[Any, Any]) -> str:
    """Return in words the estimate of one parameter, and the setting or device to check."""
    name, value, sigma = str(row["unknown"]), float(row["value"]), float(row["sigma"])
    if name in WORDS:
        scale, unit, words = WORDS[name]
        return words.format(_size(scale * value, scale * sigma, unit))
    if name in PLACES:
        farther = PLACES[name][int(value < 0)]
        size = _size(1e3 * abs(value), 1e3 * sigma, "mm").removeprefix("+")
        return (
            f"the transmitter sits {size} {farther} than mbes.projector_offset_m says (null: where the receiver is), "
            "in the sonar's own axes: measure it at the head, or find out to which point the head reduces its ranges"
        )
    if name.startswith("laser_rotation"):
        angle = _size(np.degrees(value), np.degrees(sigma), "°")
        return f"laser.mount: it should be turned by {angle} about body {name[-1]} ({AXES[name[-1]]} of the boat)"
    if name.startswith("laser_lever_arm"):
        return f"laser.mount: {name[-1]}_m should be {_size(1e3 * value, 1e3 * sigma, 'mm')} more"
    return _words_of_wet_faces(name, value, sigma)


def _words_of_wet_faces(name: str, value: float, sigma: float) -> str:
    """Return in words a turn (rad) or shift (m) of a family's wet faces against its dry ones."""
    family, _, kind = name.removeprefix("wet_").replace("_turn_", "_turn ").rpartition("_")
    faces = FACES_OF_FAMILY.get(family, f"of {family}")
    if kind.startswith("turn"):
        angle = _size(np.degrees(value), np.degrees(sigma), "°")
        return f"the target: its wet faces {faces} are turned by {angle} against the dry ones"
    shift = _size(1e3 * value, 1e3 * sigma, "mm")
    verb = "lie higher" if family == "H" else "stand off"
    return f"the target: its wet faces {faces} {verb} by {shift}; check its shape in the config, and its survey"


def _size(value: float, sigma: float, unit: str) -> str:
    """Return a value and its sigma as text, with as many decimals as the first digit of the sigma has."""
    digits = max(0, -int(np.floor(np.log10(max(sigma, 1e-9)))))
    gap = "" if unit == "°" else " "
    return f"{value:+.{digits}f} ± {sigma:.{digits}f}{gap}{unit}"
