"""Sums by epoch against the points themselves."""

from typing import Any

import numpy as np
import pytest

from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, interval_sums, merged
from pipeline.maths.adjustment.weighting import rescaled, scatter

FEATURES = 5


def points(seed: int, n: int = 500) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    record, surface = np.sort(rng.integers(1000, 1020, n)), rng.integers(0, 4, n)
    share, weight, v = rng.uniform(size=n), rng.uniform(0.1, 2, n) * rng.integers(0, 2, n), rng.normal(size=n)
    q = np.vstack([np.ones(n), rng.normal(size=(FEATURES - 1, n))])
    return record, share, surface, q, weight, v


def summed(rows: Any, record: Any, share: Any, surface: Any, q: Any, weight: Any, v: Any) -> IntervalSums:
    return sums_of(record[rows], share[rows], surface[rows], q[:, rows], weight[rows], v[rows])


def sums_of(record: Any, share: Any, surface: Any, q: Any, weight: Any, v: Any) -> IntervalSums:
    return interval_sums(LinearisedPoints(record, surface, share, q, weight, v))


def test_sums_are_those_of_the_points() -> None:
    given = points(5)
    record, share, surface, q, weight, v = given
    whole = summed(slice(None), *given)
    for k in range(len(whole)):
        rows = (record == whole.record[k]) & (surface == whole.surface[k])
        w, s, three = weight[rows], share[rows], q[:3, rows]
        np.testing.assert_allclose(whole.normal[k], (q[:, rows] * w) @ q[:, rows].T, atol=1e-12)
        np.testing.assert_allclose(whole.swept[k], (three * w * s) @ q[:, rows].T, atol=1e-12)
        np.testing.assert_allclose(whole.swept_twice[k], (three * w * s**2) @ three.T, atol=1e-12)
        np.testing.assert_allclose(whole.right[k], (q[:, rows] * w) @ v[rows], atol=1e-12)
        np.testing.assert_allclose(whole.right_swept[k], (three * w * s) @ v[rows], atol=1e-12)
        np.testing.assert_allclose(whole.squares[k], w @ v[rows] ** 2)
        np.testing.assert_allclose(whole.share[k], np.average(s, weights=w))
        assert whole.count[k] == np.sum(w > 0)
    found = set(zip(whole.record.tolist(), whole.surface.tolist(), strict=True))
    assert found == {(r, s) for r, s, w in zip(record.tolist(), surface.tolist(), weight, strict=True) if w > 0}


def test_sums_of_batches_are_the_sums() -> None:
    given = points(6)
    whole = summed(slice(None), *given)
    parts = merged(summed(c, *given) for c in (slice(0, 123), slice(123, 124), slice(124, 124), slice(124, None)))
    for name in IntervalSums.__dataclass_fields__:
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-12, atol=1e-13)


def test_sums_moved_are_those_of_moved_observations() -> None:
    record, share, surface, q, weight, v = given = points(7)
    sums = summed(slice(None), *given)
    change = np.random.default_rng(0).normal(size=(len(sums), FEATURES))
    by_epoch = {key: change[k] for k, key in enumerate(zip(sums.record, sums.surface, strict=True))}
    shift = np.array([q[:, k] @ by_epoch.get((record[k], surface[k]), np.zeros(FEATURES)) for k in range(len(v))])
    again = summed(slice(None), record, share, surface, q, weight, v + shift)
    moved = sums.shifted(change)
    for name in IntervalSums.__dataclass_fields__:
        np.testing.assert_allclose(getattr(moved, name), getattr(again, name), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize(("on_a_line", "aside"), [(False, 0.0), (True, 0.0), (True, 2e-4)])
def test_the_scatter_is_the_sensors_noise_alone(on_a_line: bool, aside: float) -> None:
    """Whatever shift and turn each epoch has; points of a ping lie on a line, which takes but two freedoms, also where
    noise itself has moved them a little aside."""
    rng = np.random.default_rng(11)
    epochs, each, factor = 400, 12, 2.25
    record = np.repeat(np.arange(epochs), each)
    n = len(record)
    alpha = rng.normal(size=n)
    beta = 0.5 * alpha + 0.2 * record if on_a_line else rng.normal(size=n)
    q = np.vstack([np.ones(n), alpha, beta])
    sigma = rng.uniform(0.5, 2.0, n)
    turns = rng.normal(size=(epochs, 3))
    noise = np.sqrt(factor) * sigma * rng.normal(size=n)
    v = np.einsum("ni,in->n", turns[record], q) + noise
    q[2] += aside * noise
    sums = sums_of(record, rng.uniform(size=n), np.zeros(n, dtype=int), q, sigma**-2, v)
    found = scatter(sums, np.ones(len(sums), dtype=bool), 1.0)
    assert found.dof == epochs * (each - (2 if on_a_line else 3))
    assert abs(found.factor / factor - 1) < 4 * np.sqrt(2 / found.dof)
    again = scatter(rescaled(sums, np.array([found.factor])), np.ones(len(sums), dtype=bool), 1.0)
    assert again.factor == pytest.approx(1.0)


def test_epochs_of_few_points_tell_no_scatter() -> None:
    q = np.vstack([np.ones(10), np.arange(10.0), np.arange(10.0) ** 2])
    sums = sums_of(np.repeat([3, 4], 5), np.zeros(10), np.zeros(10, dtype=int), q, np.ones(10), np.arange(10.0))
    found = scatter(sums, np.ones(2, dtype=bool), 1.0)
    assert (found.dof, found.factor) == (0.0, 1.0)
