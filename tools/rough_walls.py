"""What stands at walls as they are, and what is wrong with them, for the simulator: drawn by seed.

Growth on the wet faces, uneven faces, splash; fenders, a ladder, a moored boat before the largest wall, a footing along
it; and in half of the sessions one wet face that does not go on below the water as above.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np

from pipeline.config.yaml_models import parse
from pipeline.maths.target.masks import along_face
from pipeline.simulation.scenario import Scenario
from pipeline.target.design import target_of
from tools.places import FOOT_M, PLACES, TOP_M, frame_of

Draws = np.random.Generator
NEAR_M = 0.3  # a found face nearer to a drawn one is that one
Plan = tuple[np.ndarray, np.ndarray]  # start and end of a wall, (2,) each


def upright_walls(place: str) -> dict[str, Plan]:
    """Return the upright faces of a place in plan, the longest first."""
    walls = {}
    for name, corners in PLACES[place]["faces"].items():
        (x1, y1, _), (x0, y0, _) = corners[:2]
        if len({(x, y) for x, y, _ in corners}) == 2:
            walls[name] = np.array([x0, y0]), np.array([x1, y1])
    return dict(sorted(walls.items(), key=lambda item: -float(np.linalg.norm(item[1][1] - item[1][0]))))


def longest_wall(place: str) -> str:
    """Return the name of the wall before which things stand."""
    return next(iter(upright_walls(place)))


def box_before(
    wall: Plan, name: str, at_m: float, size_m: tuple[float, float], off_m: float, heights: tuple[float, float]
) -> dict[str, Any]:
    """Return a box before a wall.

    Parameters
    ----------
    wall, name
        The wall in plan, and the box's name.
    at_m : float
        Place of its middle along the wall, from the start.
    size_m : (float, float)
        Its depth, away from the wall, and its length along it.
    off_m : float
        Gap between wall and box.
    heights : (float, float)
        Its lower and upper end, m.
    """
    start, end = wall
    along = (end - start) / np.linalg.norm(end - start)
    out = np.array([-along[1], along[0]])  # along +y the boat is at -x
    x, y = start + at_m * along + (off_m + size_m[0] / 2) * out
    low, high = ([x + s * size_m[0] / 2, y + s * size_m[1] / 2] for s in (-1.0, 1.0))
    turn_deg = float(np.degrees(np.arctan2(-along[0], along[1])))
    return {"name": name, "low_m": [*low, heights[0]], "high_m": [*high, heights[1]], "turn_deg": turn_deg}


def drawn_walls(place: str, seed: int) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any] | None]:
    """Return what is drawn for a session: blocks of surroundings and laser, and the planted fault, if there is one."""
    draws = np.random.default_rng([seed, 4])
    walls = upright_walls(place)
    surroundings = {
        "boxes": _boxes(walls[longest_wall(place)], draws),
        "fouling_m": draws.uniform(0.0, 0.03),
        "fouling_sigma_m": draws.uniform(0.0, 0.015),
        "unevenness_m": draws.uniform(0.0, 0.003),
        "unevenness_length_m": draws.uniform(0.1, 0.4),
    }
    laser = {"splash_share": draws.uniform(0.0, 0.3), "splash_height_m": 0.3}
    fault = _fault(draws.choice(list(walls)), draws) if draws.uniform() < 0.5 else None
    return _plain(surroundings), _plain(laser), None if fault is None else _plain(fault)


def drawn_into(scenario: dict[str, Any], place: str, seed: int) -> dict[str, Any]:
    """Put what is drawn for a session into its scenario; return columns of its row: the faulty face, the things."""
    surroundings, laser, fault = drawn_walls(place, seed)
    faults = scenario["surroundings"]["face_faults"]
    scenario["surroundings"] |= surroundings | {"face_faults": [*faults, *([] if fault is None else [fault])]}
    scenario["laser"] |= laser
    names = {box["name"].partition("-")[0] for box in surroundings["boxes"]}
    face, size = ("", "") if fault is None else (fault["faces"][0], str(fault.get("shift_m") or fault["turn_deg"]))
    return {"fault": face, "size": size, "things": " ".join(sorted(names))}


def drawn_names(families: Iterable[str], found: dict[str, Any], drawn: dict[str, Any]) -> list[str]:
    """Return the names of the drawn faces that found ones are; of one that is none of them "?" and its own name."""
    frames = [frame_of(target) for target in (found, drawn)]
    names = []
    for family in families:
        middle = np.mean(found["faces"][family]["corners"], axis=0)
        place = frames[1].points_from_ecef(frames[0].points_to_ecef(middle[None]))[0]
        best = min(drawn["faces"], key=lambda name: _off_m(np.array(drawn["faces"][name]["corners"]), place))
        near = _off_m(np.array(drawn["faces"][best]["corners"]), place) < NEAR_M
        names.append(best if near else f"?{family}")
    return names


def masks_of_things(
    boxes: Iterable[dict[str, Any]], place: str, face: str, found: dict[str, Any], drawn: dict[str, Any]
) -> list[dict[str, list[float]]]:
    """Return masks of a found face, the longest wall, where things stand against it: fenders, rungs, a footing."""
    faces = target_of(parse(Scenario, {"name": place, "target": found}, place).target).faces
    (seen,) = (one for one in faces if one.name == face)
    start, end = upright_walls(place)[longest_wall(place)]
    along = (end - start) / np.linalg.norm(end - start)
    masks = []
    for box in boxes:
        low, high = np.array(box["low_m"]), np.array(box["high_m"])
        ends = (low + high)[:2] / 2 + np.outer([-0.5, 0.5], (high - low)[1] * along)
        points = frame_of(drawn).points_to_ecef(np.column_stack([ends, [low[2], high[2]]]))
        there = frame_of(found).points_from_ecef(points)
        if box["name"] != "boat":
            heights = there[:, 2] - found.get("water_level_m", 0.0)
            masks.append({"along_m": np.sort(along_face(seen, there)).tolist(), "height_m": heights.tolist()})
    return masks


def _off_m(corners_m: np.ndarray, place_m: np.ndarray) -> float:
    """Return the distance of a place from a face's plane, and beyond its ends."""
    normal = np.cross(corners_m[1] - corners_m[0], corners_m[2] - corners_m[0])
    normal = normal / np.linalg.norm(normal)
    beyond = np.maximum(corners_m.min(axis=0) - place_m, 0) + np.maximum(place_m - corners_m.max(axis=0), 0)
    return float(abs(normal @ (place_m - corners_m[0])) + np.linalg.norm(beyond))


def _boxes(wall: Plan, draws: Draws) -> list[dict[str, Any]]:
    """Return two fenders, a ladder, perhaps a footing, perhaps a moored boat."""
    length = float(np.linalg.norm(wall[1] - wall[0]))
    places = draws.permutation(np.arange(0.5, length - 0.4, 0.8))[:3]
    boxes = [box_before(wall, f"fender-{k}", at, (0.25, 0.25), 0.0, (-0.4, 1.3)) for k, at in enumerate(places[:2])]
    for k, height in enumerate(np.arange(-1.2, TOP_M, 0.3)):
        boxes.append(box_before(wall, f"rung-{k}", places[2], (0.04, 0.45), 0.12, (height, height + 0.04)))
    if draws.uniform() < 0.5:
        out, high = draws.uniform(0.15, 0.5), draws.uniform(0.3, 1.0)
        boxes.append(box_before(wall, "footing", length / 2, (out, length), 0.0, (FOOT_M, FOOT_M + high)))
    if draws.uniform() < 0.3:
        boxes.append(box_before(wall, "boat", draws.choice([1.5, length - 1.5]), (1.2, 3.0), 0.4, (-0.35, 0.7)))
    return boxes


def _fault(face: str, draws: Draws) -> dict[str, Any]:
    """Return a fault of the wet part of a face: it stands off by 8 to 30 cm, or is turned by 0.6 to 2°."""
    sign = draws.choice([-1.0, 1.0])
    fault: dict[str, Any] = {"faces": [face], "part": "wet"}
    if draws.uniform() < 0.5:
        return fault | {"shift_m": sign * draws.uniform(0.08, 0.3)}
    turn = [0.0, 0.0]
    turn[int(draws.integers(2))] = sign * draws.uniform(0.6, 2.0)
    return fault | {"turn_deg": turn}


def _plain(value: Any) -> Any:
    """Return a value with Python's own numbers and texts, for YAML."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value
