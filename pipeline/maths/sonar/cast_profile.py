"""A cast's rows as a profile: one direction of the probe, ascending depths, only the points that rays need."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SAME_DEPTH_M = 1e-3  # depths are rounded to this; rows of the same depth are averaged
MOST = 200  # largest number of depths in a profile
TOLERANCE_M_S = 0.02  # largest error of thinning: a probe's resolution; 0.1 mm in a range of 10 m
LEAST_HEIGHT_M = 0.05  # thickness of the first layers over which scattered rows are averaged


def one_way(depth_m: Array) -> NDArray[np.int64]:
    """Return the row numbers of the probe's way down, if it and the way up each cover half of the depths; else all.

    In the second case the probe went one way only, however unevenly. ``depth_m`` (n,) is in the order of recording.
    """
    turn = int(np.argmax(depth_m))
    rows = np.arange(len(depth_m))
    half = (depth_m.max() - depth_m.min()) / 2
    parts = [part for part in (rows[: turn + 1], rows[turn:]) if len(part) > 1 and np.ptp(depth_m[part]) >= half]
    return parts[0] if len(parts) == 2 else rows


def largest_difference(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[float, float]:
    """Return the largest difference (m/s) of two profiles, and its depth (m); zeros if their depths do not overlap.

    They are compared at the first profile's depths within the second. A profile is (depths, ascending; speeds).
    """
    depths = first[0][(first[0] >= second[0][0]) & (first[0] <= second[0][-1])]
    if not len(depths):
        return 0.0, 0.0
    apart = np.abs(np.interp(depths, *first) - np.interp(depths, *second))
    return float(apart.max()), float(depths[np.argmax(apart)])


def ascending(depth_m: Array, speed_m_s: Array) -> tuple[Array, Array]:
    """Return depths, rounded to the millimetre and ascending, and the mean speed of the rows at each."""
    millimetre, group = np.unique(np.rint(depth_m / SAME_DEPTH_M), return_inverse=True)
    return millimetre * SAME_DEPTH_M, np.bincount(group, speed_m_s) / np.bincount(group)


@dataclass(frozen=True)
class Profile:
    """Sound speed by depth, ascending.

    The rows of the cast lie within TOLERANCE_M_S of the straight lines between these points. If ``averaged_m`` is not
    0, only their means over layers of this thickness do. ``scatter_m_s`` is the RMS of the rows about those lines.
    """

    depth_m: Array
    speed_m_s: Array
    averaged_m: float
    scatter_m_s: float


def thinned_profile(depth_m: Array, speed_m_s: Array) -> Profile:
    """Return a profile of at most MOST points from the rows (n,) of a cast, depths ascending.

    A straight line is split at the row farthest off it (in speed) until no row is farther than the tolerance (Ramer
    1972; Douglas & Peucker 1973). If too many rows remain, the rows scatter. Then they are first averaged over layers
    of 5 cm, 10 cm, 20 cm and so on. (A larger tolerance would keep the worst rows.)
    """
    height, depth, speed = 0.0, depth_m, speed_m_s
    while len(kept := _split(depth, speed, TOLERANCE_M_S)) > MOST:
        height = 2 * height if height else LEAST_HEIGHT_M
        depth, speed = _averaged(depth_m, speed_m_s, height)
    depth, speed = depth[kept], speed[kept]
    scatter = float(np.sqrt(np.mean((np.interp(depth_m, depth, speed) - speed_m_s) ** 2)))
    return Profile(depth, speed, height, scatter)


def _averaged(depth: Array, speed: Array, height: float) -> tuple[Array, Array]:
    """Return the means of depth and speed over layers of this height."""
    _, layer = np.unique(np.floor((depth - depth[0]) / height), return_inverse=True)
    count = np.bincount(layer)
    return np.bincount(layer, depth) / count, np.bincount(layer, speed) / count


def _split(depth: Array, speed: Array, tolerance: float) -> NDArray[np.int64]:
    """Return the numbers of the rows to keep: straight lines between them pass all others within the tolerance."""
    kept = np.zeros(len(depth), dtype=bool)
    kept[[0, -1]] = True
    waiting = [(0, len(depth) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        line = np.interp(depth[inner], depth[[first, last]], speed[[first, last]])
        off = np.abs(speed[inner] - line)
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = first + 1 + worst
            kept[middle] = True
            waiting += [(first, middle), (middle, last)]
    return np.flatnonzero(kept)
