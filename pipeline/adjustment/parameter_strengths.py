"""Single-parameter tests of the final solution; also with the drift as the session says, if that explains more.

An error of the sonar may look like drift from pass to pass. Where the data made the drift larger, the tests allow for
it and lose strength. :mod:`~pipeline.maths.adjustment.drift_likelihood` tells how drift and a parameter compare.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from pipeline.adjustment.face_errors import FinalSolution, final_solution
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.maths.adjustment.interval_sums import IntervalSums
from pipeline.maths.adjustment.parameter_tests import ParameterTest, prior_parameter_tests, single_parameter_tests
from pipeline.maths.mount_parameters import N_MOUNT

LEAST_GAIN = 9.0  # a fall of J, three sigmas squared; below it the drift's figures explain nothing worth comparing


def parameter_tests(problem: CalibrationProblem, final: FinalSolution) -> list[ParameterTest]:
    """Return the test of each parameter that is fixed, or has a value known beforehand."""
    equations, solution, consider = final.equations, final.solution, problem.consider
    fixed = single_parameter_tests(equations.normal, equations.right, solution, consider)
    return fixed + prior_parameter_tests(solution, final.from_known, consider, problem.prior.known_parameters)


def strengths_by_session(
    problem: CalibrationProblem,
    adjustment: MountAdjustment,
    sums_by_face: Mapping[str, IntervalSums],
    final: FinalSolution,
) -> dict[int, float]:
    """Return |value| over sigma of each parameter, with the drift as the session says, if one explains more than drift.

    Otherwise, and where the data did not make the drift larger, there are none: a larger drift takes strength away.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    sums_by_face : mapping of IntervalSums
        Sums by interval and face at these values, by sensor.
    final : FinalSolution
        The solution with the estimated figures of the drift.
    """
    figures = adjustment.drift_figures
    if figures.gain < LEAST_GAIN:
        return {}
    session = final_solution(problem, adjustment, sums_by_face, replace(problem.prior.noise, white=figures.noise.white))
    # the values are not this solution's
    session = replace(session, from_known=session.from_known + session.solution.step)
    found = _strengths(parameter_tests(problem, session))
    largest, estimated = (
        max(of.values(), default=0.0) for of in (found, _strengths(parameter_tests(problem, final)))
    )
    return found if largest**2 > figures.gain and largest > estimated else {}


def _strengths(tests: Sequence[ParameterTest]) -> dict[int, float]:
    return {
        test.parameter: abs(test.value) / test.sigma
        for test in tests
        if test.parameter >= N_MOUNT and test.sigma > 0
    }
