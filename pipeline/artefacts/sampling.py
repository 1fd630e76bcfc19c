"""Small, reproducible samples of streams. They serve searches, never a result."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch, point_array

_Array = NDArray[np.float64]
KEY_BITS = 20
ALL = 2**64 - 1  # the largest number that a row draws

Voxels = tuple[NDArray[np.int64], _Array]  # keys (v,); for each voxel the count and the sums of x, y, z (v, 4)


def points_above(batch: Batch, suffix: str, lowest_m: float) -> _Array:
    """Return a batch's points above a height.

    Parameters
    ----------
    batch : Batch
        Rows of a stream.
    suffix : str
        Frame and unit of the coordinates, such as "pool_m".
    lowest_m : float
        Least z, m.

    Returns
    -------
    (n, 3) array
    """
    points = point_array(batch, suffix)
    return np.asarray(points[points[:, 2] >= lowest_m])


def voxel_sums(points: _Array, voxel_m: float) -> Voxels:
    """Return counts and sums of points (n, 3) by voxel, a cube with the edge ``voxel_m``."""
    cells = np.floor(points / voxel_m).astype(np.int64) + (1 << (KEY_BITS - 1))
    keys, inverse = np.unique(
        (cells[:, 0] << (2 * KEY_BITS)) | (cells[:, 1] << KEY_BITS) | cells[:, 2], return_inverse=True
    )
    return keys, _sums(inverse, len(keys), np.column_stack([np.ones(len(points)), points]))


def voxel_means(partials: Iterable[Voxels]) -> _Array:
    """Return the mean points (n, 3) of voxels. Sparse voxels, mostly of outliers, are left out.

    A voxel must have at least 2 points, and at least 2 % of the points of a typical voxel.
    """
    keys, sums = np.empty(0, np.int64), np.empty((0, 4))
    for batch_keys, batch_sums in partials:
        keys, inverse = np.unique(np.concatenate([keys, batch_keys]), return_inverse=True)
        sums = _sums(inverse, len(keys), np.concatenate([sums, batch_sums]))
    if len(keys) == 0:
        return np.empty((0, 3))
    counts = np.sort(sums[:, 0])
    typical = counts[np.searchsorted(np.cumsum(counts), counts.sum() / 2)]  # half of all points lie in fuller voxels
    populated = sums[:, 0] >= max(2.0, 0.02 * typical)
    return np.asarray(sums[populated, 1:] / sums[populated, :1])


def _sums(group: NDArray[np.int64], groups: int, rows: _Array) -> _Array:
    """Return the sums (groups, c) of the rows (n, c) of each group; ``group`` (n,) is the group of each row."""
    return np.column_stack([np.bincount(group, weights=column, minlength=groups) for column in rows.T])


def sample_rows(batch: Batch, one_in: float) -> Batch:
    """Return about one in ``one_in`` rows. A hash of time and beam chooses them, so the batches do not matter."""
    if one_in <= 1:
        return batch
    mixed = batch["t_ns"].astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    if "beam" in batch:
        mixed += batch["beam"].astype(np.uint64)
    mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    chosen = np.flatnonzero((mixed >> np.uint64(40)) < np.uint64((1 << 24) / one_in))
    return {name: values[chosen] for name, values in batch.items()}


def scattered(t_ns: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Return numbers (n,) of 64 bits, as if drawn at random, that depend on the times (n,) alone.

    Steele et al. 2014, "Fast splittable pseudorandom number generators": the finalizer of SplitMix64.
    """
    x = t_ns.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        x = (x ^ (x >> np.uint64(shift))) * np.uint64(factor)
    return np.asarray(x ^ (x >> np.uint64(31)))
