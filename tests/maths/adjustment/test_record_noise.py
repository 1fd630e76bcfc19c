"""White noise of the records from differences of consecutive intervals, beside a strong drift."""

import numpy as np
import pytest

from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, interval_sums
from pipeline.maths.adjustment.record_noise import record_noise_factor
from pipeline.maths.adjustment.robust_weights import NOT_REDUCED, igg3_weights, robust_effects

EACH = 12
WHITE = np.array([2.0, 1.0, 1.0, 0.0, 0.0, 0.5])
POSES = np.random.default_rng(5).normal(size=(2, 3, 6))


def intervals(
    record: np.ndarray, factor: float, drift: float, bounds: tuple[float, float] = (1e3, 2e3)
) -> IntervalSums:
    """Points of two surfaces, with the noise of the records beside them, a random walk, and noise of their own.

    ``bounds``: of robust weights.
    """
    rng = np.random.default_rng(9)
    last = int(record.max()) + 2
    noise = np.sqrt(factor) * WHITE * rng.normal(size=(last, 6))
    walk = np.cumsum(drift * rng.normal(size=(last, 6)), axis=0)
    pieces = []
    for surface in (0, 1):
        at = np.repeat(record, EACH)
        n = len(at)
        share = (np.tile(np.arange(EACH), len(record)) + rng.uniform(size=n)) / EACH
        q = np.vstack([np.ones(n), np.repeat(rng.normal(size=(2, 1)), n, axis=1)])
        error = (1 - share)[:, None] * (noise + walk)[at] + share[:, None] * (noise + walk)[at + 1]
        v = np.einsum("in,ij,nj->n", q, POSES[surface], error) + 3.0 * rng.normal(size=n)
        pieces.append((at, np.full(n, surface), share, q, v))
    at, surface, share, q, v = (np.concatenate([piece[k] for piece in pieces], axis=-1) for k in range(5))
    order = np.lexsort((surface, at))
    weight = igg3_weights(v[order] / 3.0, *bounds) / 9.0
    points = LinearisedPoints(at[order], surface[order], share[order], q[:, order], weight, v[order])
    return interval_sums(points)


@pytest.mark.parametrize("factor", [0.0, 1.0, 4.0])
@pytest.mark.parametrize("steps", [[1], [2], [1, 3, 1, 9]])
def test_the_noise_is_found_beside_a_drift_of_many_times_its_size(factor: float, steps: list[int]) -> None:
    record = np.cumsum(np.tile(steps, 3000)[:3000])
    sums = intervals(record, factor, drift=0.1)
    found = record_noise_factor(sums, POSES, WHITE, NOT_REDUCED)
    assert abs(found.factor - factor) < 4 * found.sigma + 0.02  # of the walk from one interval to the next
    assert found.sigma < 0.05 + 0.1 * factor


def test_what_robust_weights_take_off_the_means_is_given_back() -> None:
    """Of the means' own noise they take more than of a common error: together a third of the factor, or more."""
    bounds = 1.5, 3.0
    sums = intervals(np.arange(3000), 0.1, drift=0.0, bounds=bounds)
    given = NOT_REDUCED, robust_effects(*bounds)
    whole, reduced = (record_noise_factor(sums, POSES, WHITE, robust) for robust in given)
    assert abs(reduced.factor - 0.1) < 2 * reduced.sigma
    assert whole.factor < 0.1 - 4 * reduced.sigma


def test_without_pairs_or_noise_nothing_is_known() -> None:
    far = np.arange(0, 600, 6)
    for sums, white in ((intervals(far, 1.0, 0.1), WHITE), (intervals(np.arange(100), 1.0, 0.1), 0 * WHITE)):
        found = record_noise_factor(sums, POSES, white, NOT_REDUCED)
        assert (found.factor, found.sigma) == (1.0, np.inf)
