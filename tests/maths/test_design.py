"""Every column of the groups' design against differences of the observation itself."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment import State, Surface
from pipeline.maths.design import features, of_common, of_poses

STEP = 1e-6
ROOT = np.sqrt(0.5)
NORMALS = np.array([[-ROOT, -ROOT, 0.05], [-1.0, 0.02, -0.03], [-ROOT, ROOT, 0.0], [0.01, -0.02, 1.0]])
SURFACES = tuple(
    Surface(name, normal / np.linalg.norm(normal), np.array([0.3, -2.0 + k, 1.0]), 0.01 * k)
    for k, (name, normal) in enumerate(zip(("P1", "P2", "P3", "H"), NORMALS, strict=True))
)


def observed(state: State, surface: int, x: np.ndarray, p: np.ndarray, T: np.ndarray, pose: np.ndarray) -> Any:
    """v of points x (n, 3) in the sonar's frame, seen from a pose in error; nothing linear here."""
    r = (x @ state.R_body_from_mbes.T + state.lever_arm_m) @ T.T
    X = p + pose[:3] + r + np.cross(pose[3:], r)
    one = state.surfaces[surface]
    return (X - one.centre_m) @ one.normal - one.shift_m


@pytest.mark.parametrize("surface", range(4))
def test_columns_are_derivatives(surface: int) -> None:
    rng = np.random.default_rng(surface)
    R, T = Rotation.random(2, random_state=surface).as_matrix()
    state = State(R, np.array([0.3, 0.2, -2.0]), SURFACES)
    p, x, still = np.array([-5.0, 1.0, 0.2]), 3 * rng.normal(size=(7, 3)), np.zeros(6)
    r = (x @ R.T + state.lever_arm_m) @ T.T
    number = np.full(7, surface)
    q = features(SURFACES, number, r)
    C = of_common(state, number[:1], p[None], T[None], mount=True)[0]
    K = of_poses(SURFACES, number[:1])[0]

    def slope(change: Any) -> np.ndarray:
        """Columns of derivatives; ``change(h)`` gives state and pose."""
        ends = [observed(moved, surface, x, p, T, pose) for moved, pose in (change(STEP), change(-STEP))]
        return (ends[0] - ends[1]) / (2 * STEP)

    for k in range(state.size):
        unit = np.eye(state.size)[k]
        numeric = slope(lambda h, unit=unit: (state.moved(h * unit), still))
        np.testing.assert_allclose(q.T @ C[:, k], numeric, atol=2e-8)
    for k in range(6):
        unit = np.eye(6)[k]
        np.testing.assert_allclose(q.T @ K[:, k], slope(lambda h, unit=unit: (state, h * unit)), atol=2e-8)


def test_the_laser_does_not_see_the_mount() -> None:
    state = State(np.eye(3), np.array([0.3, 0.2, -2.0]), SURFACES)
    surface = np.arange(4)
    poses = (np.tile([-5.0, 1.0, 0.2], (4, 1)), np.tile(np.eye(3), (4, 1, 1)))
    laser, sonar = (of_common(state, surface, *poses, mount=mount) for mount in (False, True))
    assert not laser[:, :, :6].any()
    np.testing.assert_array_equal(laser[:, :, 6:], sonar[:, :, 6:])
