"""The feature of a bias that grows with incidence, on both sides of a surface."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.design_matrix import SensorSigmas, laser_point_design

AXES = Rotation.from_euler("ZXY", np.radians([12.0, 40.0, -48.0])).as_matrix()  # t1, t2, n of a surface
LEVER, SIGMAS = np.array([[0.4], [-0.3], [-1.9]]), SensorSigmas(0.02, 0.002)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bias_with_incidence_moves_points_on_both_sides_of_a_surface(side: float) -> None:
    """Bottoms have the normal of the tops: there a longer range makes v larger."""
    rays = np.random.default_rng(2).normal(size=(3, 7))
    rays *= -side * np.sign(AXES[2] @ rays) / np.linalg.norm(rays, axis=0)
    ranges, incidence = np.linspace(4.0, 9.0, 7), np.arccos(np.abs(AXES[2] @ rays))
    bias = 0.01 * (1 / np.cos(incidence) - 1) / (1 / np.cos(np.pi / 4) - 1)
    change = AXES[2] @ (rays * (ranges + bias) - rays * ranges)
    assert (np.sign(change) == -side).all()
    _, _, q, slopes = laser_point_design(AXES @ (rays * ranges + LEVER), AXES @ (LEVER * np.ones(7)), ranges, SIGMAS)
    np.testing.assert_allclose(0.01 * q[4], change, rtol=1e-9)
    np.testing.assert_allclose(slopes[3], -slopes[2] / (np.sqrt(2) - 1), rtol=1e-12)  # as it follows n · d
