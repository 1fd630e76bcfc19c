"""Pose errors eliminated group by group against one dense least squares with every unknown written out."""

from typing import Any

import numpy as np
import pytest
from pipeline.maths.pose_errors import (
    SIX,
    Blocks,
    PoseNoise,
    blocks_of,
    drift_at,
    eliminate_drift,
    knots_of,
    reduce_white,
)
from scipy.spatial.transform import Rotation

from pipeline.maths.epochs import adjusted, epoch_sums, merged
from pipeline.maths.planes import tangents_of

RATE_HZ = 10.0
COMMON = 5


def groups(rng: np.random.Generator, records: np.ndarray) -> tuple[Any, list[Any], Blocks]:
    """Random groups of observations of weight one, two a record at most, each with a design of its own."""
    record = np.unique(rng.choice(records, 40))
    surface = rng.integers(0, 3, len(record))
    rows, pieces = [], []
    for one, face in zip(record, surface, strict=True):
        q, s, v = np.vstack([np.ones(7), rng.normal(size=(2, 7))]), rng.uniform(0, 1, 7), rng.normal(size=7)
        rows.append((rng.normal(size=(3, COMMON)), rng.normal(size=(3, SIX)), q, s, v))
        pieces.append(epoch_sums(np.full(7, one), s, np.full(7, face), 3, q, np.ones(7), v))
    sums = merged(pieces)
    return record, rows, blocks_of(sums, np.array([row[0] for row in rows]), np.array([row[1] for row in rows]))


@pytest.mark.parametrize("white", [0.0, 0.7])
def test_elimination_is_the_dense_solution(white: float) -> None:
    rng = np.random.default_rng(3)
    seconds = np.r_[np.arange(31), 90 + np.arange(31)] / RATE_HZ
    records = np.r_[np.arange(30), 31 + np.arange(30)]
    record, rows, blocks = groups(rng, records)
    knots = knots_of(np.unique(record), seconds, 1.0, 2.0)
    noise = PoseNoise(white * np.array([1, 1, 1, 0.5, 0.5, 0]), np.array([0.3, 0.3, 0.2, 0.1, 0.1, 0]), 4.0)
    current = rng.normal(size=(len(knots.record), SIX)) * noise.drift

    reduced = reduce_white(blocks, knots, seconds, noise.white)
    found = eliminate_drift(reduced, knots, noise, current)
    step = -np.linalg.solve(found.normal, found.right)

    # dense: x, then every knot, then white noise of every record by interval, in units of their sigmas
    count = len(knots.record)
    interval = knots.interval_of(record)
    whites = {}
    for one, j in zip(record, interval, strict=True):
        for offset in (0, 1):
            whites.setdefault((j, one + offset), len(whites))
    drift0 = COMMON
    white0 = drift0 + SIX * count
    size = white0 + SIX * len(whites)
    design, value = [], []
    for one, j, (C, K, q, s, v) in zip(record, interval, rows, strict=True):
        t = seconds[one] + s.mean() * (seconds[one + 1] - seconds[one])  # the drift of a group is that of its middle
        a = (t - knots.seconds[j]) / (knots.seconds[j + 1] - knots.seconds[j])
        row = np.zeros((len(v), size))
        row[:, :COMMON] = q.T @ C
        for knot, part in ((j, 1 - a), (j + 1, a)):
            row[:, drift0 + SIX * knot : drift0 + SIX * knot + SIX] = q.T @ K * noise.drift * part
        for offset, parts in ((0, 1 - s), (1, s)):
            at = white0 + SIX * whites[(j, one + offset)]
            row[:, at : at + SIX] += parts[:, None] * (q.T @ K) * noise.white
        design.append(row)
        value.append(v)
    z = np.divide(current, noise.drift, out=np.zeros_like(current), where=noise.drift > 0)
    for j in range(count):  # prior of the drift, its values being z
        for k in range(SIX):
            row = np.zeros((1, size))
            if j == 0:
                row[0, drift0 + k], v = 1.0, z[0, k]
            else:
                phi = np.exp(-(knots.seconds[j] - knots.seconds[j - 1]) / noise.time_constant_s)
                row[0, drift0 + SIX * j + k], row[0, drift0 + SIX * (j - 1) + k] = 1.0, -phi
                row, v = row / np.sqrt(1 - phi**2), (z[j, k] - phi * z[j - 1, k]) / np.sqrt(1 - phi**2)
            design.append(row)
            value.append(np.atleast_1d(v))
    design.append(np.eye(size)[white0:])
    value.append(np.zeros(size - white0))
    A, v = np.concatenate(design), np.concatenate(value)
    dense = -np.linalg.lstsq(A, v, rcond=None)[0]
    covariance = np.linalg.inv(A.T @ A)
    np.testing.assert_allclose(step, dense[:COMMON], rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(np.linalg.inv(found.normal), covariance[:COMMON, :COMMON], rtol=1e-8, atol=1e-12)
    knots_dense = dense[drift0:white0].reshape(count, SIX) * noise.drift
    np.testing.assert_allclose(found.knots(step), knots_dense, rtol=1e-8, atol=1e-10)


def test_knots_keep_to_the_passes() -> None:
    seconds = np.r_[np.arange(0, 10, 0.1), np.arange(60, 65.25, 0.1)]
    used = np.r_[np.arange(5, 80), np.arange(100, 140)]
    knots = knots_of(used, seconds, 1.0, 5.0)
    np.testing.assert_array_equal(np.flatnonzero(~knots.inner), [8])
    assert knots.record[0] == 5
    assert knots.record[8] == 80  # the step from record 79 on ends there
    assert knots.record[9] == 100
    assert np.diff(knots.seconds)[knots.inner].max() <= 1.0 + 0.1
    interval = knots.interval_of(used)
    assert knots.inner[interval].all()
    assert (knots.record[interval] <= used).all()
    assert (knots.record[interval + 1] > used).all()
    assert np.allclose(drift_at(knots, np.ones((len(knots.record), SIX)), np.array([0.0, 30.0, 99.0])), 1.0)


def test_sums_of_batches_are_the_sums() -> None:
    rng = np.random.default_rng(5)
    n = 500
    record, surface = np.sort(rng.integers(1000, 1020, n)), rng.integers(0, 4, n)
    share, weight, v = rng.uniform(size=n), rng.uniform(0.1, 2, n) * rng.integers(0, 2, n), rng.normal(size=n)
    q = np.vstack([np.ones(n), rng.normal(size=(2, n))])
    whole = epoch_sums(record, share, surface, 4, q, weight, v)
    cuts = [slice(0, 123), slice(123, 124), slice(124, 124), slice(124, n)]
    parts = merged(epoch_sums(record[c], share[c], surface[c], 4, q[:, c], weight[c], v[c]) for c in cuts)
    for name in ("record", "surface", "normal", "right", "squares", "count", "share"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-12, atol=1e-14)
    k = int(np.flatnonzero((whole.record == 1007) & (whole.surface == 2))[0])
    rows = (record == 1007) & (surface == 2)
    for power in range(3):
        times = weight[rows] * share[rows] ** power
        np.testing.assert_allclose(whole.normal[k, power], (q[:, rows] * times) @ q[:, rows].T)
        if power < 2:
            np.testing.assert_allclose(whole.right[k, power], (q[:, rows] * times) @ v[rows])
    np.testing.assert_allclose(whole.share[k], np.average(share[rows], weights=weight[rows]))


def test_sums_moved_are_those_of_moved_observations() -> None:
    rng = np.random.default_rng(6)
    n = 60
    record, surface, share = np.sort(rng.integers(0, 4, n)), rng.integers(0, 2, n), rng.uniform(size=n)
    weight, v, q = rng.uniform(0.1, 2, n), rng.normal(size=n), np.vstack([np.ones(n), rng.normal(size=(2, n))])
    sums = epoch_sums(record, share, surface, 2, q, weight, v)
    change = rng.normal(size=(len(sums), 3))
    by_group = {key: change[k] for k, key in enumerate(zip(sums.record, sums.surface, strict=True))}
    shift = np.array([q[:, k] @ by_group[record[k], surface[k]] for k in range(n)])
    again = epoch_sums(record, share, surface, 2, q, weight, v + shift)
    np.testing.assert_allclose(sums.moved(change).right, again.right)
    np.testing.assert_allclose(sums.moved(change).squares, again.squares)


def test_at_the_adjusted_point_noise_does_not_turn_the_surface() -> None:
    """Rays from one place onto a slanted wall, noise along the ray: v against the place along the wall has no slope."""
    rng = np.random.default_rng(8)
    n = 400_000
    normal = np.array([-np.sqrt(0.5), -np.sqrt(0.5), 0.0])
    tangent = tangents_of(normal)[0]
    rays = Rotation.from_euler("z", rng.uniform(-0.02, 0.02, (n, 1))).apply(np.array([1.0, 0.2, 0.05]))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    true = rays * (-3.0 / (rays @ normal))[:, None]
    noise = 0.05 * rng.normal(size=n)
    r = true + rays * noise[:, None]
    v = r @ normal + 3.0
    spread = 0.05**2 * rays * (rays @ normal)[:, None]
    slopes = []
    for points in (r, adjusted(r, np.broadcast_to(normal, r.shape), v, spread)):
        alpha = points @ tangent - np.mean(points @ tangent)
        slopes.append(float(alpha @ v / (alpha @ alpha)))
    sigma = 0.05 * abs(normal @ rays[0]) / np.std(true @ tangent) / np.sqrt(n)
    assert abs(slopes[0]) > 20 * sigma  # what a design at the measured points would do
    assert abs(slopes[1]) < 4 * sigma
