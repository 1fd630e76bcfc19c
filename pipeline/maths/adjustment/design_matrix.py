"""The design of an interval: how v = n · (X - c) - shift depends on each parameter, by the interval's features.

See :mod:`pipeline.maths.adjustment.interval_sums`: with q = (1, α, β, …), α = t1 · r, β = t2 · r, every derivative is q
· (a column of C or K), and the column is the same for the whole interval. With the body at p, T = R_target_from_body,
its velocity (ṗ, ω) in the target frame and the sensor's lever arm l:

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

from pipeline.maths.adjustment.interval_sums import N_MOVED
from pipeline.maths.adjustment.parameters import N_SURFACE, ObservedSurface, State
from pipeline.maths.adjustment.pose_errors import N_POSE
from pipeline.maths.mount_parameters import N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class BodyPoses:
    """The body at g instants, target frame.

    positions_m (g, 3); R_target_from_body (g, 3, 3); rates (g, 6): velocity (m/s) and angular velocity (rad/s).
    """

    positions_m: Array
    R_target_from_body: Array
    rates: Array


@dataclass(frozen=True)
class SensorOnSurface:
    """One sensor's observations of one surface.

    lever_arm_m (3,), body axes; surface: its number; features: their number F.
    """

    sensor: str
    lever_arm_m: Array
    surface: int
    features: int


def pose_design(surfaces: Sequence[ObservedSurface], surface: Integers) -> Array:
    """Return the design K (g, 3, 6) of pose errors (δ, ω) by the first three features, for surface numbers (g,)."""
    blocks = np.zeros((len(surfaces), N_MOVED, N_POSE))
    for block, plane in zip(blocks, surfaces, strict=True):
        first, second = plane.tangents
        block[0, :3], block[1, 3:], block[2, 3:] = plane.normal, -second, first
    return blocks[surface]


def parameter_design(state: State, observed: SensorOnSurface, poses: BodyPoses) -> Array:
    """Return the design C (g, F, m) of the parameters :meth:`State.columns`.

    Parameters
    ----------
    state : State
        Current values of all parameters.
    observed : SensorOnSurface
        The sensor and the surface.
    poses : BodyPoses
        The body at each of g intervals.
    """
    plane, T = state.surfaces[observed.surface], poses.R_target_from_body
    first, second = plane.tangents
    columns = state.columns(observed.sensor, observed.surface)
    design = np.zeros((len(T), observed.features, len(columns)))
    from_centre = poses.positions_m - plane.centre_m
    # turns and shift of the surface
    design[:, 0, 0], design[:, 1, 0] = from_centre @ first, 1.0
    design[:, 0, 1], design[:, 2, 1] = from_centre @ second, 1.0
    design[:, 0, 2] = -1.0
    # rotation and lever arm of the mount
    turn, arm = slice(N_SURFACE, N_SURFACE + 3), slice(N_SURFACE + 3, N_SURFACE + N_MOUNT)
    design[:, 0, turn] = -np.einsum("gij,gi->gj", T, np.cross(T @ observed.lever_arm_m, plane.normal))
    design[:, 1, turn], design[:, 2, turn] = -(second @ T), first @ T
    design[:, 0, arm] = plane.normal @ T
    # latency, and what has a feature of its own
    latency = N_SURFACE + N_MOUNT
    design[:, :N_MOVED, latency] = -poses.rates @ pose_design([plane], np.zeros(1, dtype=np.int64))[0].T
    for further in range(observed.features - N_MOVED):
        design[:, N_MOVED + further, latency + 1 + further] = 1.0
    # the wet faces turn and shift like the surface
    if observed.sensor == "mbes":
        design[:, :, -N_SURFACE:] = design[:, :, :N_SURFACE]
    return design
