"""The laser's points: from their places in the target frame to the sums of intervals, in one pass.

The formulas are those of :func:`pipeline.maths.adjustment.design_matrix.laser_point_design` and of the functional model
(:meth:`pipeline.adjustment.observation_model.ObservationModel.linearise`), which is this loop's oracle in its test.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import AT_45_DEG
from pipeline.maths.kernels.compiled import CUBE, LINE, MATRIX, compiled, named
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

Array = NDArray[np.float64]
F = 5  # features q: 1, α, β, range, incidence
SLOPES = FEATURES + F - 1


class LaserPoses(NamedTuple):
    """range_m (n,) of the points; position_m (r, 2, 3) of the body at each record and the next; lever_arm_m (r, 3)."""

    range_m: Array
    position_m: Array
    lever_arm_m: Array


POSES = named(LaserPoses, LINE, CUBE, MATRIX)


@compiled((POINTS, POSES, RECORDS, SURFACES, NOISE, SUMS, SCRATCH))
def sum_laser_points(
    points: Points, poses: LaserPoses, records: Records, surfaces: Surfaces, noise: Noise, sums: Sums,
    scratch: GroupScratch,
) -> None:  # fmt: skip
    """Add the points to the sums of their slots, and to the statistics of their surfaces.

    Between two records the body moves along one straight step; the lever arm is that of the record before.
    """
    n = len(points.record)
    kept, r, ray = scratch.kept, scratch.vectors[0], scratch.vectors[1]
    first = 0
    while first < n:
        k, end = points.record[first], first
        while end < n and points.record[end] == k:
            end += 1
        for p in range(first, end):
            s, row, share, range_m = points.surface[p], kept[p - first], points.share[p], poses.range_m[p]
            A = surfaces.axes[s]
            v = -surfaces.distance_m[s] - points.height_m[p]
            for i in range(3):
                seen, arm = 0.0, 0.0
                for j in range(3):
                    start, stop = poses.position_m[k, 0, j], poses.position_m[k, 1, j]
                    seen += A[i, j] * (points.place_m[j, p] - (start + share * (stop - start)))
                    arm += A[i, j] * poses.lever_arm_m[k, j]
                r[i] = seen
                ray[i] = (seen - arm) / range_m
                v += A[2, i] * points.place_m[i, p]
            across = (range_m * noise.angle_rad) ** 2
            away = ray[2] * (noise.range_m**2 - across)
            variance = away * ray[2] + across
            turning = across / range_m * (1 - ray[2] * ray[2])
            row[V], row[MEAN], row[EDGE], row[COSINE] = v, 0.0, points.edge[p], ray[2]
            row[FEATURES + 3] = (np.sign(ray[2]) - ray[2]) / AT_45_DEG
            row[SLOPES], row[SLOPES + 1] = away * ray[0] / variance, away * ray[1] / variance
            row[SLOPES + 2], row[SLOPES + 3] = turning / variance, -turning / AT_45_DEG / variance
            turn_features(row, r, records, k, A, s)
            row[COMMON] = common_variance(A, row[FEATURES], row[FEATURES + 1], share, noise.white)
            weigh(row, variance, s, noise, sums.statistics)
        add_group(first, end, points, scratch, sums)
        first = end
    mirror(sums)
