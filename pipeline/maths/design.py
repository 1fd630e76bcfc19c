"""The design of a group of observations: how v = n · (X - c) - shift answers to each unknown, by the features 1, α, β.

See :mod:`pipeline.maths.epochs`: with q = (1, α, β), α = t1 · r, β = t2 · r, every derivative is q · (a column of C or
K), the column the same for the whole group. With the body at p, T = R_target_from_body and the sonar's lever arm l:

    pose error, target frame:  δ: n · δ                        ω: ω · (r × n) = β (t1 · ω) - α (t2 · ω)
    lever arm λ, body axes:    Tᵀ n
    rotation ε, body axes:     n · T(ε × u), u = R x = Tᵀ r - l,  = ε · Tᵀ((r - T l) × n)
                               = -Tᵀ(T l × n) + β Tᵀ t1 - α Tᵀ t2
    turns of the surface:      t_k · (X - c) = t_k · (p - c) + (α or β)
    its shift:                 -1

X - c is not reduced by a horizontal face's height here: the reduction runs along n, and t_k · n = 0.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment import COMMON, State, Surface
from pipeline.maths.epochs import FEATURES
from pipeline.maths.pose_errors import SIX

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def features(surfaces: Sequence[Surface], surface: Integers, r_m: Array) -> Array:
    """q = (1, t1 · r, t2 · r) of vectors r (n, 3) from the body to points on these surfaces; (3, n)."""
    q = np.ones((FEATURES, len(r_m)))
    for number, one in enumerate(surfaces):
        rows = np.flatnonzero(surface == number)
        q[1:, rows] = one.tangents @ r_m[rows].T
    return q


def of_poses(surfaces: Sequence[Surface], surface: Integers) -> Array:
    """K (g, 3, 6): of pose errors (δ, ω)."""
    blocks = np.zeros((len(surfaces), FEATURES, SIX))
    for number, one in enumerate(surfaces):
        first, second = one.tangents
        blocks[number, 0, :3], blocks[number, 1, 3:], blocks[number, 2, 3:] = one.normal, -second, first
    return blocks[surface]


def of_common(state: State, surface: Integers, positions_m: Array, R_target_from_body: Array, mount: bool) -> Array:
    """C (g, 3, u): of the six, if the groups are the sonar's (``mount``), and of the surfaces; their poses (g, ...)."""
    found = np.zeros((len(surface), FEATURES, state.size))
    for number, one in enumerate(state.surfaces):
        rows = np.flatnonzero(surface == number)
        first, second, shift = state.columns(number)
        away = positions_m[rows] - one.centre_m
        found[rows, 0, first], found[rows, 1, first] = away @ one.tangents[0], 1.0
        found[rows, 0, second], found[rows, 2, second] = away @ one.tangents[1], 1.0
        found[rows, 0, shift] = -1.0
        if mount:
            T = R_target_from_body[rows]
            found[rows, 0, :3] = -np.einsum("gij,gi->gj", T, np.cross(T @ state.lever_arm_m, one.normal))
            found[rows, 0, 3:COMMON] = one.normal @ T
            found[rows, 1, :3], found[rows, 2, :3] = -(one.tangents[1] @ T), one.tangents[0] @ T
    return found
