"""Two estimates of one mount: signs, the joint test's false alarms, and what it finds."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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
