"""The soundings: from their places in the sonar's frame to the sums of intervals, in one pass.

The formulas are those of :func:`pipeline.maths.adjustment.design_matrix.sonar_point_design` and of the functional model
(:meth:`pipeline.adjustment.observation_model.ObservationModel.linearise`), which is this loop's oracle in its test.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import AT_45_DEG, FLATTEST, FLATTEST_FAN, SPEED_M_S, STEEPEST
from pipeline.maths.kernels.compiled import compiled, named
from pipeline.maths.kernels.interval_group import (
    COMMON,
    CUBE,
    EDGE,
    FEATURES,
    LINE,
    MATRIX,
    NOISE,
    NUMBERS,
    POINTS,
    RECORDS,
    SUMS,
    SURFACES,
    WEIGHT,
    Noise,
    Points,
    Records,
    Sums,
    Surfaces,
    V,
    add_group,
    common_variance,
    largest_group,
    mirror,
    weigh,
)
from pipeline.maths.sonar.soundings import STEEPEST as STEEPEST_BEAM

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
F = 12  # features q: 1, α, β, range, sound speed, its gradient, steering, projector (3), incidence, bow
SLOPES = FEATURES + F - 1
TINY = float(np.finfo(np.float64).tiny)


class SonarPoses(NamedTuple):
    """Poses of the pings, target frame.

    ping (n,) of the points; of each ping position_m (p, 3) of the body, R_target_from_mbes (p, 3, 3), lever_arm_m
    (p, 3); wet_m (2,): heights of the faces' lower end and of the water's surface.
    """

    ping: Integers
    position_m: Array
    R_target_from_mbes: Array
    lever_arm_m: Array
    wet_m: Array


POSES = named(SonarPoses, NUMBERS, MATRIX, CUBE, MATRIX, LINE)


@compiled()
def _bounded(value: float, least: float, sign: float) -> float:
    """Return |value|, at least ``least``, with the sign of ``sign``."""
    size = max(abs(value), least)
    return size if np.copysign(1.0, sign) > 0 else -size


@compiled((POINTS, POSES, RECORDS, SURFACES, NOISE, SUMS))
def sum_soundings(
    points: Points, poses: SonarPoses, records: Records, surfaces: Surfaces, noise: Noise, sums: Sums
) -> None:
    """Add the soundings to the sums of their slots, and to the statistics of their surfaces."""
    n = len(points.record)
    kept, q = np.zeros((largest_group(points.record), FEATURES + 2 * (F - 1))), np.empty(F)
    r, ray, normal, along = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    depth, angle = poses.wet_m[1] - poses.wet_m[0], noise.angle_rad * noise.angle_rad
    first = 0
    while first < n:
        k, end = points.record[first], first
        while end < n and points.record[end] == k:
            end += 1
        for p in range(first, end):
            s, g, row = points.surface[p], poses.ping[p], kept[p - first]
            A, R = surfaces.axes[s], poses.R_target_from_mbes[g]
            x, y, z = points.place_m[0, p], points.place_m[1, p], points.place_m[2, p]
            range_m = np.sqrt(x * x + y * y + z * z)
            up_of_normal = 0.0
            for i in range(3):
                along[i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z  # target frame
                normal[i] = A[2, 0] * R[0, i] + A[2, 1] * R[1, i] + A[2, 2] * R[2, i]  # the sonar's
                up_of_normal += R[2, i] * normal[i]
            up_of_ray = along[2] / range_m
            v = -surfaces.distance_m[s] - points.height_m[p]
            for i in range(3):
                seen = A[i, 0] * along[0] + A[i, 1] * along[1] + A[i, 2] * along[2]
                ray[i] = seen / range_m
                r[i] = seen + (
                    A[i, 0] * poses.lever_arm_m[g, 0] + A[i, 1] * poses.lever_arm_m[g, 1]
                    + A[i, 2] * poses.lever_arm_m[g, 2]
                )  # fmt: skip
                v += A[2, i] * poses.position_m[g, i]
            v += r[2]
            z_of_point = A[0, 2] * r[0] + A[1, 2] * r[1] + A[2, 2] * r[2] + poses.position_m[g, 2]
            high = (z_of_point - poses.wet_m[0]) / depth
            slant = _bounded(ray[2], FLATTEST, ray[2])
            reached = min(max(range_m - v / slant, range_m / 2), 2 * range_m)
            radius = np.sqrt(y * y + z * z)
            slope = min(radius / max(abs(z), TINY), STEEPEST_BEAM)
            side = (normal[0] * np.copysign(radius, -z) + normal[2] * x * slope) / range_m  # n · a
            variance = (noise.range_m * ray[2]) ** 2 + (reached * side) ** 2 * angle
            pr, c = y / range_m, -z / range_m
            steep = _bounded(c, FLATTEST_FAN, c)
            curved = normal[1] * pr + normal[2] * pr * pr * (1 - pr * pr) / steep**3
            mean = reached * angle * (slant * (0.5 + (side / slant) ** 2) - curved / 2) * noise.factor[s]
            down = _bounded(z, STEEPEST * range_m, -z)
            steering = normal[0] * x + normal[1] * y + normal[2] * (x * x + y * y) / down
            speed = steering + ray[2] * range_m
            gradient = (up_of_normal - 2 * up_of_ray * ray[2]) * range_m**2 / (2 * SPEED_M_S)
            projector = ray[2] / (2 * range_m)
            row[FEATURES], row[FEATURES + 1], row[FEATURES + 2] = r[0], r[1], ray[2]
            row[FEATURES + 3], row[FEATURES + 4], row[FEATURES + 5] = speed, gradient, steering
            row[FEATURES + 6], row[FEATURES + 7], row[FEATURES + 8] = projector * x, projector * y, projector * z
            row[FEATURES + 9] = (np.sign(ray[2]) - ray[2]) / AT_45_DEG
            row[FEATURES + 10] = 4 * high * (1 - high)
            shift = records.shift[k, s]
            v += shift[0] - mean
            for f in range(F - 1):
                v += shift[f + 1] * row[FEATURES + f]
            t0, t1, t2 = 0.0, 0.0, 0.0
            for j in range(3):
                t0 += A[0, j] * records.turns[k, j]
                t1 += A[1, j] * records.turns[k, j]
                t2 += A[2, j] * records.turns[k, j]
            alpha, beta = r[0] + t1 * r[2] - t2 * r[1], r[1] + t2 * r[0] - t0 * r[2]
            row[FEATURES], row[FEATURES + 1] = alpha, beta
            row[SLOPES], row[SLOPES + 1] = ray[0] / slant, ray[1] / slant
            row[SLOPES + 3], row[SLOPES + 4] = speed / range_m / slant, 2 * gradient / range_m / slant
            row[SLOPES + 5] = steering / range_m / slant
            row[SLOPES + 10] = 4 * (1 - 2 * high) / depth * up_of_ray / slant
            row[V], row[EDGE] = v, points.edge[p]
            row[COMMON] = common_variance(A, alpha, beta, points.share[p], noise.white)
            weigh(row, variance, s, noise, sums.statistics)
            sums.means[points.slot[p], 0] += row[WEIGHT]
            sums.means[points.slot[p], 1] += row[WEIGHT] * v
        add_group(first, end, points, kept, q, sums)
        first = end
    mirror(sums)
