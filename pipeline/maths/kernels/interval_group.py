"""Loops shared by the sums of both sensors, second part: what a point counts, and the sums of a group of points.

A *group* is the points between two INS records, on all surfaces. Its points are looked at twice: first for their
weights and distances, whose weighted means tell the noise that an interval's points share
(:func:`pipeline.maths.adjustment.design_matrix.sensor_noise`), then for the sums. In between they lie in ``kept``,
which stays in the processor's cache.
"""

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import compiled
from pipeline.maths.kernels.interval_slots import add_point, robust_weight

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
COUNT, CUT, REDUCED, INFORMATION, FIRST_BIN = 0, 1, 2, 3, 4  # columns of the statistics of a surface
V, WEIGHT, COMMON, EDGE, FEATURES = 0, 1, 2, 3, 4  # columns of ``kept``; slopes follow the features


@compiled()
def common_variance(axes: Array, alpha: float, beta: float, share: float, white: Array) -> float:
    """Return the variance of the records' white noise in v, :func:`pipeline.maths.adjustment.weighting.common_variance`.

    v changes by n · δ + ω · (β t1 - α t2); ``axes`` has the rows t1, t2, n.
    """
    total = 0.0
    for i in range(3):
        moved, turned = white[i] * axes[2, i], white[3 + i] * (beta * axes[0, i] - alpha * axes[1, i])
        total += moved * moved + turned * turned
    return ((1.0 - share) * (1.0 - share) + share * share) * total


@compiled()
def weigh(
    v: float, variance: float, common: float, edge: float, surface: int, weights: Array, bounds: Array, bin_width: float,
    statistics: Array,
) -> float:  # fmt: skip
    """Return the full weight of a point, and count it among the observations of its surface.

    ``weights`` (3, s): variance factors, edge shares, robust scales; ``bounds`` (2,): k0 and k1 of IGG III.
    """
    scaled = weights[0, surface] * variance
    normalised = v / np.sqrt(scaled + common)
    robust = robust_weight(normalised / weights[2, surface], bounds[0], bounds[1])
    of_surface = statistics[surface]
    of_surface[COUNT] += 1.0
    if robust == 0.0:
        of_surface[CUT] += 1.0
    elif robust < 1.0:
        of_surface[REDUCED] += 1.0
    if robust > 0.0:
        of_surface[INFORMATION] += edge
    of_surface[FIRST_BIN + min(int(min(abs(normalised) / bin_width, 1e9)), len(of_surface) - FIRST_BIN - 1)] += 1.0
    return robust * edge / (scaled * weights[1, surface])


@compiled()
def add_group(
    first: int, end: int, slot: Integers, share: Array, kept: Array, features: int, means: Array, normal: Array,
    swept: Array, swept_twice: Array, right: Array, right_swept: Array, scalars: Array, q: Array,
) -> None:  # fmt: skip
    """Add the points first to end to the sums of their slots, with the features at the adjusted points.

    ``means`` (slots, 2): Σ w and Σ w v; ``scalars`` (slots, 3): Σ w v², Σ e, Σ e², added to; ``q`` (F,): scratch.
    """
    for p in range(first, end):
        row = kept[p - first]
        w, v = row[WEIGHT], row[V]
        if w <= 0.0:
            continue
        g = slot[p]
        information = row[COMMON] * means[g, 0]
        noise = v - information / (1.0 + information) * (means[g, 1] / means[g, 0])
        q[0] = 1.0
        for f in range(1, features):
            q[f] = row[FEATURES + f - 1] - row[FEATURES + features + f - 2] * noise
        add_point(q, v, share[p], w, normal[g], swept[g], swept_twice[g], right[g], right_swept[g])
        scalars[g, 0] += w * v * v
        scalars[g, 1] += row[EDGE]
        scalars[g, 2] += row[EDGE] * row[EDGE]
