"""Gaps of a wall: heights at which hardly any of its points lie, as between courses of blocks or of planks.

Behind a gap lie ledges, whose points begin at the wall's plane and would turn it. So gaps become masks of the face.
Gaps of one height that follow each other at one distance belong to the building, and are taken to go on below the
water: if they do not, soundings are lost, and nothing else.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FINEST_M, COARSEST_M = 0.02, 0.16  # heights of the bins
USUAL = 0.75  # quantile of the bins' points: up to three quarters of a wall may be gaps
FULL = 20  # points of a usual bin: with fewer the bins must be higher
EMPTY = 0.1  # of the points of a usual bin: a bin with fewer belongs to a gap
LEAST_M = 0.1  # a lower gap is none: less than the margin that soundings keep from both its ends
ALIKE_M = 0.04  # largest difference of gaps of one height, and of their places from a regular row
FURTHER_M = 0.005  # by which the place of a gap is less certain with each repeat
MOST = 60  # gaps of a face


def dry_gaps(heights_m: Array) -> Array:
    """Return the gaps (k, 2), lower and upper end, among the heights (n,) of a wall's points, from below.

    >>> courses = [np.arange(low, low + 0.5, 0.001) for low in (0.0, 1.0, 2.0)]
    >>> dry_gaps(np.concatenate(courses)).round(2).tolist()
    [[0.49, 1.01], [1.49, 2.01]]
    """
    none = np.empty((0, 2))
    if len(heights_m) < FULL:
        return none
    low, bin_m = float(heights_m.min()), FINEST_M
    while True:
        counts = np.bincount(np.floor((heights_m - low) / bin_m).astype(np.int64))
        usual = float(np.quantile(counts[counts > 0], USUAL))
        if usual >= FULL:
            break
        if bin_m >= COARSEST_M:
            return none
        bin_m *= 2
    full = np.flatnonzero(counts >= EMPTY * usual)  # a bin at an end is half full in the mean
    ends = [(low + bin_m * (below + 0.5), low + bin_m * (above + 0.5)) for below, above in pairwise(full.tolist())]
    return np.array([end for end in ends if end[1] - end[0] >= LEAST_M + bin_m / 2]).reshape(-1, 2)


def continued_gaps(gaps_m: Array, lowest_m: float) -> Array:
    """Return gaps (k, 2), from below; if they repeat, also those that follow below them, down to a height.

    Nobody has seen these: each is a little higher than the one above it.

    >>> continued_gaps(np.array([[0.5, 1.0], [1.5, 2.0]]), -1.0).round(2).tolist()
    [[-0.5, 0.0], [0.5, 1.0], [1.5, 2.0]]
    """
    if len(gaps_m) < 2:
        return gaps_m
    places, heights = gaps_m.mean(axis=1), np.diff(gaps_m, axis=1)[:, 0]
    period = float((places[-1] - places[0]) / (len(gaps_m) - 1))
    off = places - places[0] - period * np.arange(len(gaps_m))
    if np.ptp(heights) > ALIKE_M or np.abs(off).max() > ALIKE_M:
        return gaps_m
    count = min(int(np.ceil((gaps_m[0, 1] - lowest_m) / period)) - 1, MOST - len(gaps_m))
    repeats = np.arange(max(count, 0), 0, -1)[:, None]
    below = gaps_m[0] - repeats * period + FURTHER_M * repeats * np.array([-1.0, 1.0])
    return np.concatenate([below, gaps_m])
