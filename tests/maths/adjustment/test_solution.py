"""Mount parameters that are reported to move together: both sides of the limit, and the effect on a sigma."""

import numpy as np
import pytest

from pipeline.maths.adjustment.parameter_tests import prior_parameter_tests, single_parameter_tests
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
    assert weakest_direction(below) == "no correlation of two reaches 0.87; the least certain are yaw and lever arm y"
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


KNOWN = np.array([0, 1, 3])  # of six parameters; the second is correlated with the others
FIXED = 5


def known_beforehand(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a design (30, 6), which hardly tells 0 and 1 apart, the covariance of the known values, and P (6, 6)."""
    design = rng.normal(size=(30, 6))
    design[:, 1] = 0.95 * design[:, 0] + 0.1 * design[:, 1]
    half = np.array([[0.3, 0.0, 0.0], [0.25, 0.2, 0.0], [-0.1, 0.3, 0.2]])
    prior = np.zeros((6, 6))
    prior[np.ix_(KNOWN, KNOWN)] = np.linalg.inv(half @ half.T)
    return design, half @ half.T, prior


def test_correlated_values_known_beforehand_are_tested_each_by_itself() -> None:
    """Against the scatter over noise, errors of the known values, and one fixed parameter; and one value is wrong."""
    rng = np.random.default_rng(7)
    design, Q, prior = known_beforehand(rng)
    normal, free = design.T @ design + prior, np.delete(np.arange(6), FIXED)
    consider, root = ConsiderErrors(np.r_[np.zeros(5), 0.4]), np.linalg.cholesky(Q)
    values, wrong = [], np.array([0.0, 0.7, 0.0])
    for _ in range(4000):
        v = rng.normal(size=30) + design[:, FIXED] * 0.4 * rng.normal()  # the truth is zero
        known = root @ rng.normal(size=3) + wrong
        right = -design.T @ v - prior[:, KNOWN] @ known
        solution = solve(normal, right, free.tolist(), prior)
        deviation = solution.step.copy()
        deviation[KNOWN] -= known
        tests = prior_parameter_tests(solution, deviation, consider, KNOWN)
        values.append([one.value for one in tests])
    assert [one.parameter for one in tests] == KNOWN.tolist()
    np.testing.assert_allclose(np.std(values, axis=0), [one.expected for one in tests], rtol=0.04)
    assert np.mean(values, axis=0)[1] == pytest.approx(-0.7, abs=4 * tests[1].expected / np.sqrt(4000))
    own = 1 / np.diag(np.linalg.inv(Q))  # of a value if the others hold
    without_fixed = prior_parameter_tests(solution, deviation, ConsiderErrors(np.zeros(6)), KNOWN)
    squares = [one.expected**2 - one.sigma**2 for one in without_fixed]
    np.testing.assert_allclose(squares, own, rtol=1e-9)


def test_an_independent_value_is_tested_by_what_the_estimate_would_be_without_it() -> None:
    rng = np.random.default_rng(8)
    design, prior = rng.normal(size=(30, 6)), np.diag([4.0, 0.0, 0.0, 25.0, 0.0, 0.0])
    right, two = rng.normal(size=6), np.array([0, 3])
    whole = solve(design.T @ design + prior, right, range(6), prior)
    tests = prior_parameter_tests(whole, whole.step, ConsiderErrors(np.zeros(6)), two)
    for one in tests:
        others = prior.copy()
        others[one.parameter, one.parameter] = 0.0
        without = solve(design.T @ design + others, right, range(6), others)
        sigma = np.sqrt(without.covariance[one.parameter, one.parameter])
        assert (one.value, one.sigma) == pytest.approx((without.step[one.parameter], sigma))


def test_noise_and_errors_of_known_values_are_parts_of_the_covariance() -> None:
    """The scatter over noise alone, and the squares of the effects of the known values, against their sum."""
    rng = np.random.default_rng(9)
    design, _, prior = known_beforehand(rng)
    normal, everything = design.T @ design + prior, np.arange(6)
    rights = -design.T @ rng.normal(size=(30, 20_000))
    solution = solve(normal, rights[:, 0], everything.tolist(), prior)
    scatter = np.cov(-solution.covariance @ rights)
    noise, effects = solution.noise_covariance(), solution.prior_effects(everything, KNOWN)
    size = np.sqrt(np.outer(np.diag(noise), np.diag(noise)))
    np.testing.assert_allclose(scatter / size, noise / size, atol=0.04)
    np.testing.assert_allclose(noise + effects @ effects.T, solution.covariance, atol=1e-12)
