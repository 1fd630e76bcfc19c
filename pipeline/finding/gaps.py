"""Gaps of a wall: heights at which hardly any of its points lie, as between courses of blocks or of planks.

Behind a gap lie ledges, whose points begin at the wall's plane and would turn it. So gaps become masks of the face.
Gaps of one height that follow each other at one distance, down to where the wall was seen, belong to the building, and
are taken to go on below the water: if they do not, soundings are lost, and nothing else.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FINEST_M, COARSEST_M = 0.02, 0.04  # heights of the bins: coarser ones could not say where a gap ends
USUAL = 0.75  # quantile of the bins' points: up to three quarters of a wall may be gaps
FULL = 20  # points of a usual bin: with fewer the bins must be higher
EMPTY = 0.2  # of the points of a usual bin: a bin with fewer may belong to a gap; in its mean they are half as many
LEAST_M = 0.2  # a lower gap is none: on a far wall in calm water the scanner's lines may be as far apart
ALIKE_M = 0.04  # largest difference of gaps of one height, and of their places from a regular row
FURTHER_M = 0.005  # by which the place of a gap is less certain with each repeat
COURSE_M = 0.1  # least height of a course between two gaps that nobody has seen
MOST = 30  # gaps of a face that were seen, and that were not


def dry_gaps(heights_m: Array) -> Array:
    """Return the gaps (k, 2), lower and upper end, among the heights (n,) of a wall's points, from below.

    >>> courses = [np.arange(low, low + 0.5, 0.001) for low in (0.0, 1.0, 2.0)]
    >>> dry_gaps(np.concatenate(courses)).round(2).tolist()
    [[0.49, 1.01], [1.49, 2.01]]
    """
    low, bin_m, counts, usual = _bins(heights_m)
    full = np.flatnonzero(counts >= EMPTY * usual)  # a bin at an end is half full in the mean
    gaps = [
        (low + bin_m * (below + 0.5), low + bin_m * (above + 0.5))
        for below, above in pairwise(full.tolist())
        if bin_m * (above - below) >= LEAST_M and counts[below + 1 : above].mean() <= EMPTY * usual / 2
    ]
    return np.array(gaps).reshape(-1, 2)[:MOST]


def top_m(heights_m: Array) -> float:
    """Return the height up to which a wall has points, among their heights (n,); inf if they are too few to tell.

    >>> wall, strip_beside_it = np.arange(0.0, 2.0, 0.001), np.arange(2.0, 3.0, 0.02)
    >>> round(top_m(np.concatenate([wall, strip_beside_it])), 2)
    2.0
    """
    low, bin_m, counts, usual = _bins(heights_m)
    full = np.flatnonzero(counts >= EMPTY * usual)
    return low + bin_m * (int(full[-1]) + 1) if len(full) else np.inf


def _bins(heights_m: Array) -> tuple[float, float, NDArray[np.int64], float]:
    """Return the lowest height, the height of a bin, the points of each and of a usual one; no bins of few points."""
    few = 0.0, COARSEST_M, np.empty(0, dtype=np.int64), 0.0
    if len(heights_m) < FULL:
        return few
    low, bin_m = float(heights_m.min()), FINEST_M
    while True:
        counts = np.bincount(np.floor((heights_m - low) / bin_m).astype(np.int64))
        usual = float(np.quantile(counts[counts > 0], USUAL))
        if usual >= FULL:
            return low, bin_m, counts, usual
        if bin_m >= COARSEST_M:
            return few
        bin_m *= 2


def in_gaps(heights_m: Array, gaps_m: Array) -> NDArray[np.bool_]:
    """Return which heights (n,) lie in one of the gaps (k, 2), or at its ends, where ledges are."""
    inside = (heights_m[:, None] > gaps_m[:, 0] - FINEST_M) & (heights_m[:, None] < gaps_m[:, 1] + FINEST_M)
    return np.asarray(inside.any(axis=1))


def gaps_below(gaps_m: Array, seen_m: float, lowest_m: float) -> Array:
    """Return the gaps (k, 2) that follow below those that were seen (n, 2), if these repeat down to the lowest points.

    Nobody has seen them: each is a little higher than the one above it.

    Parameters
    ----------
    gaps_m : (n, 2) array
        Gaps that were seen, from below.
    seen_m : float
        Height of the wall's lowest points: the next gap must reach below it.
    lowest_m : float
        Height at which the face ends.

    >>> gaps_below(np.array([[0.5, 1.0], [1.5, 2.0]]), 0.0, -1.0).round(2).tolist()
    [[-0.5, 0.0]]
    >>> gaps_below(np.array([[1.5, 2.0], [2.5, 3.0]]), 0.0, -1.0).tolist()  # the wall is whole from 0.0 to 1.5 m
    []
    """
    none = np.empty((0, 2))
    if len(gaps_m) < 2:
        return none
    places, heights = gaps_m.mean(axis=1), np.diff(gaps_m, axis=1)[:, 0]
    period = float((places[-1] - places[0]) / (len(gaps_m) - 1))
    off = places - places[0] - period * np.arange(len(gaps_m))
    if np.ptp(heights) > ALIKE_M or np.abs(off).max() > ALIKE_M or gaps_m[0, 0] - period > seen_m + ALIKE_M:
        return none
    down = int(np.ceil((gaps_m[0, 1] - lowest_m) / period)) - 1
    thin = int((period - float(heights.mean()) - COURSE_M) / (2 * FURTHER_M))
    repeats = np.arange(max(min(down, thin, MOST), 0), 0, -1)[:, None]
    return np.asarray(gaps_m[0] - repeats * period + FURTHER_M * repeats * np.array([-1.0, 1.0]))
