"""The laser's points: from their positions to the sums of intervals, in one pass.

The formulas are those of :func:`pipeline.maths.adjustment.design_matrix.laser_point_design` and of the functional model
(:meth:`pipeline.adjustment.observation_model.ObservationModel.linearise`), which is this kernel's oracle in its test.
"""

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import arrays, compiled
from pipeline.maths.kernels.interval_group import COMMON, EDGE, FEATURES, V, WEIGHT, add_group, common_variance, weigh

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
F = 5
AT_45_DEG = float(np.sqrt(2) - 1)
NUMBERS, LINE, MATRIX, CUBE = arrays(int64, 1), arrays(float64, 1), arrays(float64, 2), arrays(float64, 3)
INTO_MATRIX, INTO_CUBE = arrays(float64, 2, written=True), arrays(float64, 3, written=True)
SUMS = (INTO_MATRIX, INTO_MATRIX, INTO_CUBE, INTO_CUBE, INTO_CUBE, INTO_MATRIX, INTO_MATRIX, INTO_MATRIX)


@compiled((
    MATRIX, LINE, LINE, NUMBERS, LINE, NUMBERS, NUMBERS, LINE, MATRIX, MATRIX, MATRIX, CUBE, CUBE, LINE, MATRIX, LINE,
    LINE, float64, LINE, *SUMS,
))  # fmt: skip
def sum_laser_points(
    points: Array, range_m: Array, edge: Array, surface: Integers, height: Array, record: Integers, slot: Integers,
    share: Array, positions: Array, lever_arm: Array, turns: Array, shift: Array, axes: Array, distance: Array,
    weights: Array, bounds: Array, white: Array, bin_width: float, sigmas: Array, statistics: Array, means: Array,
    normal: Array, swept: Array, swept_twice: Array, right: Array, right_swept: Array, scalars: Array,
) -> None:  # fmt: skip
    n, longest, start = len(range_m), 1, 0
    for p in range(1, n + 1):
        if p == n or record[p] != record[start]:
            longest = max(longest, p - start)
            start = p
    kept, q, r, ray = np.empty((longest, FEATURES + 2 * (F - 1))), np.empty(F), np.empty(3), np.empty(3)
    first = 0
    while first < n:
        k, end = record[first], first
        while end < n and record[end] == k:
            end += 1
        for p in range(first, end):
            s, row = surface[p], kept[p - first]
            A, along = axes[s], share[p]
            v = -distance[s] - height[p]
            for i in range(3):
                seen, arm = 0.0, 0.0
                for j in range(3):
                    body = positions[k, j] + along * (positions[k + 1, j] - positions[k, j])
                    seen += A[i, j] * (points[j, p] - body)
                    arm += A[i, j] * lever_arm[k, j]
                    if i == 2:
                        v += A[i, j] * points[j, p]
                r[i] = seen
                ray[i] = (seen - arm) / range_m[p]
            across = (range_m[p] * sigmas[1]) ** 2
            away = ray[2] * (sigmas[0] ** 2 - across)
            variance = away * ray[2] + across
            turning = across / range_m[p] * (1 - ray[2] * ray[2])
            incidence = (np.sign(ray[2]) - ray[2]) / AT_45_DEG
            change = shift[k, s]
            v += change[0] + change[1] * r[0] + change[2] * r[1] + change[3] * ray[2] + change[4] * incidence
            t0, t1, t2 = 0.0, 0.0, 0.0
            for j in range(3):
                t0 += A[0, j] * turns[k, j]
                t1 += A[1, j] * turns[k, j]
                t2 += A[2, j] * turns[k, j]
            alpha, beta = r[0] + t1 * r[2] - t2 * r[1], r[1] + t2 * r[0] - t0 * r[2]
            common = common_variance(A, alpha, beta, along, white)
            weight = weigh(v, variance, common, edge[p], s, weights, bounds, bin_width, statistics)
            row[V], row[WEIGHT], row[COMMON], row[EDGE] = v, weight, common, edge[p]
            row[FEATURES], row[FEATURES + 1] = alpha, beta
            row[FEATURES + 2], row[FEATURES + 3] = ray[2], incidence
            row[FEATURES + 4], row[FEATURES + 5] = away * ray[0] / variance, away * ray[1] / variance
            row[FEATURES + 6], row[FEATURES + 7] = turning / variance, -turning / AT_45_DEG / variance
            means[slot[p], 0] += weight
            means[slot[p], 1] += weight * v
        add_group(first, end, slot, share, kept, F, means, normal, swept, swept_twice, right, right_swept, scalars, q)
        first = end
