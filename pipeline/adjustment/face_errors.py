"""The solution with the shifts of single faces: their errors for the total covariance, and a test of each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.maths.adjustment.eliminate_drift import NormalEquations
from pipeline.maths.adjustment.face_shifts import equations_with_faces
from pipeline.maths.adjustment.interval_sums import Intervals, IntervalSums
from pipeline.maths.adjustment.ping_noise import with_design_effects, with_ping_noise
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.adjustment.solution import Solution, solve

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class FinalSolution:
    """The adjusted values' solution, with the shifts of single faces as fixed parameters after all others.

    names (u,): of all parameters; deviation (u,): their estimates, zero for the fixed ones; from_known (u,): deviations
    from the values known beforehand, where there are such, after the solution's step; equations, solution: of them.
    """

    names: tuple[str, ...]
    deviation: Array
    from_known: Array
    equations: NormalEquations
    solution: Solution


def with_shared_noise(
    problem: CalibrationProblem, adjustment: MountAdjustment, sums_by_face: Mapping[str, Intervals]
) -> dict[str, Intervals]:
    """Return the sums by interval and face with the noise that the soundings of a ping share, and with roughness.

    Parameters: as for :func:`final_solution`.
    """
    sums, of_face = dict(sums_by_face), problem.model.faces.surface
    changes: list[tuple[str, Callable[[IntervalSums], IntervalSums]]] = []
    for head, ping in adjustment.pings.items():
        with_pings = partial(
            with_ping_noise,
            noise=ping,
            surfaces=adjustment.last.linearisation.state.surfaces,
            white=problem.prior.noise.white,
        )
        changes.append((head, with_pings))
    for sensor, rough in adjustment.rough.items():
        changes.append((sensor, partial(with_design_effects, effects=rough.effects)))
    for sensor, change in changes:
        sums[sensor] = sums[sensor].changed(partial(_by_surface, of_face=of_face, change=change))
    return sums


def _by_surface(
    block: IntervalSums, _: Integers, of_face: Integers, change: Callable[[IntervalSums], IntervalSums]
) -> IntervalSums:
    """Return sums by face after a change that needs the numbers of their surfaces."""
    return replace(change(replace(block, surface=of_face[block.surface])), surface=block.surface)


def final_solution(
    problem: CalibrationProblem,
    adjustment: MountAdjustment,
    sums_by_face: Mapping[str, Intervals],
    noise: PoseNoise | None = None,
) -> FinalSolution:
    """Return the solution with the shifts of single faces.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    sums_by_face : mapping of Intervals
        Sums by interval and face at these values, by sensor, from :func:`with_shared_noise`.
    noise : PoseNoise, optional
        The pose errors; by default with the estimated figures of the drift.
    """
    faces, last, noise = problem.model.faces, adjustment.last, noise or adjustment.drift_figures.noise
    linearisation = replace(last.linearisation, sums=sums_by_face)
    equations, prior = equations_with_faces(linearisation, faces, last.drift, noise), last.prior
    count, state, coarse = len(faces.names), adjustment.state, problem.model.coarse
    known = coarse if problem.prior.parameters is None else problem.prior.parameters.known
    of_prior = np.pad(prior.normal, (0, count))
    equations = replace(
        equations, normal=equations.normal + of_prior, right=equations.right + np.pad(prior.right, (0, count))
    )
    solution = solve(equations.normal, equations.right, adjustment.solution.estimated.tolist(), of_prior)
    return FinalSolution(
        names=problem.model.names,
        deviation=np.pad(state.deviation_from(coarse), (0, count)),
        from_known=np.pad(state.deviation_from(known), (0, count)) + solution.step,
        equations=equations,
        solution=solution,
    )
