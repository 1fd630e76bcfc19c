"""Parameters that are estimated with a value known beforehand: covariances, effects and tests by simulation."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameter_tests import prior_parameter_tests
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pseudo_observations import ParameterPrior, all_pseudo_observations
from pipeline.maths.adjustment.solution import ConsiderErrors, Solution, solve
from pipeline.maths.geometry.rotations import exp_so3

SIGMAS = np.array([0.0, 0.0, 0.3, 0.05, 0.5])  # of parameters 2 and 3, known beforehand, and of 4, fixed
KNOWN = np.array([2, 3])
DESIGN = np.random.default_rng(8).normal(size=(30, 5))
DESIGN[:, 3] = 0.9 * DESIGN[:, 0] + 0.3 * DESIGN[:, 3]  # looks much like a parameter that is estimated freely


def solution_of(v: np.ndarray, known: Sequence[float] = (0.0, 0.0)) -> Solution:
    """Solution of v = DESIGN x + noise from x = 0, the values of KNOWN being ``known`` within their sigmas."""
    prior = np.zeros((5, 5))
    prior[KNOWN, KNOWN] = SIGMAS[KNOWN] ** -2.0
    right = -DESIGN.T @ v
    right[KNOWN] -= prior[KNOWN, KNOWN] * np.array(known)
    return solve(DESIGN.T @ DESIGN + prior, right, [0, 1, 2, 3], prior)


def draws(number: int, *kinds: str) -> np.ndarray:
    """Estimates (number, 4) less the truth, under errors of these kinds: noise, known, fixed."""
    rng, found = np.random.default_rng(3), []
    for _ in range(number):
        noise, of_known, of_fixed = rng.normal(size=30), rng.normal(size=2) * SIGMAS[KNOWN], rng.normal() * SIGMAS[4]
        v = noise * ("noise" in kinds) + DESIGN[:, 4] * of_fixed * ("fixed" in kinds)
        found.append(solution_of(v, of_known * ("known" in kinds)).step[:4])
    return np.array(found)


def test_the_sigmas_by_noise_and_in_total_are_the_scatter() -> None:
    solution = solution_of(np.zeros(30))
    noise, total = draws(4000, "noise"), draws(4000, "noise", "known", "fixed")
    np.testing.assert_allclose(np.diag(solution.noise_covariance()), noise.var(axis=0), rtol=0.08)
    consider = ConsiderErrors(SIGMAS)
    np.testing.assert_allclose(np.diag(solution.total_covariance(consider)), total.var(axis=0), rtol=0.08)
    correlation = np.corrcoef(total.T)
    covariance = solution.total_covariance(consider)
    expected = covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    np.testing.assert_allclose(correlation, expected, atol=0.04)


def test_an_effect_is_what_one_sigma_of_a_value_does() -> None:
    effects = solution_of(np.zeros(30)).prior_effects(np.array([1, 0]), KNOWN)
    for place, number in enumerate(KNOWN):
        known = np.where(number == KNOWN, SIGMAS[KNOWN], 0.0)
        step = solution_of(np.zeros(30), known).step
        np.testing.assert_allclose(effects[:, place], step[[1, 0]], atol=1e-12)
        assert np.any(effects[:, place])


def test_a_groups_effects_have_its_covariance() -> None:
    """The scatter that errors of the values known beforehand cause in the parameters estimated freely."""
    found = solution_of(np.zeros(30)).group_effects(np.array([0, 1]), KNOWN)
    expected = np.cov(draws(6000, "known")[:, :2].T)
    np.testing.assert_allclose(found @ found.T, expected, rtol=0.08, atol=1e-5)


def test_a_value_without_its_prior_scatters_as_expected() -> None:
    """The estimate is that of the points alone, and its expected sigma that under all a-priori errors."""
    rng, values, consider = np.random.default_rng(5), [], ConsiderErrors(SIGMAS)
    for _ in range(3000):
        true = rng.normal(size=5) * SIGMAS
        v = rng.normal(size=30) + DESIGN @ true
        solution = solution_of(v)
        tests = prior_parameter_tests(solution, solution.step, consider, KNOWN)
        values.append([one.value for one in tests])
    assert [one.parameter for one in tests] == KNOWN.tolist()
    np.testing.assert_allclose(np.std(values, axis=0), [one.expected for one in tests], rtol=0.05)
    # against an estimate of that parameter without its prior
    for one in tests:
        other = KNOWN[one.parameter != KNOWN]
        prior = np.zeros((5, 5))
        prior[other, other] = SIGMAS[other] ** -2.0
        free = solve(DESIGN.T @ DESIGN + prior, -DESIGN.T @ v, [0, 1, 2, 3], prior)
        assert one.value == pytest.approx(free.step[one.parameter])
        assert one.sigma == pytest.approx(np.sqrt(free.covariance[one.parameter, one.parameter]))


def test_where_the_points_tell_nothing_it_is_a_consider_parameter() -> None:
    """Two parameters with the same derivatives: which of them errs does not show."""
    design = np.column_stack([DESIGN[:, :2], DESIGN[:, 0]])
    sigmas, normal = np.array([0.0, 0.0, 0.2]), design.T @ design
    prior = np.diag([0.0, 0.0, 0.2**-2.0])
    estimated = solve(normal + prior, np.zeros(3), [0, 1, 2], prior)
    considered = solve(normal, np.zeros(3), [0, 1])
    nothing = ConsiderErrors(sigmas)
    np.testing.assert_allclose(
        estimated.total_covariance(nothing)[:2, :2], considered.total_covariance(nothing), rtol=1e-9
    )
    np.testing.assert_allclose(estimated.noise_covariance()[:2, :2], considered.covariance, rtol=1e-9)
    assert not prior_parameter_tests(estimated, np.zeros(3), nothing, np.array([2]))


def test_values_known_beforehand_count_from_where_they_are_known() -> None:
    """A mount with a full covariance, and an additional parameter: squares, and their derivatives by differences."""
    surfaces = [ObservedSurface.at("P1", np.array([-1.0, 0.0, 0.0]), np.zeros(3))]
    known = State.at(Rotation.random(random_state=1).as_matrix(), np.array([0.3, 0.2, -2.0]), surfaces)
    root = np.tril(np.random.default_rng(2).normal(size=(7, 7))) + 3 * np.eye(7)
    covariance = 1e-4 * root @ root.T
    numbers = np.array([*range(6), known.names.index("mbes_incidence")])
    prior = ParameterPrior(numbers, covariance, known)
    step = np.zeros(known.size)
    step[numbers] = 1e-3 * np.arange(1, 8)
    at = known.updated(step)
    error = np.concatenate([np.arange(1, 4) * 1e-3, np.arange(4, 8) * 1e-3])
    np.testing.assert_allclose(at.R_body_from_sensor, exp_so3(error[:3]) @ known.R_body_from_sensor)
    found = all_pseudo_observations([prior, prior], at)
    assert found.squares == pytest.approx(2 * error @ np.linalg.solve(covariance, error))
    assert found.count == 14
    assert prior.pseudo_observations(known).squares == 0
    for number in numbers.tolist():
        unit = np.eye(known.size)[number] * 1e-6
        ends = [prior.pseudo_observations(at.updated(sign * unit)).squares for sign in (1, -1)]
        assert found.right[number] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=2e-3)
    np.testing.assert_allclose(np.linalg.inv(found.normal[np.ix_(numbers, numbers)] / 2), covariance, rtol=1e-9)
