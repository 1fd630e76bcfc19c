"""The tilt of a transmitter that is turned against its receiver, against the meeting of two cones found by search."""

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from pipeline.maths.sonar.crossed_arrays import tilt_in_mbes
from pipeline.maths.sonar.soundings import points_in_mbes


def met(angle: float, tilt: float, axis: np.ndarray) -> np.ndarray:
    """The unit vector on both cones, on the beam's side of the array."""
    start = np.array([np.sin(angle), 0.0, -np.cos(angle)])
    u = fsolve(lambda u: [u[0] - np.sin(angle), u @ axis - np.sin(tilt), u @ u - 1], start, xtol=1e-12)
    assert u[2] * start[2] > 0
    return np.asarray(u)


@pytest.mark.parametrize("turned_deg", [(0, 0, 0), (2, 3, -1), (-35, 4, 2), (40, -8, 178), (0.5, 1, 181)])
def test_rays_lie_on_both_cones(turned_deg: tuple[float, ...]) -> None:
    """Yaw, pitch and roll of the transmitter, also of one the other way round; beams beyond 90 degrees too."""
    roll, pitch, yaw = turned_deg
    axis = Rotation.from_euler("ZXY", [yaw, pitch, roll], degrees=True).as_matrix()[:, 1]
    angles = np.radians([-100.0, -70.0, -30.0, 0.0, 10.0, 45.0, 75.0, 104.0])
    tilts = np.radians([0.1, -3.0, 10.0, 0.0, -0.9, 5.0, 8.0, -0.2])
    found = tilt_in_mbes(angles, tilts, np.tile(axis, (8, 1)))
    points, valid = points_in_mbes(np.full(8, 2 / 1500), angles, found, np.full(8, 1500.0))
    assert valid.all()
    for point, angle, tilt in zip(points, angles, tilts, strict=True):
        assert point == pytest.approx(met(angle, tilt, axis), abs=1e-9)


def test_a_transmitter_along_y_changes_nothing() -> None:
    angles, tilts = np.radians([[-80.0, 0.0, 60.0], [3.0, -40.0, 20.0]])
    assert tilt_in_mbes(angles, tilts, np.tile([0.0, 1.0, 0.0], (3, 1))) == pytest.approx(tilts, abs=1e-15)


def test_cones_that_do_not_meet() -> None:
    """A beam 80 degrees to starboard and a fan 20 degrees forward have no ray in common; nor have they here."""
    assert np.isnan(tilt_in_mbes(np.radians([80.0]), np.radians([20.0]), np.array([[0.0, 0.99, np.sqrt(1 - 0.99**2)]])))
