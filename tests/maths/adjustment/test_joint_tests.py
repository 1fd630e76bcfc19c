"""Joint tests of several parameters, against least squares with and without them, and against scipy's chi-squared."""

import numpy as np
import pytest
from scipy import stats

from pipeline.maths.adjustment.joint_tests import joint_test, normal_deviate_of
from pipeline.maths.adjustment.parameter_tests import prior_parameter_tests, single_parameter_tests
from pipeline.maths.adjustment.plane_tests import plane_test
from pipeline.maths.adjustment.solution import ConsiderErrors, Solution, solve

Array = np.ndarray
NUMBER = 8
FREE, KNOWN, FIXED = [0, 1], [2, 3, 4], [5, 6, 7]
NOTHING = ConsiderErrors(np.zeros(NUMBER))


class Case:
    """Observations v = A x + noise of eight parameters; 2 to 4 are known beforehand, the first two of them together."""

    def __init__(self, seed: int, truth: Array | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.design = rng.normal(size=(40, NUMBER))
        self.design[:, 6] = 0.9 * self.design[:, 5] + 0.3 * self.design[:, 6]
        self.design[:, 2] = 0.8 * self.design[:, 0] + 0.5 * self.design[:, 2]
        self.known = np.zeros(NUMBER)
        Q = np.array([[0.25, 0.1, 0.0], [0.1, 0.16, 0.0], [0.0, 0.0, 0.01]])
        self.prior = np.zeros((NUMBER, NUMBER))
        self.prior[np.ix_(KNOWN, KNOWN)] = np.linalg.inv(Q)
        self.known[KNOWN] = np.linalg.cholesky(Q) @ rng.normal(size=3)
        x = np.zeros(NUMBER) if truth is None else truth
        self.v = self.design @ x + rng.normal(size=40)

    def equations(self) -> tuple[Array, Array]:
        """N x + b = 0 at x = 0."""
        return self.design.T @ self.design + self.prior, -self.design.T @ self.v - self.prior @ self.known

    def solution(self) -> tuple[Solution, Array]:
        """The solution, and the deviations from the known values after it."""
        normal, right = self.equations()
        found = solve(normal, right, FREE + KNOWN, self.prior)
        return found, found.step - self.known

    def least_squares(self, freed: list[int]) -> float:
        """The least J by a dense solution with these parameters freed; of a freed value nothing is known beforehand.

        A value that is known together with another keeps the observation of the difference that the other's error does
        not explain: its own error is one more unknown.
        """
        half = np.linalg.cholesky(self.prior[np.ix_(KNOWN, KNOWN)]).T
        rows = np.zeros((3, NUMBER))
        rows[:, KNOWN] = half
        unknown = FREE + KNOWN + [one for one in freed if one in FIXED]
        errors = half[:, [KNOWN.index(one) for one in freed if one in KNOWN]]
        A = np.block(
            [
                [self.design[:, unknown], np.zeros((40, errors.shape[1]))],
                [rows[:, unknown], -errors],
            ]
        )
        y = np.concatenate([self.v, half @ self.known[KNOWN]])
        x = np.linalg.lstsq(A, y, rcond=None)[0]
        return float(np.sum((A @ x - y) ** 2))


@pytest.mark.parametrize("freed", [[5], [2], [4], [5, 6, 7], [2, 3], [2, 3, 4], [3, 6], [2, 4, 5, 7], KNOWN + FIXED])
def test_the_fall_is_that_of_the_least_sum_of_squares(freed: list[int]) -> None:
    case = Case(seed=len(freed), truth=np.array([1.0, -2.0, 0.5, 3.0, -1.0, 0.7, 0.0, -0.4]))
    (normal, right), (solution, deviation) = case.equations(), case.solution()
    found = joint_test(normal, right, solution, deviation, freed)
    assert found.dof == len(freed)
    assert found.fall == pytest.approx(case.least_squares([]) - case.least_squares(freed), rel=1e-9)


def test_the_fall_of_one_parameter_is_the_square_of_its_strength() -> None:
    case = Case(seed=9, truth=np.full(NUMBER, 0.5))
    (normal, right), (solution, deviation) = case.equations(), case.solution()
    tests = single_parameter_tests(normal, right, solution, NOTHING)
    tests += prior_parameter_tests(solution, deviation, NOTHING, np.array(KNOWN))
    assert sorted(one.parameter for one in tests) == KNOWN + FIXED
    for one in tests:
        fall = joint_test(normal, right, solution, deviation, [one.parameter])
        assert (fall.dof, fall.strength) == (1, pytest.approx(one.strength, rel=1e-6))


def test_without_errors_the_fall_is_chi_squared() -> None:
    """Mean and quantiles over 2000 draws of noise and of the known values' errors."""
    falls = []
    for seed in range(2000):
        case = Case(seed)
        falls.append(joint_test(*case.equations(), *case.solution(), [2, 3, 5, 6]).fall)
    assert stats.kstest(falls, stats.chi2(4).cdf).pvalue > 0.001


def test_directions_that_the_points_do_not_determine_do_not_count() -> None:
    """Shifts of three faces of one surface, and the surface's own: one direction is the surface's."""
    rng = np.random.default_rng(4)
    face = rng.integers(0, 3, size=60)
    design = np.column_stack([np.ones(60), *(face == k for k in range(3))]).astype(float)
    v = rng.normal(size=60) + 2.0 * (face == 1)
    normal, right = design.T @ design, -design.T @ v
    solution = solve(normal, right, [0])
    found = joint_test(normal, right, solution, solution.step, [1, 2, 3])
    means = np.array([v[face == k].mean() for k in range(3)])
    assert found.dof == 2
    assert found.fall == pytest.approx(float(np.bincount(face) @ (means - v.mean()) ** 2))


@pytest.mark.parametrize("dof", [1, 2, 3, 8, 25, 60])
@pytest.mark.parametrize("times", [0.5, 1.0, 3.0, 10.0])
def test_the_deviate_is_as_improbable_as_the_fall(dof: int, times: float) -> None:
    found = normal_deviate_of(times * dof, dof)
    assert 2 * stats.norm.sf(found) == pytest.approx(stats.chi2.sf(times * dof, dof), rel=1e-9)


@pytest.mark.parametrize("dof", [1, 2, 3, 24, 25, 90])
def test_the_deviate_goes_on_where_the_probability_cannot_be_computed(dof: int) -> None:
    """Across the limit it grows steadily, nearly as the root of the fall; for one parameter it is the root."""
    falls = np.linspace(1100.0, 2000.0, 200)
    found = np.array([normal_deviate_of(fall, dof) for fall in falls])
    steps = np.diff(found) / np.diff(np.sqrt(falls))
    assert np.all(np.abs(np.diff(steps)) < 1e-3)
    assert np.all((steps > 0.99) & (steps < 1.2))
    if dof == 1:
        np.testing.assert_allclose(found, np.sqrt(falls), rtol=1e-9)


# --- wet faces: the same test, with the errors of the fixed parameters ---
def test_a_plane_test_falls_as_the_joint_test_and_finds_the_error() -> None:
    case = Case(seed=3)
    case.known[[2, 3]] += [40.0, -30.0]  # what is believed of them is far off
    (normal, right), (solution, deviation) = case.equations(), case.solution()
    found = plane_test(solution, deviation, NOTHING, [2, 3])
    assert found.fall == pytest.approx(joint_test(normal, right, solution, deviation, [2, 3]).fall)
    assert found.statistic == pytest.approx(found.fall)
    assert found.dof == 2
    np.testing.assert_allclose(found.error, [-40.0, 30.0], atol=4 * found.sigma.max())
    assert found.sigma.max() < 2.0
    assert found.deviate > 8.0


def test_errors_of_fixed_parameters_are_no_contradiction() -> None:
    """With errors of the fixed parameters, T' is chi-squared; T, which takes them as exact, is far larger."""
    consider, statistics, falls = ConsiderErrors(np.r_[np.zeros(5), 2.0, 2.0, 2.0]), [], []
    for seed in range(400):
        truth = np.zeros(NUMBER)
        truth[FIXED] = 2.0 * np.random.default_rng([seed, 1]).normal(size=3)
        solution, deviation = Case(seed, truth).solution()
        found = plane_test(solution, deviation, consider, KNOWN)
        statistics.append(found.statistic)
        falls.append(found.fall)
    assert found.dof == 3
    assert stats.kstest(statistics, stats.chi2(3).cdf).pvalue > 0.01
    assert np.mean(falls) > 5
