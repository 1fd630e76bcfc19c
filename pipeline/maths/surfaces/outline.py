"""Outlines of planes: the convex polygon of points in a plane, made smaller, and cut off at a line.

Coordinates are those in the plane, (n, 2) m; polygons (k, 2) are convex and counter-clockwise.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def convex_hull(points_m: Array) -> Array:
    """Return the smallest convex polygon round points; empty if they lie on a line.

    >>> sorted(convex_hull(np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0]])).tolist())
    [[0.0, 0.0], [0.0, 2.0], [2.0, 0.0], [2.0, 2.0]]
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points_m[ConvexHull(points_m).vertices])  # counter-clockwise
    except (QhullError, ValueError):
        return np.empty((0, 2))


def _turn(a: Array, b: Array, c: Array) -> float:
    """Return twice the area of the triangle a, b, c: above zero if it turns to the left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def clipped(polygon_m: Array, inward: Array, offset_m: float) -> Array:
    """Return the part of a polygon with ``inward · x >= offset_m``; empty if there is none.

    Sutherland & Hodgman 1974, "Reentrant polygon clipping": corners inside stay, edges that cross get a corner there.
    """
    if not len(polygon_m):
        return polygon_m
    beyond = polygon_m @ inward - offset_m
    corners = []
    for k, (point, height) in enumerate(zip(polygon_m, beyond, strict=True)):
        before, height_before = polygon_m[k - 1], beyond[k - 1]
        if (height >= 0) != (height_before >= 0):
            share = height_before / (height_before - height)
            corners.append(before + share * (point - before))
        if height >= 0:
            corners.append(point)
    found = np.array(corners).reshape(-1, 2)
    if len(found):
        found = found[np.any(np.abs(found - np.roll(found, 1, axis=0)) > 0, axis=1)]
    return found if len(found) > 2 else np.empty((0, 2))


def shrunk(polygon_m: Array, margin_m: float) -> Array:
    """Return the polygon whose edges lie inside those of this one by a margin; empty if it is too narrow."""
    found = polygon_m
    for start, end in zip(polygon_m, np.roll(polygon_m, -1, axis=0), strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        inward = np.array([-along[1], along[0]])
        found = clipped(found, inward, float(inward @ start) + margin_m)
    return found


def simplified(polygon_m: Array, corners: int) -> Array:
    """Return the polygon with at most these corners; those that cut off least are left out, so it lies inside."""
    found = list(polygon_m)
    while len(found) > max(corners, 3):
        cut = [_turn(found[k - 1], found[k], found[(k + 1) % len(found)]) for k in range(len(found))]
        found.pop(int(np.argmin(cut)))
    return np.array(found).reshape(-1, 2)


def bent(polygon_m: Array, least_m: float) -> Array:
    """Return the polygon without corners that are nearer than ``least_m`` to the line from one neighbour to the other.

    >>> len(bent(np.array([[0.0, 0.0], [1.0, -0.001], [2.0, 0.0], [2.0, 2.0]]), 0.02))
    3
    """
    found = list(polygon_m)
    while len(found) > 3:
        before, after = np.roll(found, 1, axis=0), np.roll(found, -1, axis=0)
        chord = np.linalg.norm(after - before, axis=1)
        off = [_turn(*corners) for corners in zip(before, found, after, strict=True)] / np.maximum(chord, 1e-9)
        if off.min() >= least_m:
            break
        found.pop(int(np.argmin(off)))
    return np.array(found).reshape(-1, 2)


def inside(polygon_m: Array, points_m: Array) -> NDArray[np.bool_]:
    """Return whether points (n, 2) lie in a polygon or on its edges."""
    found = np.ones(len(points_m), dtype=bool)
    for start, end in zip(polygon_m, np.roll(polygon_m, -1, axis=0), strict=True):
        along, away = end - start, points_m - start
        found &= along[0] * away[:, 1] - along[1] * away[:, 0] >= 0
    return found


def area(polygon_m: Array) -> float:
    """Return the area of a polygon, m².

    >>> area(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]]))
    6.0
    """
    after = np.roll(polygon_m, -1, axis=0)
    return float(np.sum(polygon_m[:, 0] * after[:, 1] - polygon_m[:, 1] * after[:, 0]) / 2)
