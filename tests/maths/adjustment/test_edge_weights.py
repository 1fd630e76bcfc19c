"""Points near edges, which have less weight but no more noise: variance factors, and the sigma of what they give."""

import numpy as np
import pytest

from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, interval_sums
from pipeline.maths.adjustment.weighting import edge_shares, rescaled, scatter

Array = np.ndarray
EACH = 12  # points of an interval


def sums_of(v: Array, e: Array, sigma: Array, surface: Array, alpha: Array) -> IntervalSums:
    """Sums of intervals of EACH points on a line, by weights e / σ²."""
    n = len(v)
    q = np.vstack([np.ones(n), alpha, 2.0 * alpha])
    record = np.arange(n) // EACH
    return interval_sums(LinearisedPoints(record, surface, np.zeros(n), q, e / sigma**2, v, e))


@pytest.mark.parametrize("lowest", [0.0, 0.5, 1.0])
def test_weights_near_edges_do_not_change_the_variance_factor(lowest: float) -> None:
    """Whatever the weights of an interval's points are, wherever they lie in it."""
    rng = np.random.default_rng(3)
    intervals, factor = 3000, 2.25
    n = intervals * EACH
    alpha = np.tile(np.linspace(-1.0, 1.0, EACH), intervals)
    e = lowest + (1 - lowest) * np.tile(rng.permutation(np.linspace(0.05, 1.0, EACH)), intervals)
    sigma = rng.uniform(0.5, 2.0, n)
    shifts = np.repeat(rng.normal(size=intervals), EACH)
    v = shifts + np.sqrt(factor) * sigma * rng.normal(size=n)
    sums = sums_of(v, e, sigma, np.zeros(n, dtype=int), alpha)
    everything, shares = np.ones(len(sums), dtype=bool), edge_shares(sums, 1)
    assert shares == pytest.approx(np.sum(e**2) / np.sum(e))
    plain, divided = scatter(sums, everything, 1.0), scatter(rescaled(sums, shares), everything, 1.0, shares)
    assert divided.factor == pytest.approx(plain.factor)
    assert plain.factor == pytest.approx(factor, rel=0.03)


def test_where_the_ends_of_intervals_weigh_least_the_factor_is_a_little_too_large() -> None:
    """As on a face from one edge to the other: 5 % at most, on the safe side."""
    rng, intervals = np.random.default_rng(4), 4000
    n, alpha = intervals * EACH, np.tile(np.linspace(-1.0, 1.0, EACH), intervals)
    e = np.minimum(1.0, (1.05 - np.abs(alpha)) / 0.5)
    sums = sums_of(rng.normal(size=n), e, np.ones(n), np.zeros(n, dtype=int), alpha)
    assert 1.0 < scatter(sums, np.ones(len(sums), dtype=bool), 1.0).factor < 1.05


def test_the_information_of_divided_weights_is_the_inverse_of_the_variance() -> None:
    """The mean of all points over 4000 draws. By weights e / σ² alone its variance seems half as large again."""
    rng = np.random.default_rng(5)
    n, draws = 20 * EACH, 4000
    e, sigma = rng.uniform(size=n), rng.uniform(0.5, 0.9, n)
    alpha, surface = np.zeros(n), np.zeros(n, dtype=int)
    means, information = [], 0.0
    for _ in range(draws):
        sums = sums_of(sigma * rng.normal(size=n), e, sigma, surface, alpha)
        sums = rescaled(sums, edge_shares(sums, 1))
        information = float(sums.normal[:, 0, 0].sum())
        means.append(sums.right[:, 0].sum() / information)
    assert np.var(means) * information == pytest.approx(1.0, abs=4 * np.sqrt(2 / draws))
    assert information == pytest.approx(np.sum(e / sigma**2) * e.sum() / np.sum(e**2))


def test_each_surface_has_a_share_of_its_own_and_one_without_points_the_whole() -> None:
    e = np.repeat([0.5, 1.0], EACH)
    sums = sums_of(np.zeros(2 * EACH), e, np.ones(2 * EACH), np.repeat([0, 2], EACH), np.arange(2.0 * EACH))
    assert edge_shares(sums, 3).tolist() == [0.5, 1.0, 1.0]
