"""Residuals laid out: against plain loops, both sides of a bin's edge, and cells that lie on their face."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.maths.geometry.face_grid import bin_statistics, cell_centres, cells_on_face, face_axes
from pipeline.maths.geometry.planes import angle_between
from pipeline.maths.geometry.rotations import mount_partials

HALF = np.sqrt(0.5)
NORMALS = [(-1.0, 0.0, 0.0), (-HALF, -HALF, 0.0), (-HALF, HALF, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
SLOPES = [(-0.6, 0.0, 0.8), (-0.28, 0.0, 0.96), (0.28 * HALF, 0.28 * HALF, -0.96), (-0.7, np.sqrt(0.02), np.sqrt(0.49))]


@given(st.integers(0, 200), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_bins_against_a_loop(n: int, width: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    keys = random.integers(-3, 4, (n, width))
    residual, weight = random.normal(size=n), random.choice([0.0, 0.4, 1.0], n)
    found = bin_statistics(keys, residual, weight)
    assert found.count.sum() == n
    assert [tuple(key) for key in found.keys] == sorted({tuple(key) for key in keys})
    for key, count, mean, rms in zip(found.keys, found.count, found.mean_m, found.rms_m, strict=True):
        use = np.all(keys == key, axis=1)
        assert count == use.sum()
        if weight[use].sum() == 0:
            assert np.isnan(mean)
            assert np.isnan(rms)
        else:
            assert mean == pytest.approx(np.average(residual[use], weights=weight[use]), abs=1e-12)
            assert rms == pytest.approx(np.sqrt(np.average(residual[use] ** 2, weights=weight[use])), abs=1e-12)


@pytest.mark.parametrize("normal", NORMALS + SLOPES)
def test_cells_lie_on_their_face_round_their_points(normal: tuple[float, float, float]) -> None:
    n, distance = np.array(normal), 0.7
    axes = face_axes(n)
    np.testing.assert_allclose(axes @ axes.T, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(axes @ n, 0, atol=1e-12)
    random = np.random.default_rng(1)
    points = random.uniform(-3, 3, (500, 3))
    points += np.outer(distance - points @ n, n)
    centres = cell_centres(cells_on_face(points, n, 0.1), n, distance, 0.1)
    np.testing.assert_allclose(centres @ n, distance, atol=1e-12)
    assert np.abs((points - centres) @ axes.T).max() <= 0.05 + 1e-9


def test_the_first_axis_of_a_vertical_face_runs_to_the_right_seen_from_the_boat() -> None:
    """The boat looks along +x with z up, so -y is to its right."""
    np.testing.assert_allclose(face_axes(np.array([-1.0, 0.0, 0.0])), [[0, -1, 0], [0, 0, 1]], atol=1e-12)


@pytest.mark.parametrize(("slope_deg", "expected"), [(29.9, [[0.8669, 0, 0.4985], [0, 1, 0]]),
                                                     (30.1, [[0, -1, 0], [0.8652, 0, 0.5015]]),
                                                     (45.0, [[0, -1, 0], [HALF, 0, HALF]])])
def test_banks_are_seen_from_the_boat_and_flat_faces_from_above(slope_deg: float, expected: list[list[float]]) -> None:
    """Two banks built at 45°, one a little steeper, must not be drawn in two ways."""
    slope = np.radians(slope_deg)
    np.testing.assert_allclose(face_axes(np.array([-np.sin(slope), 0.0, np.cos(slope)])), expected, atol=1e-4)


@given(st.floats(1e-9, np.pi), st.integers(0, 2**32 - 1))
def test_angle_between(angle: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    one = random.normal(size=3)
    one /= np.linalg.norm(one)
    axis = np.cross(one, random.normal(size=3))
    other = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).apply(one)
    # near a half turn the chord is flat: the angle is known to the root of the rounding
    assert angle_between(one, other) == pytest.approx(angle, rel=1e-6, abs=1e-7 if angle > 3 else 1e-14)


@given(st.floats(-180, 180), st.floats(-80, 80), st.floats(-180, 180))
def test_partials_of_the_mounts_angles(roll: float, pitch: float, yaw: float) -> None:
    """Against differences of scipy's own angles, for small turns about each body axis."""
    mount = Rotation.from_euler("ZXY", [yaw, pitch, roll], degrees=True)
    found = mount_partials(mount.as_matrix())
    step = 1e-6
    for axis in range(3):
        after, before = (
            (Rotation.from_rotvec(sign * step * np.eye(3)[axis]) * mount).as_euler("ZXY") for sign in (1, -1)
        )
        change = (after - before + np.pi) % (2 * np.pi) - np.pi
        d_yaw, d_pitch, d_roll = change / (2 * step)
        np.testing.assert_allclose(found[:, axis], [d_pitch, d_roll, d_yaw], rtol=1e-4, atol=1e-5)
