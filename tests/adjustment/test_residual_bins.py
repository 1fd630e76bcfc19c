"""The bins of residuals: noise must not choose them."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.adjustment.observation_model import Observations
from pipeline.adjustment.residual_statistics import _heights_of_feet, _variables

WALL_M, SLANT = 4.02, np.radians(40.0)  # distance of the surface along the rays, and their incidence


@pytest.mark.parametrize("side", [-1, 1])  # of n · d: a face, or a bottom, whose family's normal is that of the tops
@pytest.mark.parametrize("sensor", ["laser", "mbes"])
def test_a_point_has_the_distance_of_its_surface_not_its_measured_range(sensor: str, side: int) -> None:
    """A range that is 10 cm short puts a point 10 cm · cos 40° before the wall; the wall stays at 4.02 m."""
    n = 101
    noise_m = np.linspace(-0.1, 0.1, n)
    points = {f"{axis}_{sensor}_m": np.zeros(n) for axis in "xyz"} | {f"x_{sensor}_m": WALL_M + noise_m}
    points |= dict.fromkeys(("pass", "face", "t_ns", "ping"), np.zeros(n, dtype=np.int64))
    along, one = side * np.cos(SLANT), np.ones(n)
    features = np.stack([one, 0 * one, 0 * one, along * one])
    zero = np.zeros(n, dtype=np.int64)
    observations = Observations(
        sensor=sensor, points=points, record=zero, share=0 * one, surface=zero, v_m=along * noise_m, mean_m=0 * one,
        sigma_m=one, common_m=0 * one, edge_weight=one, features=features, slopes=features[1:],
    )  # fmt: skip
    np.testing.assert_allclose(dict(_variables(observations, zero))["distance"], WALL_M, atol=1e-12)


@pytest.mark.parametrize("slope_deg", [0.0, 45.0, 90.0])
@pytest.mark.parametrize("calibrated", ["laser", "mbes"])
def test_the_height_of_a_point_is_that_of_its_surface_above_the_water(slope_deg: float, calibrated: str) -> None:
    """Points 7 cm off a level, a sloping and an upright face, 1.5 m below the water."""
    normal = np.array([-np.sin(np.radians(slope_deg)), 0.0, np.cos(np.radians(slope_deg))])
    v_m = np.linspace(-0.07, 0.07, 15)
    at = np.array([0.3, 0.2, -1.1]) + v_m[:, None] * normal
    zero, one = np.zeros(15, dtype=np.int64), np.ones(15)
    observations = Observations(
        sensor="laser", points={f"{axis}_target_m": at[:, k] for k, axis in enumerate("xyz")}, record=zero, share=one,
        surface=zero, v_m=v_m, mean_m=one, sigma_m=one, common_m=one, edge_weight=one, features=one, slopes=one,
    )  # fmt: skip
    model = SimpleNamespace(wet_heights_m=(-4.0, 0.4), points_in_target=lambda points, state: at)
    state = SimpleNamespace(calibrated=calibrated, surfaces=[SimpleNamespace(normal=normal)])
    np.testing.assert_allclose(_heights_of_feet(model, observations, state), -1.5, atol=1e-12)
