"""A part's solution against the whole: covariance and level by simulation of a plain linear model."""

import numpy as np
import pytest

from pipeline.maths.adjustment.parts import Deviation, deviation
from pipeline.maths.adjustment.solution import ConsiderErrors, solve

UNKNOWNS, FIXED, ROWS, PART = 6, 2, 60, 25
RNG = np.random.default_rng(11)
DESIGN = RNG.normal(size=(ROWS, UNKNOWNS + FIXED))
CONSIDER = ConsiderErrors(np.array([0.0] * UNKNOWNS + [0.3, 0.2]))
MOUNT = np.arange(UNKNOWNS)


def difference(v: np.ndarray, rows: slice = slice(PART)) -> Deviation:
    """For observations v with unit weights; the normal equations are N x + b = 0, with v = A x + noise at x = 0."""
    solutions = [
        solve(A.T @ A, A.T @ w, MOUNT.tolist()) for A, w in ((DESIGN[rows], v[rows]), (DESIGN, v))
    ]
    return deviation(solutions[0], solutions[1], CONSIDER, MOUNT)


def draws(count: int) -> list[Deviation]:
    """Noise, and errors of the fixed parameters."""
    fixed = RNG.normal(size=(count, FIXED)) * CONSIDER.sigmas[UNKNOWNS:]
    return [difference(RNG.normal(size=ROWS) + DESIGN[:, UNKNOWNS:] @ h) for h in fixed]


def test_the_sigmas_and_the_level_are_those_of_the_differences() -> None:
    found = draws(4000)
    ratio = np.std([one.change for one in found], axis=0) / found[0].sigma
    np.testing.assert_allclose(ratio, 1.0, atol=0.05)
    assert {one.dof for one in found} == {UNKNOWNS}
    for limit, chance in ((1.96, 0.05), (2.576, 0.01)):
        beyond = np.mean([one.normalised > limit for one in found])
        assert beyond == pytest.approx(chance, abs=4 * np.sqrt(chance / 4000))


def test_a_change_in_the_part_is_found_with_its_sign() -> None:
    step = np.zeros(ROWS)
    step[:PART] = -DESIGN[:PART, 2] * 0.5  # v falls by A x where the unknown is larger by x
    found = difference(step)
    assert found.change[2] == pytest.approx(0.5 * (1 - share(2)), rel=0.5)
    assert found.change[2] > 0
    assert difference(4 * step).normalised > 4 > difference(0.1 * step).normalised


def share(k: int) -> float:
    """The part's share of the information about unknown k."""
    return float(np.sum(DESIGN[:PART, k] ** 2) / np.sum(DESIGN[:, k] ** 2))


def test_the_whole_as_its_own_part_differs_in_nothing() -> None:
    found = difference(RNG.normal(size=ROWS), slice(ROWS))
    assert found.dof == 0
    assert found.normalised == 0
    np.testing.assert_allclose(found.change, 0.0, atol=1e-12)
