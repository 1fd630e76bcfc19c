"""Noise that the soundings of a ping share: found in simulated pings, and against dense least squares."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from pipeline.maths.adjustment.design_matrix import pose_design
from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, interval_sums
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.ping_noise import (
    DesignEffects,
    PingNoise,
    ping_noise,
    with_design_effects,
    with_ping_noise,
)
from pipeline.maths.adjustment.robust_weights import NOT_REDUCED, igg3_weights, robust_effects
from pipeline.maths.adjustment.weighting import EpochVarianceFactor, scatter

WALL = ObservedSurface.at("P2", np.array([-1.0, 0.0, 0.0]), np.zeros(3))
TOP = ObservedSurface.at("H", np.array([0.0, 0.0, 1.0]), np.zeros(3))
WHITE = np.array([0.002] * 3 + [3.5e-5] * 3)
LASER = EpochVarianceFactor(1.0, 0.03)
SIGMA, BEAMS, PINGS, STEP = 0.008, 40, 600, 5  # m; beams and pings; INS records from ping to ping
ONES = np.ones(2)


def pings(
    seed: int, correlation: float = 0.0, white: float = 1.0, whole: float = 0.0, offset_m: float = 0.0,
    bounds: tuple[float, float] = (1e3, 2e3),
) -> IntervalSums:  # fmt: skip
    """Pings on the wall, each a line of beams: ``white`` times the INS's variance, ``whole`` times it for the ping.

    Beams k apart are correlated by ``correlation`` ** k; in the second half of the pings the wall stands elsewhere.
    ``bounds``: of robust weights.
    """
    rng = np.random.default_rng(seed)
    noise = SIGMA * rng.normal(size=(PINGS, BEAMS))
    for k in range(1, BEAMS):
        noise[:, k] = correlation * noise[:, k - 1] + np.sqrt(1 - correlation**2) * noise[:, k]
    beta = np.linspace(-1.0, 1.0, BEAMS)
    alpha = np.broadcast_to(np.linspace(-2, 2, PINGS)[:, None] + 0.05 * beta, noise.shape)
    share = rng.uniform(size=PINGS)
    errors = WHITE * rng.normal(size=(3, PINGS, 6))
    pose = np.sqrt(white) * ((1 - share)[:, None] * errors[0] + share[:, None] * errors[1])
    pose += np.sqrt(whole * ((1 - share) ** 2 + share**2))[:, None] * errors[2]
    q = np.stack([np.ones_like(alpha), alpha, np.broadcast_to(beta, noise.shape)])
    v = noise + np.einsum("fpb,fj,pj->pb", q, pose_design([WALL], np.zeros(1, dtype=int))[0], pose)
    v[PINGS // 2 :] += offset_m
    points = LinearisedPoints(
        record=np.repeat(STEP * np.arange(PINGS), BEAMS), surface=np.zeros(v.size, dtype=int),
        share=np.repeat(share, BEAMS), features=q.reshape(3, -1), v_m=v.ravel(),
        weight=igg3_weights(v.ravel() / SIGMA, *bounds) / SIGMA**2,
    )  # fmt: skip
    return interval_sums(points)


def test_robust_weights_hide_no_common_noise() -> None:
    """They take a quarter off what a mean shows of it, and more off the mean's own noise. (It is a fifth of σ / √n.)"""
    bounds, white = (1.5, 3.0), 0.5 * WHITE
    sums = [pings(seed, white=0.25, bounds=bounds) for seed in range(20, 24)]
    right, wrong = (
        [ping_noise(one, [WALL, TOP], white, LASER, robust).epoch for one in sums]
        for robust in (robust_effects(*bounds), NOT_REDUCED)
    )
    sigma = np.sqrt(np.mean([one.sigma**2 for one in right]) / len(sums))
    assert abs(np.mean([one.factor for one in right]) - 1) < 2.5 * sigma
    assert np.mean([one.factor for one in wrong]) < 1 - 4 * sigma


def test_independent_beams_stay_as_they_are() -> None:
    for seed in range(4):
        found = ping_noise(pings(seed), [WALL, TOP], WHITE, LASER, NOT_REDUCED)
        np.testing.assert_array_equal([found.effects.of_mean, found.effects.of_slope], 1.0)
        assert found.excess == 0
        assert abs(found.epoch.factor - 1) < 4 * found.epoch.sigma


@pytest.mark.parametrize("correlation", [0.3, 0.6])
def test_correlated_beams_have_the_design_effect_of_their_correlation(correlation: float) -> None:
    lags = np.arange(1, BEAMS)
    of_mean = 1 + 2 * np.sum((1 - lags / BEAMS) * correlation**lags)
    b, k = np.linspace(-1.0, 1.0, BEAMS), np.arange(BEAMS)
    of_slope = b @ correlation ** np.abs(np.subtract.outer(k, k)) @ b / (b @ b)
    found = ping_noise(pings(5, correlation, white=0.0), [WALL, TOP], 0 * WHITE, LASER, NOT_REDUCED)
    assert found.effects.of_mean[0] == pytest.approx(of_mean, rel=0.2)
    assert found.effects.of_slope[0] == pytest.approx(of_slope, rel=0.2)
    beside_white = ping_noise(pings(5, correlation), [WALL, TOP], WHITE, LASER, NOT_REDUCED)  # its means tell less
    assert beside_white.effects.of_slope[0] == pytest.approx(of_slope, rel=0.2)


def test_an_error_of_whole_pings_is_found() -> None:
    found = ping_noise(pings(6, whole=3.0), [WALL, TOP], WHITE, LASER, NOT_REDUCED)
    assert abs(found.excess - 3.0) < 4 * found.epoch.sigma
    np.testing.assert_array_equal(found.effects.of_slope, 1.0)


def test_what_lasts_longer_than_pings_is_no_noise() -> None:
    """A wall 3 cm aside in half of the pings: twenty sigmas of their means."""
    found = ping_noise(pings(7, offset_m=0.03), [WALL, TOP], WHITE, LASER, NOT_REDUCED)
    assert found.excess == 0
    np.testing.assert_array_equal(found.effects.of_mean, 1.0)


def one_interval(seed: int, line: bool = False) -> tuple[dict[str, Any], IntervalSums]:
    rng = np.random.default_rng(seed)
    n = 12
    q = np.vstack([np.ones(n), rng.normal(size=(4, n))])
    if line:
        q[2] = 0.3 + 0.5 * q[1]
    share = np.full(n, 0.3)
    parts = {"q": q, "w": rng.uniform(0.5, 2, n), "v": rng.normal(size=n), "s": share}
    points = LinearisedPoints(np.zeros(n, dtype=int), np.zeros(n, dtype=int), share, q, parts["w"], parts["v"])
    return parts, interval_sums(points)


def same(found: IntervalSums, P: np.ndarray, q: np.ndarray, s: np.ndarray, v: np.ndarray) -> None:
    """The sums with the weight matrix P."""
    swept = (s * q)[:3]
    np.testing.assert_allclose(found.normal[0], q @ P @ q.T, atol=1e-10)
    np.testing.assert_allclose(found.swept[0], swept @ P @ q.T, atol=1e-10)
    np.testing.assert_allclose(found.swept_twice[0], swept @ P @ swept.T, atol=1e-10)
    np.testing.assert_allclose(found.right[0], q @ P @ v, atol=1e-10)
    np.testing.assert_allclose(found.right_swept[0], swept @ P @ v, atol=1e-10)
    np.testing.assert_allclose(found.squares[0], v @ P @ v)


def test_the_pings_error_is_in_the_weights_as_in_dense_least_squares() -> None:
    one, sums = one_interval(1)
    white = np.array([0.7, 0.5, 0.3, 0.2, 0.4, 0.6])
    noise = PingNoise(DesignEffects(ONES, ONES), LASER, 2.5)
    found = with_ping_noise(sums, noise, [WALL, TOP], white)
    K = pose_design([WALL], np.zeros(1, dtype=int))[0]
    c = 0.3**2 + 0.7**2
    common = one["q"][:3].T @ K @ np.diag(2.5 * c * white**2) @ K.T @ one["q"][:3]
    same(found, np.linalg.inv(np.diag(1 / one["w"]) + common), one["q"], one["s"], one["v"])


@pytest.mark.parametrize("line", [False, True], ids=["spread", "on a line"])
def test_design_effects_enlarge_the_variances_of_mean_and_slope_and_nothing_else(line: bool) -> None:
    one, sums = one_interval(2, line)
    found = with_design_effects(sums, DesignEffects(np.array([4.0]), np.array([2.0])))
    W, q = np.diag(one["w"]), one["q"][:3]
    mean = np.outer(one["w"], one["w"]) / one["w"].sum()
    slopes = W @ q.T @ np.linalg.pinv(q @ W @ q.T, rcond=1e-12) @ q @ W - mean
    P = W - mean - slopes + mean / 4 + slopes / 2
    np.testing.assert_allclose(found.normal[0, :3, :3], q @ P @ q.T, atol=1e-10)
    np.testing.assert_allclose(found.right[0, :3], q @ P @ one["v"], atol=1e-10)
    np.testing.assert_allclose(found.right_swept[0], (one["s"] * q) @ P @ one["v"], atol=1e-10)
    np.testing.assert_allclose(found.squares[0], one["v"] @ P @ one["v"])
    everything = np.ones(1, dtype=bool)
    assert scatter(found, everything, 1.0).squares == pytest.approx(scatter(sums, everything, 1.0).squares)
    assert found.share == pytest.approx(sums.share)


def test_no_design_effects_change_nothing() -> None:
    _, sums = one_interval(3)
    found = with_design_effects(sums, DesignEffects(ONES, ONES))
    for field in fields(IntervalSums):
        np.testing.assert_allclose(getattr(found, field.name), getattr(sums, field.name), atol=1e-12)
