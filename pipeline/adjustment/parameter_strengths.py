"""Tests of parameters and of sets of them; also with the drift as the session says, if that explains more.

An error of the sonar may look like drift from pass to pass. Where the data made the drift larger, the tests allow for
it and lose strength. :mod:`~pipeline.maths.adjustment.drift_likelihood` tells how drift and a parameter compare.

Parameters that may well be wrong all at once are a *set*, and are also tested together: the shifts, the turns, the bows
of all wet faces, and the two errors of the sonar's ranges that are largest where it grazes a face. All of them have
values known beforehand. (Shifts of single faces are no set: they are fixed, and so count as exact. Together they would
explain too much, as each face is off by its a-priori sigma.)
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pipeline.adjustment.face_errors import FinalSolution, final_solution
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.maths.adjustment.interval_sums import Intervals
from pipeline.maths.adjustment.joint_tests import JointTest, joint_test
from pipeline.maths.adjustment.parameter_tests import ParameterTest, prior_parameter_tests, single_parameter_tests
from pipeline.maths.mount_parameters import N_MOUNT

LEAST_DEVIATE = 3.0  # sigmas of noise and of what is known of a parameter: nearer to zero it explains nothing
LEAST_GAIN = LEAST_DEVIATE**2  # a fall of J; below it the drift's figures explain nothing worth comparing
SETS = {  # by name: pattern of its parameters' names
    "wet_shifts": re.compile("wet_.+_shift"),
    "wet_turns": re.compile("wet_.+_turn_[12]"),
    "wet_bows": re.compile("wet_.+_bow"),
    "mbes_detection": re.compile("mbes(_[0-9]+)?_(incidence|level_range)"),
}


@dataclass(frozen=True)
class SetTest:
    """Joint test of a set of parameters: its name, and the names of its parameters."""

    name: str
    parameters: tuple[str, ...]
    test: JointTest


def parameter_tests(problem: CalibrationProblem, final: FinalSolution) -> list[ParameterTest]:
    """Return the test of each parameter that is fixed, or has a value known beforehand."""
    equations, solution, consider = final.equations, final.solution, problem.consider
    fixed = single_parameter_tests(equations.normal, equations.right, solution, consider)
    return fixed + prior_parameter_tests(solution, final.from_known, consider, problem.prior.known_parameters)


def set_tests(final: FinalSolution, tests: Iterable[ParameterTest]) -> list[SetTest]:
    """Return the joint test of each set that has two or more of the parameters that have tests of their own."""
    tested, found = [test.parameter for test in tests if test.sigma > 0], []
    for name, pattern in SETS.items():
        numbers = [k for k in tested if pattern.fullmatch(final.names[k])]
        if len(numbers) > 1:
            equations = final.equations
            test = joint_test(equations.normal, equations.right, final.solution, final.from_known, numbers)
            found.append(SetTest(name, tuple(final.names[k] for k in numbers), test))
    return found


def strengths_by_session(
    problem: CalibrationProblem,
    adjustment: MountAdjustment,
    sums_by_face: Mapping[str, Intervals],
    final: FinalSolution,
) -> dict[str, float]:
    """Return the strengths of parameters and sets with the drift as the session says, if one explains more than drift.

    Otherwise, and where the data did not make the drift larger, there are none: a larger drift takes strength away.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    sums_by_face : mapping of Intervals
        Sums by interval and face at these values, by sensor.
    final : FinalSolution
        The solution with the estimated figures of the drift.
    """
    figures = adjustment.drift_figures
    if figures.gain < LEAST_GAIN:
        return {}
    session = final_solution(problem, adjustment, sums_by_face, replace(problem.prior.noise, white=figures.noise.white))
    found, estimated = (_strengths(problem, of) for of in (session, final))
    largest = max(found.values(), default=0.0)
    exceeds = largest**2 > figures.gain and largest > max(estimated.values(), default=0.0)
    return found if exceeds else {}


def _strengths(problem: CalibrationProblem, final: FinalSolution) -> dict[str, float]:
    """Return the strengths of sets, and of the parameters that are not as they are known to be."""
    tests, sigmas = parameter_tests(problem, final), problem.consider.sigmas
    of_single = {
        final.names[test.parameter]: test.strength
        for test in tests
        if test.parameter >= N_MOUNT
        and abs(test.value) > LEAST_DEVIATE * np.hypot(test.sigma, sigmas[test.parameter])
    }
    return of_single | {one.name: one.test.strength for one in set_tests(final, tests)}
