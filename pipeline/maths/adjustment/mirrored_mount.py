"""The mount that sees walls of one direction nearly as the adjusted one does: its fan turned to the other side.

Let h be the horizontal direction of the normals of all walls, e = z × h the direction along them, and ψ the angle,
about the vertical, from e to the axis of the sonar's fan (its y axis; the beams are square to it). A wall at the
distance d shows

    d = r cos ψ cos(elevation) + terms that the roll takes up,

so that a yaw by ψ appears as a scale of the ranges, cos ψ, which is even in ψ: a fan at -ψ sees the same. With walls in
two directions, or with large changes of heading, the yaw follows from other terms, of first order. With walls of one
direction and small changes δ of heading these are a δ, where

    a = lever arm y + r̄ ψ + const.,    r̄ the mean horizontal distance of the soundings,

a single combination of both. So the sum of squares has two minima along a = const., at ±ψ, of which the slow drift and
what is known of the wet walls tell which is lower. From a start beyond ψ = 0 Gauss-Newton steps end in the wrong one.

To the other side: the mount turns by -2 ψ about the vertical, and the lever arm moves so that the mean sounding stays,
l' = l + s̄ - Exp(-2 ψ z) s̄ with s̄ the vector from the sonar to the mean sounding, body axes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import blocks
from pipeline.maths.adjustment.normal_equations import Linearisation
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.geometry.rotations import exp_so3

Array = NDArray[np.float64]
ALIKE = float(np.sin(np.radians(20.0)))  # of the angle between walls: 2 cm of a wet one are 6 cm of lever arm y there


@dataclass(frozen=True)
class _SeenMean:
    """Sums over the soundings by their weights: of these, of ψ, of s (3,), and of the vertical (3,), body axes."""

    weight: float
    angle: float
    arm: Array
    vertical: Array

    def __add__(self, other: "_SeenMean") -> "_SeenMean":
        return _SeenMean(
            self.weight + other.weight, self.angle + other.angle, self.arm + other.arm, self.vertical + other.vertical
        )


def mirrored_mount(linearisation: Linearisation) -> State | None:
    """Return the state with the sonar's fan turned to the other side of the walls' normal.

    None if the sonar sees walls of several directions, or no wall: then there is no other side.
    """
    state, sums = linearisation.state, linearisation.sums["mbes"]
    along = _along_walls([state.surfaces[k] for k in np.unique(sums.surface).tolist()])
    if along is None:
        return None
    nothing = _SeenMean(0.0, 0.0, np.zeros(3), np.zeros(3))
    mean = sum(_seen(linearisation, along), start=nothing)
    vertical = mean.vertical / np.linalg.norm(mean.vertical)
    turn, arm_m = exp_so3(-2 * mean.angle / mean.weight * vertical), mean.arm / mean.weight
    return replace(
        state,
        R_body_from_sensor=turn @ state.R_body_from_sensor,
        lever_arm_m=state.lever_arm_m + arm_m - turn @ arm_m,
    )


def _along_walls(surfaces: list[ObservedSurface]) -> Array | None:
    """Return the horizontal direction (3,) along all surfaces; None if some look elsewhere, or all are level."""
    walls = [surface for surface in surfaces if not surface.level]
    if not walls:
        return None
    steepest = min(walls, key=lambda wall: abs(float(wall.normal[2])))
    along = np.cross([0.0, 0.0, 1.0], steepest.normal)
    along /= np.linalg.norm(along)
    return along if all(abs(float(along @ wall.normal)) < ALIKE for wall in walls) else None


def _seen(linearisation: Linearisation, along: Array) -> Iterator[_SeenMean]:
    """Yield the sums over some intervals at a time. The fan's axis may point either way along the walls."""
    state, body = linearisation.state, linearisation.body
    first, second, normal = (
        np.array([axes[k] for axes in ([*surface.tangents, surface.normal] for surface in state.surfaces)])
        for k in range(3)
    )
    distance_m = np.array([surface.distance_m for surface in state.surfaces])
    for sums in blocks(linearisation.sums["mbes"]):
        poses, on = body.poses(sums.record, sums.share, linearisation.drift), sums.surface
        weight, alpha, beta = sums.normal[:, 0, :3].T  # of the features 1, α, β
        away = weight * (distance_m[on] - np.einsum("gi,gi->g", normal[on], poses.positions_m))
        from_body = alpha[:, None] * first[on] + beta[:, None] * second[on] + away[:, None] * normal[on]
        in_body = np.einsum("gij,gi->gj", poses.R_target_from_body, from_body)
        axis = poses.R_target_from_body @ state.R_body_from_sensor[:, 1]
        ahead, aside = axis @ along, axis @ np.cross([0.0, 0.0, 1.0], along)
        yield _SeenMean(
            weight=float(weight.sum()),
            angle=float(weight @ np.arctan(aside / np.where(ahead == 0, np.finfo(float).tiny, ahead))),
            arm=in_body.sum(axis=0) - weight.sum() * state.lever_arm_m,
            vertical=weight @ poses.R_target_from_body[:, 2, :],
        )
