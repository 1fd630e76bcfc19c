"""The soundings: from their positions in the sonar's frame to the sums of intervals, in one pass.

The formulas are those of :func:`pipeline.maths.adjustment.design_matrix.sonar_point_design` and of the functional model
(:meth:`pipeline.adjustment.observation_model.ObservationModel.linearise`), which is this kernel's oracle in its test.
"""

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import arrays, compiled
from pipeline.maths.kernels.interval_group import COMMON, EDGE, FEATURES, V, WEIGHT, add_group, common_variance, weigh

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
F = 12
TINY = float(np.finfo(np.float64).tiny)
AT_45_DEG = float(np.sqrt(2) - 1)
SPEED_M_S, FLATTEST, STEEPEST, FLATTEST_FAN, STEEPEST_BEAM = 1480.0, 0.05, 0.02, 0.25, 4.0
NUMBERS, LINE, MATRIX, CUBE = arrays(int64, 1), arrays(float64, 1), arrays(float64, 2), arrays(float64, 3)
INTO_MATRIX, INTO_CUBE = arrays(float64, 2, written=True), arrays(float64, 3, written=True)
SUMS = (INTO_MATRIX, INTO_MATRIX, INTO_CUBE, INTO_CUBE, INTO_CUBE, INTO_MATRIX, INTO_MATRIX, INTO_MATRIX)


@compiled()
def _bounded(value: float, least: float, sign: float) -> float:
    """Return |value|, at least ``least``, with the sign of ``sign``."""
    return np.copysign(max(abs(value), least), sign)


@compiled((
    MATRIX, LINE, NUMBERS, LINE, NUMBERS, NUMBERS, LINE, NUMBERS, MATRIX, CUBE, MATRIX, MATRIX, CUBE, CUBE, LINE, LINE,
    MATRIX, LINE, LINE, float64, LINE, *SUMS,
))  # fmt: skip
def sum_soundings(
    points: Array, edge: Array, surface: Integers, height: Array, record: Integers, slot: Integers, share: Array,
    ping: Integers, positions: Array, R_target_from_mbes: Array, lever_arm: Array, turns: Array, shift: Array, axes: Array,
    distance: Array, wet: Array, weights: Array, bounds: Array, white: Array, bin_width: float, sigmas: Array,
    statistics: Array, means: Array, normal: Array, swept: Array, swept_twice: Array, right: Array, right_swept: Array,
    scalars: Array,
) -> None:  # fmt: skip
    n, longest, start = len(edge), 1, 0
    for p in range(1, n + 1):
        if p == n or record[p] != record[start]:
            longest = max(longest, p - start)
            start = p
    kept, q = np.zeros((longest, FEATURES + 2 * (F - 1))), np.empty(F)
    r, ray, normal_mbes, along = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    depth = wet[1] - wet[0]
    first = 0
    while first < n:
        k, end = record[first], first
        while end < n and record[end] == k:
            end += 1
        for p in range(first, end):
            s, g, row = surface[p], ping[p], kept[p - first]
            A, R = axes[s], R_target_from_mbes[g]
            x, y, z = points[0, p], points[1, p], points[2, p]
            range_m = np.sqrt(x * x + y * y + z * z)
            up_of_ray, up_of_normal = 0.0, 0.0
            for i in range(3):
                along[i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z  # target frame
                normal_mbes[i] = A[2, 0] * R[0, i] + A[2, 1] * R[1, i] + A[2, 2] * R[2, i]
                up_of_normal += R[2, i] * normal_mbes[i]
            up_of_ray = along[2] / range_m
            v = -distance[s] - height[p]
            for i in range(3):
                seen = A[i, 0] * along[0] + A[i, 1] * along[1] + A[i, 2] * along[2]
                ray[i] = seen / range_m
                r[i] = seen + A[i, 0] * lever_arm[g, 0] + A[i, 1] * lever_arm[g, 1] + A[i, 2] * lever_arm[g, 2]
                v += A[2, i] * positions[g, i]
            v += r[2]
            z_of_point = A[0, 2] * r[0] + A[1, 2] * r[1] + A[2, 2] * r[2] + positions[g, 2]
            high = (z_of_point - wet[0]) / depth
            slant = _bounded(ray[2], FLATTEST, ray[2])
            reached = min(max(range_m - v / slant, range_m / 2), 2 * range_m)
            radius = np.sqrt(y * y + z * z)
            slope = min(radius / max(abs(z), TINY), STEEPEST_BEAM)
            side = (normal_mbes[0] * np.copysign(radius, -z) + normal_mbes[2] * x * slope) / range_m  # n · a
            angle = sigmas[1] * sigmas[1]
            variance = (sigmas[0] * ray[2]) ** 2 + (reached * side) ** 2 * angle
            pr, c = y / range_m, -z / range_m
            steep = _bounded(c, FLATTEST_FAN, c)
            curved = normal_mbes[1] * pr + normal_mbes[2] * pr * pr * (1 - pr * pr) / steep**3
            mean = reached * angle * (slant * (0.5 + (side / slant) ** 2) - curved / 2) * weights[0, s]
            down = _bounded(z, STEEPEST * range_m, -z)
            steering = normal_mbes[0] * x + normal_mbes[1] * y + normal_mbes[2] * (x * x + y * y) / down
            speed = steering + ray[2] * range_m
            gradient = (up_of_normal - 2 * up_of_ray * ray[2]) * range_m**2 / (2 * SPEED_M_S)
            projector = ray[2] / (2 * range_m)
            incidence = (np.sign(ray[2]) - ray[2]) / AT_45_DEG
            row[FEATURES], row[FEATURES + 1], row[FEATURES + 2] = r[0], r[1], ray[2]
            row[FEATURES + 3], row[FEATURES + 4], row[FEATURES + 5] = speed, gradient, steering
            row[FEATURES + 6], row[FEATURES + 7], row[FEATURES + 8] = projector * x, projector * y, projector * z
            row[FEATURES + 9], row[FEATURES + 10] = incidence, 4 * high * (1 - high)
            change = shift[k, s]
            v += change[0] - mean
            for f in range(F - 1):
                v += change[f + 1] * row[FEATURES + f]
            t0, t1, t2 = 0.0, 0.0, 0.0
            for j in range(3):
                t0 += A[0, j] * turns[k, j]
                t1 += A[1, j] * turns[k, j]
                t2 += A[2, j] * turns[k, j]
            alpha, beta = r[0] + t1 * r[2] - t2 * r[1], r[1] + t2 * r[0] - t0 * r[2]
            row[FEATURES], row[FEATURES + 1] = alpha, beta
            slopes = FEATURES + F - 1
            row[slopes], row[slopes + 1] = ray[0] / slant, ray[1] / slant
            row[slopes + 3], row[slopes + 4] = speed / range_m / slant, 2 * gradient / range_m / slant
            row[slopes + 5] = steering / range_m / slant
            row[slopes + 10] = 4 * (1 - 2 * high) / depth * up_of_ray / slant
            common = common_variance(A, alpha, beta, share[p], white)
            weight = weigh(v, variance, common, edge[p], s, weights, bounds, bin_width, statistics)
            row[V], row[WEIGHT], row[COMMON], row[EDGE] = v, weight, common, edge[p]
            means[slot[p], 0] += weight
            means[slot[p], 1] += weight * v
        add_group(first, end, slot, share, kept, F, means, normal, swept, swept_twice, right, right_swept, scalars, q)
        first = end
