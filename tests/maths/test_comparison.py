"""Two estimates of one mount: signs, the joint test's false alarms, and what it finds."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import binom

from pipeline.maths.comparison import MountEstimate, compare_estimates

MOUNT = Rotation.from_euler("ZXY", [-2.0, 1.2, -48.8], degrees=True)
LEVER = np.array([0.3, 0.2, -2.0])
STILL = np.zeros(6)


def covariance(rng, scale=1.0):
    """Like a session's: 0.002 to 0.01 degrees, 0.1 to 1 mm, strongly correlated."""
    sizes = np.concatenate([np.radians(rng.uniform(0.002, 0.01, 3)), rng.uniform(1e-4, 1e-3, 3)]) * scale
    mixed = rng.normal(size=(6, 6)) + 2 * np.eye(6)
    full = mixed @ mixed.T
    sigma = np.sqrt(np.diag(full))
    return full / np.outer(sigma, sigma) * np.outer(sizes, sizes)


def drawn(rng, C, moved=STILL):
    """An estimate of the mount, itself moved by ``moved``: R_true = Exp(ε) R_found, as the contract says."""
    error = np.linalg.cholesky(C) @ rng.normal(size=6)
    true = Rotation.from_rotvec(moved[:3]) * MOUNT
    found = Rotation.from_rotvec(error[:3]).inv() * true
    return MountEstimate(found.as_matrix(), LEVER + moved[3:] - error[3:], C)


def test_the_second_minus_the_first():
    C = np.eye(6) * 1e-8
    turned = Rotation.from_rotvec([0.0, 0.0, np.radians(0.1)]) * MOUNT
    shifted = LEVER + np.array([0.0, 0.002, 0.0])
    found = compare_estimates(MountEstimate(MOUNT.as_matrix(), LEVER, C), MountEstimate(turned.as_matrix(), shifted, C))
    np.testing.assert_allclose(found.difference, [0, 0, np.radians(0.1), 0, 0.002, 0], atol=1e-12)
    np.testing.assert_allclose(found.sigma, np.sqrt(2e-8), rtol=2e-3)  # the angles' axes are not quite at right angles
    assert found.significant(0.01) == [2, 4]


@pytest.mark.parametrize("yaw", [0.0, 90.0, 180.0, -135.0])
@pytest.mark.parametrize(("place", "angle"), [(0, "pitch"), (1, "roll"), (2, "yaw")])
def test_what_moved_is_named_as_it_is_set(yaw, place, angle):
    """The setting that was changed is named, with its sign, and no other; also for a head that looks aft or athwart."""
    settings = {"yaw": yaw, "pitch": 5.0, "roll": -20.0}
    moved = settings | {angle: settings[angle] + 0.3}
    one, other = (
        Rotation.from_euler("ZXY", [s["yaw"], s["pitch"], s["roll"]], degrees=True).as_matrix()
        for s in (settings, moved)
    )
    C = np.eye(6) * 1e-8
    found = compare_estimates(MountEstimate(one, LEVER, C), MountEstimate(other, LEVER, C))
    expected = np.zeros(6)
    expected[place] = np.radians(0.3)
    np.testing.assert_allclose(found.difference, expected, atol=1e-12)
    assert found.significant(0.01) == [place]


def test_false_alarms_are_as_many_as_the_level_says():
    rng = np.random.default_rng(20260512)
    alarms = 0
    for _ in range(1000):
        first, second = covariance(rng), covariance(rng, rng.uniform(0.5, 3.0))
        found = compare_estimates(drawn(rng, first), drawn(rng, second))
        alarms += found.probability < 0.01
        assert bool(found.significant(0.01)) == (found.probability < 0.01)
    assert 3 <= alarms <= 20


@pytest.mark.parametrize("seed", range(5))
def test_a_moved_bracket_is_found_and_named(seed):
    rng = np.random.default_rng(seed)
    moved = np.array([0, 0, np.radians(0.05), 0, 0, 0.002])
    found = compare_estimates(drawn(rng, covariance(rng, 0.5)), drawn(rng, covariance(rng, 0.5), moved))
    assert found.probability < 1e-4
    assert {2, 5} <= set(found.significant(0.01))


def test_a_movement_that_only_all_six_show_together_names_the_largest():
    C = np.eye(6) * 1e-8
    moved = MountEstimate(np.eye(3), np.full(3, 2.45 * np.sqrt(2e-8)), C)
    found = compare_estimates(MountEstimate(np.eye(3), np.zeros(3), C), moved)
    assert found.probability < 0.01
    assert len(found.significant(0.01)) == 1


def sensitivity(rng):
    """To errors in rad and m: near one of the same parameter, and some of every other."""
    units = np.concatenate([np.full(3, np.radians(0.005)), np.full(3, 5e-4)])
    return (np.eye(6) + 0.3 * rng.normal(size=(6, 6))) * np.outer(units, 1 / units)


def pair_with_systematic_errors(rng, own_counted=True, common_counted=True):
    """Two estimates whose errors are noise, own errors three times as large, and common ones thirty times as large.

    Of the common ones a fifth does not cancel: the sensitivities of the two sessions differ by as much.
    """
    own_C, common_C, S_common = covariance(rng, 3.0), covariance(rng, 30.0), sensitivity(rng)
    common_error = np.linalg.cholesky(common_C) @ rng.normal(size=6)
    estimates = []
    for _ in range(2):
        C, S_own, S = covariance(rng), sensitivity(rng), S_common * rng.uniform(0.8, 1.2, size=(6, 6))
        own_error, noise = (np.linalg.cholesky(Q) @ rng.normal(size=6) for Q in (own_C, C))
        error = noise + S_own @ own_error + S @ common_error
        found = Rotation.from_rotvec(error[:3]).inv() * MOUNT
        own = S_own @ np.linalg.cholesky(own_C) if own_counted else np.zeros((6, 0))
        common = S @ np.linalg.cholesky(common_C) if common_counted else np.zeros((6, 0))
        estimates.append(MountEstimate(found.as_matrix(), LEVER - error[3:], C, own=own, common=common))
    return estimates


def test_false_alarms_with_own_and_common_errors_are_as_many_as_the_level_says():
    rng = np.random.default_rng(20260513)
    found = [compare_estimates(*pair_with_systematic_errors(rng)) for _ in range(1000)]
    assert binom.ppf(0.001, 1000, 0.01) <= sum(one.probability < 0.01 for one in found) <= binom.ppf(0.999, 1000, 0.01)
    assert np.mean([one.statistic for one in found]) == pytest.approx(6.0, abs=4 * np.sqrt(12 / 1000))


@pytest.mark.parametrize("left_out", ["own_counted", "common_counted"])
def test_without_either_kind_of_error_there_would_be_many_alarms(left_out):
    rng = np.random.default_rng(20260514)
    found = [compare_estimates(*pair_with_systematic_errors(rng, **{left_out: False})) for _ in range(100)]
    assert sum(one.probability < 0.01 for one in found) > 30


def test_a_common_error_cancels_where_both_are_alike_and_doubles_where_they_are_opposite():
    C, effect = np.eye(6) * 1e-8, np.zeros((6, 1))
    effect[4] = 3e-3
    one = MountEstimate(np.eye(3), LEVER, C, common=effect)
    for other, variance in ((effect, 2e-8), (0 * effect, 2e-8 + 9e-6), (-effect, 2e-8 + 36e-6)):
        found = compare_estimates(one, MountEstimate(np.eye(3), LEVER, C, common=other))
        np.testing.assert_allclose(found.sigma[4] ** 2, variance, rtol=1e-12)
        np.testing.assert_allclose(np.delete(found.sigma, 4), np.sqrt(2e-8), rtol=1e-12)


def test_effects_turn_with_a_head_that_looks_athwart():
    """At a yaw of 90° a turn about body x is roll with the other sign: both noise and effects turn so."""
    R = Rotation.from_euler("ZXY", [90, 0, 0], degrees=True).as_matrix()
    effect = np.zeros((6, 1))
    effect[0] = 1e-3
    still = MountEstimate(R, LEVER, np.eye(6) * 1e-12)
    found = compare_estimates(still, MountEstimate(R, LEVER, np.eye(6) * 1e-12, own=effect))
    np.testing.assert_allclose(found.sigma[:3], [0, 1e-3, 0], atol=2e-6)
    np.testing.assert_allclose(np.abs(found.effects[:, 0]), [0, 1e-3, 0, 0, 0, 0], atol=1e-12)


def test_a_movement_beside_a_large_error_that_resembles_it_is_named():
    """Roll is uncertain, but together with z alone; a roll without a z is no such error, and no other movement."""
    C, like_roll = np.eye(6) * 1e-10, np.zeros((6, 1))
    like_roll[[1, 5], 0] = 1e-3
    turned = Rotation.from_euler("ZXY", [0, 0, 3e-4]).as_matrix()
    found = compare_estimates(
        MountEstimate(np.eye(3), np.zeros(3), C, own=like_roll), MountEstimate(turned, np.zeros(3), C, own=like_roll)
    )
    assert found.probability < 1e-6
    assert np.abs(found.z).max() < 1
    assert found.significant(0.01) == [1]
