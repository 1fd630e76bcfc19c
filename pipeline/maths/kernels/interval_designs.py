"""Designs of intervals: the table "An interval" of :mod:`pipeline.maths.adjustment.design_matrix`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import CUBE, FLAG, INTEGER, LINE, MATRIX, compiled, named

Array = NDArray[np.float64]
N_SURFACE, N_MOUNT, N_WET = 3, 6, 4  # parameters: turns and shift; rotation and lever arm; turns, shift and bow
N_MOVED = 3  # features on which a pose error acts: 1, α, β


class Plane(NamedTuple):
    """A surface: normal n (3,), tangents t1, t2 (2, 3), centre c (3,), and the lever arm l (3,) of its observer."""

    normal: Array
    tangents: Array
    centre_m: Array
    lever_arm_m: Array


class Form(NamedTuple):
    """Which columns a design has: number of parameters with a feature of their own, and whether it has the others.

    level_range: that of a level face's range; wet: those of the wet faces, the last ones, of which bow counts.
    """

    further: int
    level_range: bool
    wet: bool
    bow: bool


PLANE = named(Plane, LINE, MATRIX, LINE, LINE)
FORM = named(Form, INTEGER, FLAG, FLAG, FLAG)


@compiled()
def _dot(v: Array, x: float, y: float, z: float) -> float:
    return v[0] * x + v[1] * y + v[2] * z


@compiled((MATRIX, CUBE, MATRIX, PLANE, FORM, CUBE))
def design_intervals(position_m: Array, T: Array, rates: Array, plane: Plane, form: Form, design: Array) -> None:
    """Write the designs of intervals.

    Parameters
    ----------
    position_m, T, rates : (g, 3), (g, 3, 3) and (g, 6) arrays
        The body: positions, rotations into the target frame, velocity and angular velocity there.
    plane, form : Plane, Form
        The surface that is observed, and which columns the design has.
    design : (g, F, m) array
        Written: C; zero before.
    """
    n, first, second = plane.normal, plane.tangents[0], plane.tangents[1]
    latency = N_SURFACE + N_MOUNT
    wet = design.shape[2] - N_WET
    for i in range(len(position_m)):
        C, R = design[i], T[i]
        x, y, z = (
            position_m[i, 0] - plane.centre_m[0],
            position_m[i, 1] - plane.centre_m[1],
            position_m[i, 2] - plane.centre_m[2],
        )
        C[0, 0], C[1, 0] = _dot(first, x, y, z), 1.0
        C[0, 1], C[2, 1] = _dot(second, x, y, z), 1.0
        C[0, 2] = -1.0
        x, y, z = (
            _dot(R[0], plane.lever_arm_m[0], plane.lever_arm_m[1], plane.lever_arm_m[2]),
            _dot(R[1], plane.lever_arm_m[0], plane.lever_arm_m[1], plane.lever_arm_m[2]),
            _dot(R[2], plane.lever_arm_m[0], plane.lever_arm_m[1], plane.lever_arm_m[2]),
        )
        x, y, z = y * n[2] - z * n[1], z * n[0] - x * n[2], x * n[1] - y * n[0]  # T l × n
        for axis in range(3):
            p, q, r = R[0, axis], R[1, axis], R[2, axis]
            C[0, N_SURFACE + axis] = -(p * x + q * y + r * z)
            C[1, N_SURFACE + axis], C[2, N_SURFACE + axis] = -_dot(second, p, q, r), _dot(first, p, q, r)
            C[0, N_SURFACE + 3 + axis] = _dot(n, p, q, r)
        C[0, latency] = -_dot(n, rates[i, 0], rates[i, 1], rates[i, 2])
        C[1, latency] = _dot(second, rates[i, 3], rates[i, 4], rates[i, 5])
        C[2, latency] = -_dot(first, rates[i, 3], rates[i, 4], rates[i, 5])
        for number in range(form.further):
            C[N_MOVED + number, latency + 1 + number] = 1.0
        if form.level_range:
            C[N_MOVED, latency + 1 + form.further] = 1.0
        if form.wet:  # they turn and shift like the surface, and bow
            for row in range(N_MOVED):
                for column in range(N_SURFACE):
                    C[row, wet + column] = C[row, column]
            C[len(C) - 1, wet + N_SURFACE] = -1.0 if form.bow else 0.0
