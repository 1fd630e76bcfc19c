"""The soundings: from their places in the sonar's frame to the sums of intervals, in one pass.

The formulas are those of :func:`pipeline.maths.adjustment.design_matrix.sonar_point_design` and of the functional model
(:meth:`pipeline.adjustment.observation_model.ObservationModel.linearise`), which is this loop's oracle in its test.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import AT_45_DEG, FLATTEST, FLATTEST_FAN, SPEED_M_S, STEEPEST
from pipeline.maths.kernels.compiled import CUBE, LINE, MATRIX, NUMBERS, compiled, named
from pipeline.maths.kernels.interval_group import (
    COMMON,
    COSINE,
    EDGE,
    FEATURES,
    MEAN,
    NOISE,
    POINTS,
    RECORDS,
    SCRATCH,
    SUMS,
    SURFACES,
    GroupScratch,
    Noise,
    Points,
    Records,
    Sums,
    Surfaces,
    V,
    add_group,
    common_variance,
    mirror,
    turn_features,
    weigh,
)
from pipeline.maths.sonar.soundings import STEEPEST as STEEPEST_BEAM

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
F = 12  # features q: 1, α, β, range, sound speed, its gradient, steering, projector (3), incidence, bow
SLOPES = FEATURES + F - 1
FROM_BODY, RAY, NORMAL = 0, 1, 2  # rows of the vectors of a sounding
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


@compiled()
def _see(p: int, points: Points, poses: SonarPoses, surfaces: Surfaces, seen: Array) -> float:
    """Write a sounding's vectors, surface axes but for the normal, and return its distance from the surface.

    ``seen`` (3, 3): its rows are R, the vector from the body; RAY, the unit vector along the ray; NORMAL, the surface's
    normal in the sonar's axes.
    """
    s, g = points.surface[p], poses.ping[p]
    A, R = surfaces.axes[s], poses.R_target_from_mbes[g]
    x, y, z = points.place_m[0, p], points.place_m[1, p], points.place_m[2, p]
    range_m = np.sqrt(x * x + y * y + z * z)
    v = -surfaces.distance_m[s] - points.height_m[p]
    for i in range(3):
        seen[NORMAL, i] = A[2, 0] * R[0, i] + A[2, 1] * R[1, i] + A[2, 2] * R[2, i]
        along, arm = 0.0, 0.0
        for j in range(3):
            along += A[i, j] * (R[j, 0] * x + R[j, 1] * y + R[j, 2] * z)
            arm += A[i, j] * poses.lever_arm_m[g, j]
        seen[RAY, i] = along / range_m
        seen[FROM_BODY, i] = along + arm
        v += A[2, i] * poses.position_m[g, i]
    return float(v + seen[FROM_BODY, 2])


@compiled()
def _observe(
    p: int, v: float, points: Points, poses: SonarPoses, surfaces: Surfaces, noise: Noise, seen: Array, row: Array
) -> float:  # fmt: skip
    """Write the features of a sounding, their slopes and V less the mean of the noise; return the noise's variance."""
    s, g = points.surface[p], poses.ping[p]
    A, R, ray, normal = surfaces.axes[s], poses.R_target_from_mbes[g], seen[RAY], seen[NORMAL]
    x, y, z = points.place_m[0, p], points.place_m[1, p], points.place_m[2, p]
    range_m, angle = np.sqrt(x * x + y * y + z * z), noise.angle_rad * noise.angle_rad
    up_of_ray, up_of_normal, z_of_point = 0.0, 0.0, poses.position_m[g, 2]
    for i in range(3):
        up_of_ray += A[i, 2] * ray[i]
        up_of_normal += R[2, i] * normal[i]
        z_of_point += A[i, 2] * seen[FROM_BODY, i]
    depth = poses.wet_m[1] - poses.wet_m[0]
    high = (z_of_point - poses.wet_m[0]) / depth
    slant = _bounded(ray[2], FLATTEST, ray[2])
    reached = min(max(range_m - v / slant, range_m / 2), 2 * range_m)
    radius = np.sqrt(y * y + z * z)
    slope = min(radius / max(abs(z), TINY), STEEPEST_BEAM)
    side = (normal[0] * np.copysign(radius, -z) + normal[2] * x * slope) / range_m  # n · a
    variance = (noise.range_m * ray[2]) ** 2 + (reached * side) ** 2 * angle
    fan, c = y / range_m, -z / range_m
    steep = _bounded(c, FLATTEST_FAN, c)
    curved = normal[1] * fan + normal[2] * fan * fan * (1 - fan * fan) / steep**3
    row[MEAN] = reached * angle * (slant * (0.5 + (side / slant) ** 2) - curved / 2) * noise.factor[s]
    row[V] = v - row[MEAN]
    down = _bounded(z, STEEPEST * range_m, -z)
    steering = normal[0] * x + normal[1] * y + normal[2] * (x * x + y * y) / down
    speed = steering + ray[2] * range_m
    gradient = (up_of_normal - 2 * up_of_ray * ray[2]) * range_m**2 / (2 * SPEED_M_S)
    projector = ray[2] / (2 * range_m)
    row[COSINE] = ray[2]
    row[FEATURES + 3], row[FEATURES + 4], row[FEATURES + 5] = speed, gradient, steering
    row[FEATURES + 6], row[FEATURES + 7], row[FEATURES + 8] = projector * x, projector * y, projector * z
    row[FEATURES + 9] = (np.sign(ray[2]) - ray[2]) / AT_45_DEG
    row[FEATURES + 10] = 4 * high * (1 - high)
    row[SLOPES], row[SLOPES + 1] = ray[0] / slant, ray[1] / slant
    row[SLOPES + 3], row[SLOPES + 4] = speed / range_m / slant, 2 * gradient / range_m / slant
    row[SLOPES + 5] = steering / range_m / slant
    row[SLOPES + 10] = 4 * (1 - 2 * high) / depth * up_of_ray / slant
    return float(variance)


@compiled((POINTS, POSES, RECORDS, SURFACES, NOISE, SUMS, SCRATCH))
def sum_soundings(
    points: Points, poses: SonarPoses, records: Records, surfaces: Surfaces, noise: Noise, sums: Sums,
    scratch: GroupScratch,
) -> None:  # fmt: skip
    """Add the soundings to the sums of their slots, and to the statistics of their surfaces."""
    n = len(points.record)
    kept, seen = scratch.kept, scratch.vectors
    first = 0
    while first < n:
        k, end = points.record[first], first
        while end < n and points.record[end] == k:
            end += 1
        for p in range(first, end):
            s, row = points.surface[p], kept[p - first]
            v = _see(p, points, poses, surfaces, seen)
            variance = _observe(p, v, points, poses, surfaces, noise, seen, row)
            row[EDGE] = points.edge[p]
            turn_features(row, seen[FROM_BODY], records, k, surfaces.axes[s], s)
            row[COMMON] = common_variance(
                surfaces.axes[s], row[FEATURES], row[FEATURES + 1], points.share[p], noise.white
            )
            weigh(row, variance, s, noise, sums.statistics)
        add_group(first, end, points, scratch, sums)
        first = end
    mirror(sums)
