"""Restricted likelihood of the drift's figures against dense covariance matrices, and figures found again."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pipeline.maths.adjustment.drift_likelihood import DriftPrior, drift_figures, restricted
from pipeline.maths.adjustment.eliminate_drift import NormalEquations, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
from pipeline.maths.adjustment.pose_errors import N_POSE, DriftEstimate, Knots, PoseNoise

STEP_S, WIDTH = 0.5, 1  # of the knots; one parameter: what all components have in common
STATED = PoseNoise(np.zeros(N_POSE), np.array([0.02, 0.02, 0.03, 2e-4, 2e-4, 5e-4]), 200.0)
SIGMA = 0.05 * STATED.drift  # of the observations at each knot
WITHIN = DriftPrior(np.log(2.0), np.log(3.0))


def drift_of(rng: np.random.Generator, noise: PoseNoise, count: int) -> np.ndarray:
    """A Gauss-Markov process, step by step (k, 6)."""
    phi = np.exp(-STEP_S / noise.time_constant_s)
    found = [noise.drift * rng.normal(size=N_POSE)]
    for _ in range(count - 1):
        found.append(phi * found[-1] + np.sqrt(1 - phi**2) * noise.drift * rng.normal(size=N_POSE))
    return np.array(found)


def observed(rng: np.random.Generator, truth: PoseNoise, count: int) -> np.ndarray:
    """Every component at every knot, with noise, and one shift x = 7 (in sigmas of the noise) of all."""
    return drift_of(rng, truth, count) + SIGMA * rng.normal(size=(count, N_POSE)) + 7 * SIGMA


def equations_of(values: np.ndarray, at: float = 0.0) -> Callable[[PoseNoise], NormalEquations]:
    """Normal equations of v = ξ + SIGMA x - values, linearised at a drift of ``at`` sigmas."""
    count = len(values)
    knots = Knots(np.arange(count), STEP_S * np.arange(count), np.ones(count - 1, dtype=bool))
    current = at * np.tile(STATED.drift, (count, 1))
    drift, v = DriftEstimate(knots, current), current - values
    spans, others = np.zeros((count - 1, 2 * N_POSE, WIDTH + 2 * N_POSE + 1)), np.zeros((2, 2))
    for k in range(count):
        span, half = (k, 0) if k < count - 1 else (k - 1, N_POSE)
        rows = np.arange(half, half + N_POSE)
        spans[span, rows, WIDTH + rows] += 1 / SIGMA**2
        spans[span, rows, 0] += 1 / SIGMA
        spans[span, rows, -1] += v[k] / SIGMA**2
        row = np.array([np.ones(N_POSE), v[k] / SIGMA])
        others += row @ row.T
    reduced = ReducedIntervals(spans, others, 0.0)
    return lambda noise: eliminate_drift(reduced, noise, drift)


def dense(values: np.ndarray, noise: PoseNoise) -> float:
    """-2 log L with one covariance matrix of all observations, by components, without the terms that never change."""
    count = len(values)
    t = STEP_S * np.arange(count)
    square = A2 = AV = logs = 0.0
    for k in range(N_POSE):
        V = noise.drift[k] ** 2 * np.exp(-np.abs(np.subtract.outer(t, t)) / noise.time_constant_s)
        V = V + SIGMA[k] ** 2 * np.eye(count)
        a = np.full(count, SIGMA[k])
        square += values[:, k] @ np.linalg.solve(V, values[:, k])
        A2 += a @ np.linalg.solve(V, a)
        AV += a @ np.linalg.solve(V, values[:, k])
        logs += np.linalg.slogdet(V)[1]
    return float(square - AV**2 / A2 + logs + np.log(A2))


@pytest.mark.parametrize("at", [0.0, 0.4])
def test_the_likelihood_is_that_of_the_dense_covariance(at: float) -> None:
    values = observed(np.random.default_rng(1), STATED, 60)
    ours, others = equations_of(values, at), []
    for factors in ((1.0, 1.0, 1.0), (2.0, 0.5, 0.1), (0.1, 3.0, 20.0)):
        noise = STATED.drifting(*factors)
        others.append(restricted(ours(noise)) - dense(values, noise))
    np.testing.assert_allclose(others, others[0], rtol=0, atol=1e-6)  # the same constant


def test_figures_are_found_within_their_sigmas() -> None:
    """A time constant of 10 s where 200 s are stated, and turns of half the size; many sessions, their mean squares."""
    truth = STATED.drifting(1.0, 0.5, 0.05)
    expected, squares = np.log([1.0, 0.5, 0.05]), []
    for seed in range(10):
        found = drift_figures(equations_of(observed(np.random.default_rng(seed), truth, 400)), STATED, WITHIN)
        error = found.log - expected
        squares.append(error @ np.linalg.solve(found.covariance, error))
        assert found.noise.time_constant_s == pytest.approx(200.0 * np.exp(found.log[2]))
        assert found.deviation[2] < -2
    assert 0.4 < np.mean(squares) / 3 < 2.2  # the prior draws a little


def test_figures_that_are_right_stay() -> None:
    found = [
        drift_figures(equations_of(observed(np.random.default_rng(seed), STATED, 400)), STATED, WITHIN)
        for seed in range(8)
    ]
    assert np.abs([one.deviation for one in found]).max() < 2
    rate = [2 * one.log[0] - one.log[2] for one in found]  # 2 σ² / τ is known well where neither is
    assert np.std(rate) < 0.2
    assert all(one.covariance[2, 2] > 0.3**2 for one in found)


def test_only_larger_sigmas_grow_to_the_rate_of_the_drift_and_never_shrink() -> None:
    """Shifts that change within 10 s in place of 200 s have the rate of √20 times the sigma; turns are far smaller."""
    truth, prior = STATED.drifting(1.0, 0.5, 0.05), DriftPrior(np.log(2.0), 0.0, only_larger=True)
    half = replace(truth, drift=truth.drift * [1, 1, 1, 0.1, 0.1, 0.1])
    values = observed(np.random.default_rng(4), half, 400)
    found = drift_figures(equations_of(values), STATED, prior)
    assert found.log[0] == pytest.approx(np.log(np.sqrt(20)), abs=0.2)
    assert (found.log[1], found.log[2], found.deviation[1]) == (0, 0, 0)
    assert drift_figures(equations_of(values), STATED, replace(prior, only_larger=False)).log[1] < -0.3


def test_exact_figures_and_absent_drift_are_not_touched() -> None:
    values = observed(np.random.default_rng(3), STATED.drifting(3.0, 3.0, 0.1), 200)
    exact = drift_figures(equations_of(values), STATED, DriftPrior(0.0, 0.0))
    assert exact.noise == STATED
    assert not exact.log.any()
    only_time = drift_figures(equations_of(values), STATED, DriftPrior(0.0, np.log(3.0)))
    assert only_time.log[:2].tolist() == [0.0, 0.0]
    assert only_time.log[2] < -1
    no_turns = replace(STATED, drift=STATED.drift * [1, 1, 1, 0, 0, 0])
    without = drift_figures(equations_of(values * (no_turns.drift > 0)), no_turns, WITHIN)
    assert without.log[1] == 0.0
    assert without.log[0] != 0.0
    absent = replace(STATED, drift=np.zeros(N_POSE))
    assert drift_figures(equations_of(0 * values), absent, WITHIN).noise == absent


@pytest.mark.parametrize("within", [WITHIN, replace(WITHIN, only_larger=True)])
def test_the_gain_is_the_fall_of_likelihood_and_prior(within: DriftPrior) -> None:
    """By the dense covariance; none where the session's figures are taken as exact."""
    values = observed(np.random.default_rng(8), STATED.drifting(3.0, 2.0, 1.0), 80)
    found = drift_figures(equations_of(values), STATED, within)
    known = np.array([within.sigma, within.sigma, within.time_constant])
    fall = dense(values, STATED) - dense(values, found.noise) - float(np.sum((found.log / known) ** 2))
    assert fall > 20
    assert found.gain == pytest.approx(fall, abs=1e-5)
    assert drift_figures(equations_of(values), STATED, DriftPrior(0.0, 0.0)).gain == 0.0
