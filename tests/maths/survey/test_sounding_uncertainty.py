"""What the mount's errors do to soundings, against soundings drawn with mounts that are wrong by such errors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.survey.sounding_uncertainty import ORDERS, sounding_uncertainty, table_of_soundings

DRAWS = 40_000
# In the order of the program's covariances: rotation about body x (pitch), y (roll), z (yaw), lever arm x, y, z.
SIGMA = np.array([4e-4, 9e-4, 2e-4, 0.004, 0.002, 0.006])


def covariance(roll_with_z: float = 0.0) -> np.ndarray:
    correlation = np.eye(6)
    correlation[1, 5] = correlation[5, 1] = roll_with_z
    return correlation * np.outer(SIGMA, SIGMA)


def drawn(matrix: np.ndarray, depth_m: float, angle_deg: float, head_deg: float) -> np.ndarray:
    """Errors (n, 3) of soundings on a level bottom, starboard +, by a head that is rolled in its bracket.

    A model of its own: the mount as it is takes the beam to the bottom; the mount as found, wrong by a whole rotation
    and not by its first order, says where that sounding lies.
    """
    rng = np.random.default_rng(7)
    turn, arm = np.split(rng.multivariate_normal(np.zeros(6), matrix, DRAWS), 2, axis=1)
    true_mount = Rotation.from_euler("y", head_deg, degrees=True)
    lands = np.array([depth_m * np.tan(np.radians(angle_deg)), 0.0, -depth_m])
    beam = true_mount.inv().apply(lands)  # what the head measured
    found = Rotation.from_rotvec(turn).inv() * true_mount
    return (found.apply(beam) - arm) - lands


@pytest.mark.parametrize("roll_with_z", [0.0, 0.8, -0.8])
@pytest.mark.parametrize("head_deg", [-48.8, 0.0, 80.0])
@pytest.mark.parametrize(("depth_m", "angle_deg"), [(5.0, 0.0), (20.0, 45.0), (50.0, 60.0)])
def test_as_many_soundings_are_within_as_it_says(
    depth_m: float, angle_deg: float, head_deg: float, roll_with_z: float
) -> None:
    said = sounding_uncertainty(covariance(roll_with_z), depth_m, angle_deg)
    inside = []
    for side in (1.0, -1.0):
        errors = drawn(covariance(roll_with_z), depth_m, side * angle_deg, head_deg)
        inside.append(np.mean(np.abs(errors[:, 2]) < said.vertical_m))
        round_it = np.mean(np.hypot(errors[:, 0], errors[:, 1]) < said.horizontal_m)
        assert 0.945 < round_it < 0.99  # a circle of the largest sigma holds more than 95 % where the other is small
    assert min(inside) == pytest.approx(0.95, abs=0.005)  # on the worse side
    if roll_with_z and angle_deg:
        assert max(inside) > 0.96  # on the other side the two errors take something from each other


def test_which_error_moves_a_sounding_where() -> None:
    """Roll lifts an outer beam and shifts one straight down across track, pitch shifts it along track, yaw does nothing
    to it and takes an outer one along track; the lever arm moves all of them alike."""

    def by(place: int, angle_deg: float) -> tuple[float, float]:
        only = np.zeros((6, 6))
        only[place, place] = 1e-6
        one = sounding_uncertainty(only, 10.0, angle_deg)
        return one.vertical_m / 1.959964, one.horizontal_m / 2.447747

    pitch, roll, yaw, x, y, z = range(6)
    assert by(roll, 0.0) == pytest.approx((0.0, 0.010), abs=1e-8)
    assert by(roll, 45.0) == pytest.approx((0.010, 0.010), abs=1e-8)
    assert by(pitch, 0.0) == pytest.approx((0.0, 0.010), abs=1e-8)
    assert by(pitch, 45.0) == pytest.approx((0.0, 0.010), abs=1e-8)
    assert by(yaw, 0.0) == pytest.approx((0.0, 0.0), abs=1e-8)
    assert by(yaw, 45.0) == pytest.approx((0.0, 0.010), abs=1e-8)
    assert by(x, 45.0) == by(y, 45.0) == pytest.approx((0.0, 0.001), abs=1e-8)
    assert by(z, 45.0) == pytest.approx((0.001, 0.0), abs=1e-8)


def test_by_depth_then_by_angle() -> None:
    table = table_of_soundings(covariance(), (5.0, 50.0), (0.0, 45.0, 60.0))
    assert [len(row) for row in table] == [3, 3]
    assert table[1][2] == sounding_uncertainty(covariance(), 50.0, 60.0)


def test_orders_of_s44() -> None:
    """TVU = √(a² + (b d)²): √2 a at the depth where b d is a."""
    special, exclusive = ORDERS
    assert special.vertical_m(0.0) == 0.25
    assert exclusive.vertical_m(0.0) == 0.15
    assert exclusive.vertical_m(20.0) == pytest.approx(0.15 * 2**0.5)
    assert special.vertical_m(100 / 3) == pytest.approx(0.25 * 2**0.5)
    assert (special.horizontal_m, exclusive.horizontal_m) == (2.0, 1.0)
