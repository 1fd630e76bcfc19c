"""Poses of the body between the INS's records.

The formulas are those of :class:`pipeline.maths.geometry.trajectory.Trajectory` and, for the drift, of
:class:`pipeline.maths.adjustment.pose_errors.DriftEstimate`: position p + δ, attitude Exp(ω) R Exp(s φ).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import CUBE, LINE, MATRIX, NUMBERS, compiled, named

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NS_PER_S = 1e9


class Records(NamedTuple):
    """Records of an INS: times (r,) ns, ascending, positions (r, 3) m, rotations (r, 3, 3), steps φ (r, 3) rad."""

    t_ns: Integers
    position_m: Array
    R_frame_from_body: Array
    step_rad: Array


class Drift(NamedTuple):
    """The drift: values (k, 6), m and rad, at its knots, seconds (k,) after the first record; k = 0: none."""

    seconds: Array
    values: Array


class PoseScratch(NamedTuple):
    """Scratch memory: error (6,), small (3, 3), turned (3, 3)."""

    error: Array
    small: Array
    turned: Array


SCRATCH = named(PoseScratch, LINE, MATRIX, MATRIX)
RECORDS, DRIFT = named(Records, NUMBERS, MATRIX, CUBE, MATRIX), named(Drift, LINE, MATRIX)


@compiled()
def rotation_coefficients(squared_angle: float) -> tuple[float, float]:
    """Return a and b, as :func:`pipeline.maths.geometry.rotations.exp_coefficients`."""
    if squared_angle < 1e-6:
        return (
            1 - squared_angle / 6 + squared_angle * squared_angle / 120,
            0.5 - squared_angle / 24 + squared_angle * squared_angle / 720,
        )
    t = np.sqrt(squared_angle)
    half = np.sin(t / 2) / t
    return np.sin(t) / t, 2 * half * half


@compiled()
def _write_rotation(v0: float, v1: float, v2: float, R: Array) -> None:
    """Write Exp(v) (3, 3), as :func:`pipeline.maths.geometry.rotations.exp_so3`."""
    a, b = rotation_coefficients(v0 * v0 + v1 * v1 + v2 * v2)
    R[0, 0], R[1, 1], R[2, 2] = 1 - b * (v1 * v1 + v2 * v2), 1 - b * (v0 * v0 + v2 * v2), 1 - b * (v0 * v0 + v1 * v1)
    R[0, 1], R[1, 0] = b * v0 * v1 - a * v2, b * v0 * v1 + a * v2
    R[1, 2], R[2, 1] = b * v1 * v2 - a * v0, b * v1 * v2 + a * v0
    R[2, 0], R[0, 2] = b * v2 * v0 - a * v1, b * v2 * v0 + a * v1


@compiled()
def _write_product(A: Array, B: Array, product: Array) -> None:
    """Write A B (3, 3)."""
    for row in range(3):
        for column in range(3):
            product[row, column] = A[row, 0] * B[0, column] + A[row, 1] * B[1, column] + A[row, 2] * B[2, column]


@compiled((NUMBERS, LINE, RECORDS, DRIFT, MATRIX, CUBE, SCRATCH))
def pose_intervals(
    record: Integers, share: Array, records: Records, drift: Drift, position_m: Array, R_frame_from_body: Array,
    scratch: PoseScratch,
) -> None:  # fmt: skip
    """Write the poses of the body at shares of the intervals from record to record, corrected by the drift.

    Parameters
    ----------
    record, share : (g,) arrays
        Record before each instant, and the share of the interval to the next.
    records : Records
        Poses at the records.
    drift : Drift
        The drift; it is linear between the knots, and constant outside.
    position_m, R_frame_from_body : (g, 3) and (g, 3, 3) arrays
        Written.
    """
    knots = len(drift.seconds)
    error, small, turned = scratch
    knot = 0
    for i in range(len(record)):
        k, s = record[i], share[i]
        f, R = records.step_rad[k], R_frame_from_body[i]
        for axis in range(3):
            start = records.position_m[k, axis]
            position_m[i, axis] = start + s * (records.position_m[k + 1, axis] - start)
        _write_rotation(s * f[0], s * f[1], s * f[2], small)
        if not knots:
            _write_product(records.R_frame_from_body[k], small, R)
            continue
        _write_product(records.R_frame_from_body[k], small, turned)
        at = (records.t_ns[k] - records.t_ns[0] + s * (records.t_ns[k + 1] - records.t_ns[k])) / NS_PER_S
        if at < drift.seconds[knot] or at >= drift.seconds[min(knot + 8, knots - 1)]:
            knot = max(int(np.searchsorted(drift.seconds, at, side="right")) - 1, 0)
        while knot + 1 < knots and drift.seconds[knot + 1] <= at:
            knot += 1
        after = 0.0
        if knot + 1 < knots and at > drift.seconds[knot]:
            after = (at - drift.seconds[knot]) / (drift.seconds[knot + 1] - drift.seconds[knot])
        following = min(knot + 1, knots - 1)
        for part in range(6):
            before = drift.values[knot, part]
            error[part] = before + after * (drift.values[following, part] - before)
        for axis in range(3):
            position_m[i, axis] += error[axis]
        _write_rotation(error[3], error[4], error[5], small)
        _write_product(small, turned, R)
