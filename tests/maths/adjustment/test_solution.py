"""Mount parameters that are reported to move together: both sides of the limit, and the effect on a sigma."""

import numpy as np
import pytest

from pipeline.maths.adjustment.parameter_tests import single_parameter_tests
from pipeline.maths.adjustment.solution import (
    CORRELATION_LIMIT,
    ConsiderErrors,
    correlated_pair,
    solve,
    weakest_direction,
)

YAW, ARM_Y = 2, 4


def covariance_of(rho: float) -> np.ndarray:
    """Covariance of the mount with this correlation of yaw and lever arm y; all others are weaker."""
    correlation = np.eye(6)
    correlation[0, 1] = correlation[1, 0] = 0.3
    correlation[YAW, ARM_Y] = correlation[ARM_Y, YAW] = rho
    sigma = np.array([1e-4, 2e-4, 3e-4, 1e-3, 4e-3, 2e-3])
    return correlation * np.outer(sigma, sigma)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_two_move_together_from_where_it_doubles_their_sigma(sign: float) -> None:
    below, above = covariance_of(sign * (CORRELATION_LIMIT - 0.001)), covariance_of(sign * (CORRELATION_LIMIT + 0.001))
    assert correlated_pair(below) is None
    assert weakest_direction(below) == "no two are strongly correlated; the least certain are yaw and lever arm y"
    found = correlated_pair(above)
    assert found is not None
    assert found[:2] == (YAW, ARM_Y)
    assert found[2] == pytest.approx(sign * (CORRELATION_LIMIT + 0.001))
    assert "yaw and lever arm y move together" in weakest_direction(above)


@pytest.mark.parametrize("rho", [-0.929, 0.99])
def test_what_is_said_of_the_sigma_is_what_fixing_the_other_does(rho: float) -> None:
    """Fixing an unknown takes its row and column out of the normal matrix."""
    covariance = covariance_of(rho)
    normal = np.linalg.inv(covariance)
    left = [k for k in range(6) if k != ARM_Y]
    fixed = np.linalg.inv(normal[np.ix_(left, left)])
    times = np.sqrt(covariance[YAW, YAW] / fixed[left.index(YAW), left.index(YAW)])
    assert f"(correlation {rho:+.3f}): if one were known, the other's sigma would be {times:.1f} times smaller" in (
        weakest_direction(covariance)
    )


def test_those_that_cannot_be_told_apart_at_all_leave_a_number() -> None:
    assert "1000.0 times smaller" in weakest_direction(covariance_of(1.0))


def test_a_tested_value_scatters_by_the_errors_of_all_that_look_alike() -> None:
    """Noise, and errors of three fixed parameters, against the sigmas and the expected standard deviations."""
    rng = np.random.default_rng(4)
    design = rng.normal(size=(40, 5))
    design[:, 4] = 0.8 * design[:, 3] + 0.2 * design[:, 4]  # two of the fixed parameters look alike
    consider = ConsiderErrors(np.array([0.0, 0.0, 0.3, 0.2, 1.0]))
    normal, values, tests = design.T @ design, [], []
    for _ in range(4000):
        v = rng.normal(size=40) - design @ (consider.sigmas * rng.normal(size=5))
        right = design.T @ v
        tests = single_parameter_tests(normal, right, solve(normal, right, [0, 1]), consider)
        values.append([one.value for one in tests])
    assert [one.parameter for one in tests] == [2, 3, 4]
    np.testing.assert_allclose(np.std(values, axis=0), [one.expected for one in tests], rtol=0.04)
    assert tests[1].expected > 3 * np.hypot(tests[1].sigma, 0.2)
