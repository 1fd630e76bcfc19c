"""Places where a crew may calibrate without a pool, for the simulator: walls, slopes, a lock, a pier of sheet piling.

All stand 4 m deep in the water and 2 m above it. Their corners are in the target frame: x into the wall, y along it.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from pipeline.maths.geometry.geodesy import PoolFrame

Corners = list[list[float]]
FOOT_M, TOP_M = -4.0, 2.0
TRACK: dict[str, Any] = {"distances_m": [4.0, 7.0, 5.0, 6.0], "half_length_m": 6.0}
RATES: dict[str, Any] = {  # 19.3 and 9.7 do not divide 100: lines and pings fall anywhere between records
    "ins": {"rate_hz": 100.0},
    "laser": {"point_rate_hz": 8000.0, "line_rate_hz": 19.3},
    "mbes": {"ping_rate_hz": 9.7},
}
MOUNT = {"pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
BOTH_SIDES: dict[str, Any] = {  # a head that looks down, a scanner that sees both sides, and passes both ways
    "mbes": {"mount": MOUNT | {"roll_deg": -1.8}, "sector_deg": 150.0},
    "laser": {"field_deg": [-130.0, 130.0]},
    "track": {"courses": ["along", "back"]},
}


def wall(start: Sequence[float], end: Sequence[float]) -> Corners:
    """Return the corners of an upright wall from one point (x, y) to another, counter-clockwise as the boat sees it.

    The boat passes at x < 0 toward +y, and comes by the first point first.
    """
    (x0, y0), (x1, y1) = start, end
    return [[x1, y1, FOOT_M], [x0, y0, FOOT_M], [x0, y0, TOP_M], [x1, y1, TOP_M]]


def _piling() -> dict[str, Corners]:
    """Return a wall of wide sheet piles: 1.2 m in front, webs at 45°, 1.2 m behind; it repeats after 3.3 m."""
    plan, y = [(0.0, -6.6)], -6.6
    for _ in range(4):
        for along, x in ((1.2, 0.0), (0.45, 0.45), (1.2, 0.45), (0.45, 0.0)):
            y += along
            plan.append((x, y))
    return {f"pan-{k}": wall(*ends) for k, ends in enumerate(pairwise(plan))}


PLACES: dict[str, dict[str, Any]] = {
    "wall": {"faces": {"wall": wall((0, -6), (0, 6))}},
    "return": {"faces": {"wall": wall((0, -4), (0, 4)), "return": wall((0, 4), (2.5, 6.5))}},
    "returns": {
        "faces": {
            "wall": wall((0, -3), (0, 3)), "south": wall((2, -5), (0, -3)), "north": wall((0, 3), (2, 5)),
        },
    },
    "slope": {
        "faces": {
            "wall": wall((0, 0), (0, 6)),
            "slope": [[-4, -1, -4], [-4, -7, -4], [2, -7, 2], [2, -1, 2]],
        },
        "track": {"distances_m": [7.0, 9.0, 7.5, 8.5], "half_length_m": 7.0},
    },
    "lock": {
        "faces": {
            "right": wall((0, -4), (0, 4)),
            "niche": wall((0, 4), (1.5, 5.5)),
            "left": [[-12, -4, FOOT_M], [-12, 4, FOOT_M], [-12, 4, TOP_M], [-12, -4, TOP_M]],
        },
        "both": True,
        "track": {"distances_m": [4.0, 8.0, 5.0, 7.0], "half_length_m": 6.0},
    },
    "piling": {"faces": _piling()},
    "slip": {
        "faces": {
            "wall": wall((0, -2), (0, 4)), "south": wall((2, -4), (0, -2)), "north": wall((0, 4), (2, 6)),
            "slope": [[-4, -4, -4], [-4, -9, -4], [2, -9, 2], [2, -4, 2]],
            "ramp": [[-4, 11, -4], [-4, 6, -4], [2, 6, 2], [2, 11, 2]],
        },
        "track": {"distances_m": [7.0, 9.0, 7.5, 8.5], "half_length_m": 9.0},
    },
}


def scenario_of_place(name: str, *more: dict[str, Any]) -> dict[str, Any]:
    """Return a place's scenario, with blocks laid over it, two levels deep."""
    place = PLACES[name]
    target = {
        "kind": "faces",
        "origin": {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0},
        "azimuth_deg": 163.0,
        "faces": {face: {"corners": corners} for face, corners in place["faces"].items()},
    }
    total: dict[str, Any] = {"name": name, "target": target, "surroundings": {"back_wall": False}}
    blocks = (RATES, BOTH_SIDES if place.get("both") else {}, {"track": TRACK | place.get("track", {})}, *more)
    for block in blocks:
        for key, value in block.items():
            total[key] = total.get(key, {}) | value if isinstance(value, dict) else value
    return total


def frame_of(target: dict[str, Any]) -> PoolFrame:
    """Return the frame of a target's settings."""
    origin = target["origin"]
    latitude, longitude = (float(np.radians(origin[name])) for name in ("latitude_deg", "longitude_deg"))
    return PoolFrame.at(latitude, longitude, origin["height_m"], float(np.radians(target["azimuth_deg"])))
