"""The angles that belong to a lever arm that stays as it is known.

In the adjustment the lever arm is estimated, with what is known of it beforehand, so that the tests of other errors
allow for its own. But passes over a bottom see it so badly that its value is of no use: it stays as it is known, and
angles are wanted that fit the soundings with it. With N x + b = 0 at the adjusted values, f all other estimated
parameters, h the lever arm and the fixed ones, S = -N_ff⁻¹ N_fh (:mod:`pipeline.maths.adjustment.solution`), taking the
arm back by x_h changes them by S x_h; the arm's covariance is then that of a consider parameter.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.maths.adjustment.solution import solve
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.mount import Mounted

Array = NDArray[np.float64]
ANGLES, ARM = np.arange(3), np.arange(3, N_MOUNT)


@dataclass(frozen=True)
class HeldArm:
    """The mount with the arm as known; its total covariance (6, 6), and that of the noise alone, rad and m."""

    mount: Mounted
    covariance: Array
    noise: Array


def with_arm_held(
    adjusted: MountAdjustment, problem: CalibrationProblem, lever_arm_m: Array, known: Array
) -> HeldArm:
    """Return the mount with a lever arm (3,) that is known with a covariance (3, 3), m²."""
    state, equations = adjusted.state, adjusted.equations
    others = np.setdiff1d(adjusted.solution.estimated, ARM)
    solution = solve(equations.normal, equations.right, others.tolist(), adjusted.last.prior.normal)
    back = np.zeros(len(solution.fixed))
    back[np.searchsorted(solution.fixed, ARM)] = lever_arm_m - state.lever_arm_m
    turn = solution.step[ANGLES] + solution.sensitivity_of(ANGLES) @ back
    consider = replace(problem.consider, blocks=[*problem.consider.blocks, (ARM, known)])
    return HeldArm(
        mount=Mounted(exp_so3(turn) @ state.R_body_from_sensor, lever_arm_m),
        covariance=solution.total_covariance(consider, np.arange(N_MOUNT)),
        noise=solution.noise_covariance(np.arange(N_MOUNT)),
    )
