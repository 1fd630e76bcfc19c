"""How flat a plane of a point cloud is: its unevenness, its bow, its extent, and how much of it is seen.

The points are gathered in square cells of the plane, not in voxels: a wall that lies along the sides of voxels is cut
by them at random, and the cut biases the means. The mean distance of a cell's points from the plane has little noise.
So the RMS of the cells' means is the *unevenness* of the surface itself, on the scale of a cell.

A *bow*, as of a quay built on a curve or a ship's side, is the part of the second order: of the least-squares surface
a + b u + c w + d u² + e u w + f w² over the cells, u and w along the plane, the largest less the smallest height that
the terms of second order alone reach after a plane has been fitted to them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
FEWEST = 4  # points of a cell that counts
FEWEST_CELLS = 8  # cells for a surface of second order
THICK, THIN_M = 2.5, 0.01  # a cell sees two surfaces if its points scatter by more, in quartiles of the cells, and m
FEW = 0.1  # of the points of the median cell: one with fewer tells nothing of the surface's form
COUNTED = 1_000_000  # cells, with points or without, that are counted however few the points are


@dataclass(frozen=True)
class Flatness:
    """width_m, height_m: extent along the first and the second axis of the cells' points; uneven_m: RMS of their means.

    bow_m: height that the second order reaches, 0 with few cells; both without cells that have far fewer points than
    the others, as at the edge of what stands behind; covered: cells with points, as a share of those within the extent.
    """

    width_m: float
    height_m: float
    uneven_m: float
    bow_m: float
    covered: float


def plane_axes(normal: Array) -> Array:
    """Return two unit vectors (2, 3) in the plane with this normal: the first level, the second as upright as can be.

    With the normal they make a right-handed system. In a level plane the first points along x.

    >>> plane_axes(np.array([-1.0, 0.0, 0.0])).tolist()
    [[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    level = np.array([-normal[1], normal[0], 0.0])
    length = float(np.linalg.norm(level))
    level = level / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    up = np.cross(normal, level)
    return np.array([level, up / np.linalg.norm(up)]) + 0.0  # no negative zeros


def cells_of(in_plane_m: Array, cell_m: float) -> tuple[Integers, Integers, Integers]:
    """Return the cells (c, 2) of a plane that have points, ascending, the cell of each point (n,), and their counts.

    Each cell of the rectangle round the points has one number. Points are counted by it, without any sorting, unless
    the rectangle is far larger than what they fill.
    """
    cell = np.floor(in_plane_m.T / cell_m).astype(np.int64, order="C")  # each axis in one block of memory
    if not cell.size:
        return cell.T, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    low = cell.min(axis=1)
    rows, span = (cell.max(axis=1) - low + 1).tolist()
    number = (cell[0] - low[0]) * span + cell[1] - low[1]
    if rows * span > max(COUNTED, 4 * len(number)):
        codes, inverse, count = np.unique(number, return_inverse=True, return_counts=True)
    else:
        every = np.bincount(number)
        codes = np.flatnonzero(every)
        row_of = np.empty(len(every), dtype=np.int64)
        row_of[codes] = np.arange(len(codes))
        inverse, count = row_of[number], every[codes]
    return np.column_stack(np.divmod(codes, span)) + low, inverse.reshape(-1), count


def flatness(in_plane_m: Array, away_m: Array, cell_m: float) -> Flatness:
    """Return how flat a plane is.

    Parameters
    ----------
    in_plane_m : (n, 2) array
        Places of its points along the axes of :func:`plane_axes`, m.
    away_m : (n,) array
        Their distances from the plane, m.
    cell_m : float
        Length of the side of a cell.
    """
    keys, inverse, count = cells_of(in_plane_m, cell_m)
    use = count >= FEWEST
    if not use.any():
        return Flatness(0.0, 0.0, 0.0, 0.0, 0.0)
    totals = np.array(
        [np.bincount(inverse, weights=axis, minlength=len(keys)) for axis in (*in_plane_m.T, away_m)]
    )
    u, w, mean = totals[:, use] / count[use]
    usual = count[use] >= FEW * np.median(count[use])
    place, mean = np.array([u, w])[:, usual], mean[usual]
    spans = np.ptp(keys[use], axis=0) + 1
    width, height = np.ptp(in_plane_m[use[inverse]], axis=0).tolist()
    plane = _design(place)[:, :3]
    flat = mean - plane @ np.linalg.lstsq(plane, mean, rcond=None)[0]
    return Flatness(
        width_m=float(width),
        height_m=float(height),
        uneven_m=float(np.sqrt(np.mean(flat**2))),
        bow_m=_bow(place, mean) if len(mean) >= FEWEST_CELLS and np.all(spans > 2) else 0.0,
        covered=float(use.sum() / np.prod(spans)),
    )


def of_one_surface(mean_m: Array, squares_m2: Array) -> NDArray[np.bool_]:
    """Return whether cells (c,) see one surface, by the means of their points' distances and of the squares of these.

    The edge of a ledge behind the plane makes the points of a cell scatter far more than those of most.

    >>> of_one_surface(np.zeros(4), np.array([0.005, 0.006, 0.007, 0.040]) ** 2).tolist()
    [True, True, True, False]
    """
    scatter = np.sqrt(np.maximum(squares_m2 - mean_m**2, 0.0))
    return scatter <= max(THICK * float(np.quantile(scatter, 0.25)), THIN_M) if len(scatter) else scatter < 0


def _design(place: Array) -> Array:
    """Return the columns (n, 6) 1, u, w, u², u w, w² of places (2, n)."""
    u, w = place - place.mean(axis=1, keepdims=True)
    return np.column_stack([np.ones(len(u)), u, w, u * u, u * w, w * w])


def _bow(place: Array, mean: Array) -> float:
    design = _design(place)
    second = design[:, 3:] @ np.linalg.lstsq(design, mean, rcond=None)[0][3:]
    plane = design[:, :3]
    return float(np.ptp(second - plane @ np.linalg.lstsq(plane, second, rcond=None)[0]))
