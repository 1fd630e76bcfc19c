"""What the passes contradict of session.yaml: a sound speed, a latency, ranges that are wrong beyond their sigmas."""

from collections.abc import Sequence

import numpy as np

from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.adjustment.parameter_tests import prior_parameter_tests, single_parameter_tests
from pipeline.maths.adjustment.parameters import MBES_PARAMETERS, State
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.report.cause_words import words_of

ERRORS = frozenset(MBES_PARAMETERS[N_MOUNT:])  # of the sonar and of the water


def contradictions(
    problem: CalibrationProblem, adjusted: MountAdjustment, known: State, level: float
) -> Sequence[str]:
    """Return in words the parameters whose values the soundings contradict, the one that explains most first.

    The tests are those of a calibration (:mod:`pipeline.report.suspected_causes`), with one limit for all.

    Parameters
    ----------
    problem, adjusted
        The patch test, and its solution.
    known
        The state with all that is known beforehand.
    level
        Chance that one of the tests exceeds the limit if nothing is wrong.
    """
    equations, solution, names = adjusted.equations, adjusted.solution, known.names
    deviation = adjusted.state.deviation_from(known) + solution.step
    tests = single_parameter_tests(equations.normal, equations.right, solution, problem.consider)
    tests += prior_parameter_tests(solution, deviation, problem.consider, problem.prior.known_parameters)
    of_sonar = [test for test in tests if names[test.parameter] in ERRORS and np.isfinite(test.value)]
    limit = joint_limit(len(of_sonar), level)
    found = sorted(
        (test for test in of_sonar if abs(test.value) > limit * test.expected), key=lambda test: -test.strength
    )
    return [
        words_of({"unknown": names[test.parameter], "value": test.value, "sigma": test.sigma}) for test in found
    ]
