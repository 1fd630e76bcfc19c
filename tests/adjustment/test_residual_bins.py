"""The bins of residuals: noise must not choose them, and their sums are those of all batches."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.adjustment.residual_statistics import MERGED, _kept, _variables
from pipeline.maths.adjustment.residual_means import BinnedResiduals, merged_residual_sums, residual_sums

WALL_M, SLANT = 4.02, np.radians(40.0)  # distance of the surface along the rays, and their incidence
WATER_M, LEVER_ARM = 0.4, np.array([0.3, 0.2, -0.5])
TURNS = Rotation.from_euler("y", [[0.0], [0.02]]).as_matrix()  # of the body at two INS records


def variables(sensor, measured, along, noise_m, start_m, calibrated="mbes"):
    """The variables of n points measured from ``start_m``, a third of the time between two records.

    measured (n, 3): in the target's frame; along: n · d of all rays; noise_m (n,): of the ranges. From one record to
    the next the sensor rises by 6 cm.
    """
    n = len(noise_m)
    one, zero = np.ones(n), np.zeros(n, dtype=np.int64)
    points = {f"{axis}_target_m": measured[:, k] for k, axis in enumerate("xyz")}
    points |= {f"{axis}_{sensor}_m": np.linalg.norm(measured - start_m, axis=1) * (axis == "x") for axis in "xyz"}
    points |= dict.fromkeys(("pass", "face", "t_ns", "ping"), zero)
    observed = SimpleNamespace(
        points=points, record=zero, share=one / 3, observed=np.stack([along * noise_m, one, one, along * one])
    )
    positions = np.zeros((2, 3))
    positions[:, 2] = start_m[2] + np.array([-0.02, 0.04]) - (TURNS @ LEVER_ARM)[:, 2]
    body = SimpleNamespace(
        trajectory=SimpleNamespace(positions_m=positions, R_frame_from_body=TURNS),
        lever_arm=lambda sensor, state: LEVER_ARM,
    )
    model = SimpleNamespace(
        body=body, wet_heights_m=(-4.0, WATER_M), points_in_target=lambda sensor, points, state: measured
    )
    return dict(_variables(model, sensor, observed, SimpleNamespace(heads=(calibrated,))))


@pytest.mark.parametrize("side", [-1, 1])  # of n · d: a face, or a bottom, whose family's normal is that of the tops
@pytest.mark.parametrize("sensor", ["laser", "mbes"])
def test_a_point_has_the_distance_of_its_surface_not_its_measured_range(sensor: str, side: int) -> None:
    """A range that is 10 cm short puts a point 10 cm · cos 40° before the wall; the wall stays at 4.02 m."""
    noise_m = np.linspace(-0.1, 0.1, 101)
    measured = (WALL_M + noise_m)[:, None] * np.array([1.0, 0.0, 0.0])
    found = variables(sensor, measured, side * np.cos(SLANT), noise_m, np.zeros(3))
    np.testing.assert_allclose(found["distance"], WALL_M, atol=1e-12)


@pytest.mark.parametrize("calibrated", ["laser", "mbes"])
@pytest.mark.parametrize(("slope_deg", "steep"), [(90.0, -0.7), (90.0, 0.3), (60.0, -0.5)])
def test_a_point_has_the_height_at_which_its_ray_meets_the_surface(
    slope_deg: float, steep: float, calibrated: str
) -> None:
    """Rays to one place 1.5 m below the water, steep to the face; ranges up to 7 cm off."""
    noise_m, at = np.linspace(-0.07, 0.07, 15), np.array([0.0, 0.2, WATER_M - 1.5])
    normal = np.array([-np.sin(np.radians(slope_deg)), 0.0, np.cos(np.radians(slope_deg))])
    ray = np.array([np.sqrt(1 - steep**2), 0.0, steep])
    start = at - 5.0 * ray
    found = variables("laser", start + (5.0 + noise_m)[:, None] * ray, normal @ ray, noise_m, start, calibrated)
    np.testing.assert_allclose(found["height"], -1.5, atol=1e-12)


@pytest.mark.parametrize("batches", [1, MERGED - 1, MERGED, MERGED + 1, 3 * MERGED])
def test_sums_that_are_merged_on_the_way_are_those_of_all_batches(batches: int) -> None:
    """Whole numbers, so that no sum is rounded."""
    rng = np.random.default_rng(batches)

    def one():
        first, second, slot, weight, v_m = rng.integers(0, 4, size=(5, 30))
        return residual_sums(BinnedResiduals(first, second, slot, weight + 1.0, v_m - 2.0, v_m * 1.0))

    by_variable = [{"pass": one(), "face": one()} for _ in range(batches)]
    pieces, samples = {}, []
    kept = list(_kept(((sums, number, -number) for number, sums in enumerate(by_variable)), pieces, samples))
    assert (kept, samples) == (list(range(batches)), [-number for number in range(batches)])
    for variable, parts in pieces.items():
        assert len(parts) < MERGED
        found = merged_residual_sums(parts)
        expected = merged_residual_sums([sums[variable] for sums in by_variable])
        for name in ("key", "sums", "largest"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
