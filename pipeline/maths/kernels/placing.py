"""Points from the frame of a sensor or of the body into the frame of the trajectory.

The formulas are those of :class:`pipeline.maths.geometry.trajectory.Trajectory`: x' = p + R Exp(v) (M x + l) with
p = p_k + s (p_{k+1} - p_k) and v = s φ_k. Exp(v) y is evaluated as y + a v × y + b v × (v × y) (Rodrigues), with
a = sin t / t, b = (1 - cos t) / t² and t = |v|, without forming a matrix for each point. Points that follow each other
between the same two records are placed together, so that the processor can work on several at a time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import LINE, MATRIX, NUMBERS, compiled, named
from pipeline.maths.kernels.poses import RECORDS, Records, rotation_coefficients

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SERIES = 0.01  # largest t² for which four terms of the series are exact to 1e-15


class Sensor(NamedTuple):
    """M and l: R_body_from_sensor (3, 3) and lever_arm_m (3,). In the frame of the body: one and zero."""

    R_body_from_sensor: Array
    lever_arm_m: Array


SENSOR = named(Sensor, MATRIX, LINE)


@compiled()
def interval_of(t: int, record_ns: Integers, near: int) -> int:
    """Return the last record before a time, at most the one before the last; ``near``: a guess, at least 0."""
    last = len(record_ns) - 2
    k = near
    if t < record_ns[k] or (k < last and t >= record_ns[min(k + 8, last)]):
        return min(max(int(np.searchsorted(record_ns, t, side="right")) - 1, 0), last)
    while k < last and record_ns[k + 1] <= t:
        k += 1
    return k


@compiled((NUMBERS, MATRIX, RECORDS, SENSOR, MATRIX))
def place_points(t_ns: Integers, points_m: Array, records: Records, sensor: Sensor, placed_m: Array) -> None:
    """Write the points (3, n) in the frame of the trajectory.

    Parameters
    ----------
    t_ns, points_m : (n,) and (3, n) arrays
        Times, in any order, and points in the frame of the sensor.
    records, sensor : Records, Sensor
        Poses of the body, two or more, and the sensor's mount.
    placed_m : (3, n) array
        Written.
    """
    M, lever = sensor.R_body_from_sensor, sensor.lever_arm_m
    first, k = 0, 0
    while first < len(t_ns):
        k = interval_of(t_ns[first], records.t_ns, k)
        start, stop = records.t_ns[k], records.t_ns[k + 1]
        inside = start <= t_ns[first] <= stop
        end = first + 1
        while inside and end < len(t_ns) and start <= t_ns[end] < stop:
            end += 1
        f0, f1, f2 = records.step_rad[k, 0], records.step_rad[k, 1], records.step_rad[k, 2]
        R, p, q = records.R_frame_from_body[k], records.position_m[k], records.position_m[k + 1]
        squared = f0 * f0 + f1 * f1 + f2 * f2
        slow = inside and squared < SERIES
        for i in range(first, end):
            s = (t_ns[i] - start) / (stop - start)
            v0, v1, v2 = s * f0, s * f1, s * f2
            tt = s * s * squared
            if slow:
                a = 1 - tt / 6 * (1 - tt / 20 * (1 - tt / 42 * (1 - tt / 72)))
                b = 0.5 - tt / 24 * (1 - tt / 30 * (1 - tt / 56 * (1 - tt / 90)))
            else:
                a, b = rotation_coefficients(tt)
            x, y, z = points_m[0, i], points_m[1, i], points_m[2, i]
            y0 = M[0, 0] * x + M[0, 1] * y + M[0, 2] * z + lever[0]
            y1 = M[1, 0] * x + M[1, 1] * y + M[1, 2] * z + lever[1]
            y2 = M[2, 0] * x + M[2, 1] * y + M[2, 2] * z + lever[2]
            c0, c1, c2 = v1 * y2 - v2 * y1, v2 * y0 - v0 * y2, v0 * y1 - v1 * y0
            y0 += a * c0 + b * (v1 * c2 - v2 * c1)
            y1 += a * c1 + b * (v2 * c0 - v0 * c2)
            y2 += a * c2 + b * (v0 * c1 - v1 * c0)
            for axis in range(3):
                placed_m[axis, i] = (
                    p[axis] + s * (q[axis] - p[axis]) + R[axis, 0] * y0 + R[axis, 1] * y1 + R[axis, 2] * y2
                )
        first = end
