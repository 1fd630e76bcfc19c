"""The mount from pairs, against a forward model by scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.entry_check.mount_fit import FREE_ALL, fit_mount, freed
from tests.support.entered import ANGLES, BEAMS, LEVER, Boat, rotation

WRONG = [
    (rotation(ANGLES), LEVER),
    (rotation({"roll": 48.8, "pitch": 1.2, "yaw": 2.0}), np.array([-0.3, 0.2, 2.01])),
    (rotation({"roll": 80.0, "pitch": -70.0, "yaw": 163.0}), np.array([3.0, -4.0, 5.0])),
]


def turn_deg(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(Rotation.from_matrix(one.T @ other).magnitude()))


@pytest.mark.parametrize(("R", "lever"), WRONG)
def test_any_mount_is_found(R: np.ndarray, lever: np.ndarray) -> None:
    boat = Boat()
    fitted = fit_mount(boat.soundings, boat.placed(R, lever))
    assert turn_deg(fitted.R_body_from_mbes, R) < 1e-5
    assert fitted.lever_arm_m == pytest.approx(lever, abs=1e-6)


def test_errors_are_as_the_covariance_says_and_outliers_do_not_count() -> None:
    boat, R = Boat(), rotation(ANGLES)
    normalised = []
    for seed in range(12):
        random = np.random.default_rng(seed)
        points = boat.placed(R, LEVER) + random.normal(0, 0.005, (len(boat.x_mbes), 3))
        points[random.random(len(points)) < 0.05] += 1.0
        fitted = fit_mount(boat.soundings, points)
        error = Rotation.from_matrix(R @ fitted.R_body_from_mbes.T).as_rotvec()
        sigma = np.sqrt(np.diag(fitted.covariance)[:6])
        normalised.append(np.r_[error, LEVER - fitted.lever_arm_m] / sigma)
    rms = np.sqrt(np.mean(np.square(normalised)))
    assert 0.6 < rms < 1.7


def test_two_courses_tell_a_shift_from_the_lever_arm_and_one_course_leaves_it_uncertain() -> None:
    R, shift = rotation(ANGLES), np.array([0.5, -0.3, 0.0])
    free = freed("shift_x", "shift_y")
    sigma = {}
    for headings in ((0.0, 180.0), (0.0,)):
        boat = Boat(headings)
        noise = np.random.default_rng(2).normal(0, 0.002, (len(boat.x_mbes), 3))
        fitted = fit_mount(boat.soundings, boat.placed(R, LEVER) + shift + noise, free)
        sigma[len(headings)] = np.sqrt(fitted.covariance[3, 3])
        if len(headings) == 2:
            assert fitted.shift_m == pytest.approx(shift, abs=0.002)
            assert fitted.lever_arm_m == pytest.approx(LEVER, abs=0.002)
    assert sigma[1] > 5 * sigma[2]


def test_ranges_by_another_sound_speed_are_a_factor() -> None:
    boat, R = Boat(), rotation(ANGLES)
    points = boat.placed(1.002 * R, LEVER)
    fitted = fit_mount(boat.soundings, points, FREE_ALL)
    assert fitted.range_factor == pytest.approx(1.002, abs=1e-6)
    assert fitted.predicted(boat.soundings) == pytest.approx(points, abs=1e-6)


@pytest.mark.parametrize("pings", [1, 3])
def test_sigmas_of_a_few_pings_are_honest(pings: int) -> None:
    """Within one second there is no second group to compare with: the noise of the soundings alone tells."""
    boat, R = Boat(), rotation(ANGLES)
    rows = np.arange(pings * BEAMS)
    normalised = []
    for seed in range(12):
        noise = np.random.default_rng(seed).normal(0, 0.003, (len(rows), 3))
        fitted = fit_mount(boat.soundings.rows(rows), boat.placed(R, LEVER)[rows] + noise)
        error = Rotation.from_matrix(R @ fitted.R_body_from_mbes.T).as_rotvec()
        normalised.append(np.r_[error, LEVER - fitted.lever_arm_m] / np.sqrt(np.diag(fitted.covariance)[:6]))
    assert 0.3 < np.sqrt(np.mean(np.square(normalised))) < 1.7


def test_what_no_sounding_tells_has_no_small_sigma() -> None:
    """A shift of all heights and z are one thing if the boat neither rolls nor pitches."""
    boat = Boat(rolling=0.0)
    noise = np.random.default_rng(1).normal(0, 3e-4, (len(boat.x_mbes), 3))
    fitted = fit_mount(boat.soundings, boat.placed(rotation(ANGLES), LEVER) + noise, freed("shift_z"))
    assert np.sqrt(fitted.covariance[5, 5]) > 1.0


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_the_scatter_of_pairs_that_another_mount_explains_is_told(share: float) -> None:
    boat, R = Boat((0.0, 0.0)), rotation(ANGLES)
    points = boat.placed(R, LEVER) + np.random.default_rng(1).normal(0, 3e-4, (len(boat.x_mbes), 3))
    moved = np.arange(len(points)) < share * len(points)
    points[moved] += np.array([0.2, 0.0, 0.0])
    fitted = fit_mount(boat.soundings, points)
    assert fitted.lever_arm_m == pytest.approx(LEVER, abs=0.001)
    assert fitted.left_out_m == pytest.approx(0.2 / 1.538 if share else 0.0, abs=0.01)
