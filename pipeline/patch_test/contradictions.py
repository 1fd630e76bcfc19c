"""What the soundings contradict of session.yaml: a sound speed, a clock, ranges, a lever arm, beyond their sigmas."""

from collections.abc import Sequence

import numpy as np

from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.adjustment.parameter_tests import prior_parameter_tests, single_parameter_tests
from pipeline.maths.adjustment.parameters import MBES_PARAMETERS, State
from pipeline.maths.mount_parameters import MOUNT_NAMES, N_MOUNT
from pipeline.report.cause_words import size_words, words_of
from pipeline.report.suspected_causes import NEARLY_AS_WELL

ARM = MOUNT_NAMES[3:]
ERRORS = frozenset((*ARM, *MBES_PARAMETERS[N_MOUNT:]))  # of the lever arm, of the sonar and of the water


def contradictions(
    problem: CalibrationProblem, adjusted: MountAdjustment, known: State, level: float
) -> Sequence[str]:
    """Return in words what explains best that the soundings contradict session.yaml, and what does nearly as well.

    The tests are those of a calibration (:mod:`pipeline.report.suspected_causes`), with one limit for all. One error
    often moves the estimates of several parameters; the others explain less, and are left out.

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
    tested = [test for test in tests if names[test.parameter] in ERRORS and np.isfinite(test.value)]
    limit = joint_limit(len(tested), level)
    found = sorted((test for test in tested if abs(test.value) > limit * test.expected), key=lambda one: -one.strength)
    likely = [test for test in found if test.strength >= found[0].strength - NEARLY_AS_WELL]
    return [_words(names[test.parameter], test.value, test.sigma) for test in likely]


def _words(name: str, value: float, sigma: float) -> str:
    if name in ARM:
        return f"mbes.mount: {name[-1]}_m should be {size_words(1e3 * value, 1e3 * sigma, 'mm')} more"
    return words_of({"unknown": name, "value": value, "sigma": sigma})
