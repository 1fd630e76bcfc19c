"""Means of residuals by bin, along one variable or over the cells of a face; the grid of cells on a face.

All means are weighted with the robust weights w of the adjustment, mean = Σ w v / Σ w and rms = root(Σ w v² / Σ w). So
residuals that the adjustment rejected do not hide systematic ones. A bin with no weight above zero has NaN for both.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class BinStatistics:
    """Statistics of residuals by bin: keys (b, k), one row per bin, ascending; count, mean and RMS (b,) each."""

    keys: Integers
    count: Integers
    mean_m: Array
    rms_m: Array


def bin_statistics(keys: Integers, residual_m: Array, weight: Array) -> BinStatistics:
    """Compute count, mean and RMS of residuals by bin.

    Parameters
    ----------
    keys
        Integer keys (n, k) of the bin of each residual, for example (family, pass, number of the bin).
    residual_m, weight
        Residuals and their weights (n,).

    >>> bin_statistics(np.array([[0], [0], [5]]), np.array([1.0, 3.0, 2.0]), np.array([1.0, 1.0, 0.5])).mean_m
    array([2., 2.])
    """
    if not len(keys):
        return BinStatistics(keys, np.empty(0, dtype=np.int64), np.empty(0), np.empty(0))
    low, spans = keys.min(axis=0), np.ptp(keys, axis=0) + 1
    flat, inverse = np.unique(np.ravel_multi_index((keys - low).T, spans), return_inverse=True)
    bins, size = np.column_stack(np.unravel_index(flat, spans)) + low, len(flat)
    w, wv, wvv = (
        np.bincount(inverse, weights=part, minlength=size)
        for part in (weight, weight * residual_m, weight * residual_m**2)
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, rms = wv / w, np.sqrt(wvv / w)
    return BinStatistics(bins, np.bincount(inverse, minlength=size), mean, rms)


def lies_flat(normal: Array) -> bool:
    """Return whether a face slopes by less than 30°, so that it is best seen from above; no bank of 1 : 1.5 does."""
    return bool(abs(normal[2]) > np.sqrt(0.75))


def face_axes(normal: Array) -> Array:
    """Return two unit vectors (2, 3) in a face: to the right as seen from in front of it, and up the face.

    For a face that lies flat, they are the frame's x and y axes, or those turned into the face.

    >>> face_axes(np.array([-1.0, 0.0, 0.0]))
    array([[ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    >>> face_axes(np.array([0.0, 0.0, -1.0]))
    array([[1., 0., 0.],
           [0., 1., 0.]])
    """
    if lies_flat(normal):
        first = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        first /= np.linalg.norm(first)
        return np.stack([first, np.sign(normal[2]) * np.cross(normal, first)]) + 0.0
    first = np.cross([0.0, 0.0, 1.0], normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)]) + 0.0


def cells_on_face(points_m: Array, normal: Array, size_m: float) -> Integers:
    """Return the numbers (n, 2) of the square cells of points on a face, from the origin along :func:`face_axes`.

    Parameters
    ----------
    points_m
        Points (n, 3), target frame.
    normal
        Unit normal (3,) of the face.
    size_m
        Side of a cell.
    """
    return np.floor(points_m @ face_axes(normal).T / size_m).astype(np.int64)


def cell_centres(cells: Integers, normal: Array, distance_m: float, size_m: float) -> Array:
    """Return the centres (n, 3) m of cells on the face normal · x = distance.

    Parameters
    ----------
    cells
        Numbers (n, 2) from :func:`cells_on_face`.
    normal, distance_m
        Unit normal (3,) and distance of the face.
    size_m
        Side of a cell.
    """
    axes = face_axes(normal)
    flat = (cells + 0.5) * size_m @ axes
    return np.asarray(flat + np.outer(distance_m - flat @ normal, normal))
