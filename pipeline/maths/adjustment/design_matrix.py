"""The design of an epoch: how v = n · (X - c) - shift answers to each unknown, by the epoch's features.

See :mod:`pipeline.maths.adjustment.interval_sums`: with q = (1, α, β, …), α = t1 · r, β = t2 · r, every derivative is q
· (a column of C or K), the column the same for the whole epoch. With the body at p, T = R_target_from_body, its
velocity (ṗ, ω) in the target frame and the sensor's lever arm l:

    pose error, target frame:  δ: n · δ                        ω: ω · (r × n) = β (t1 · ω) - α (t2 · ω)
    lever arm λ, body axes:    Tᵀ n
    rotation ε, body axes:     n · T(ε × u), u = R x = Tᵀ r - l,  = ε · Tᵀ((r - T l) × n)
                               = -Tᵀ(T l × n) + β Tᵀ t1 - α Tᵀ t2
    latency τ:                 the pose is taken earlier by τ: as a pose error -τ (ṗ, ω)
    turns of the surface:      t_k · (X - c) = t_k · (p - c) + (α or β)
    its shift:                 -1
    further features:          each is a derivative itself

X - c is not reduced by a horizontal face's height here: the reduction runs along n, and t_k · n = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import MOVING
from pipeline.maths.adjustment.parameters import OF_SURFACE, SIX, State, Surface

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Poses:
    """The body at some moments, target frame: positions (g, 3) m, R_target_from_body (g, 3, 3), rates (g, 6) m/s and
    rad/s."""

    positions_m: Array
    R_target_from_body: Array
    rates: Array


def of_poses(surfaces: Sequence[Surface], surface: Integers) -> Array:
    """K (g, 3, 6): of pose errors (δ, ω), by the first three features."""
    blocks = np.zeros((len(surfaces), MOVING, SIX))
    for number, one in enumerate(surfaces):
        first, second = one.tangents
        blocks[number, 0, :3], blocks[number, 1, 3:], blocks[number, 2, 3:] = one.normal, -second, first
    return blocks[surface]


def of_unknowns(state: State, sensor: str, lever_arm_m: Array, surface: int, poses: Poses, features: int) -> Array:
    """C (g, F, m) of the unknowns :meth:`State.columns` of epochs of one sensor on one surface."""
    one, T = state.surfaces[surface], poses.R_target_from_body
    first, second = one.tangents
    shared, own = slice(0, len(OF_SURFACE)), len(OF_SURFACE)
    latency, further = own + SIX, own + SIX + 1
    columns = state.columns(sensor, surface)
    found = np.zeros((len(T), features, len(columns)))
    away = poses.positions_m - one.centre_m
    found[:, 0, 0], found[:, 1, 0] = away @ first, 1.0
    found[:, 0, 1], found[:, 2, 1] = away @ second, 1.0
    found[:, 0, 2] = -1.0
    found[:, 0, own : own + 3] = -np.einsum("gij,gi->gj", T, np.cross(T @ lever_arm_m, one.normal))
    found[:, 1, own : own + 3], found[:, 2, own : own + 3] = -(second @ T), first @ T
    found[:, 0, own + 3 : own + SIX] = one.normal @ T
    found[:, :MOVING, latency] = -poses.rates @ of_poses([one], np.zeros(1, dtype=np.int64))[0].T
    for extra in range(features - MOVING):
        found[:, MOVING + extra, further + extra] = 1.0
    if sensor == "mbes":
        found[:, :, -len(OF_SURFACE) :] = found[:, :, shared]
    return found
