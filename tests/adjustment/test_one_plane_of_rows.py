"""One plane in two passes of rows, written by LidarToolkit's formulas: frames, signs, what the adjustment makes of it.

The rows are without noise, from a mount that is known, so that a wrong sign anywhere leads away from it.
"""

import numpy as np
import pytest

from pipeline.maths.geometry.rotations import exp_so3
from pipeline.mount import Mounted
from tests.support.lidar_toolkit import dcm_nwu
from tools.libac_adjustment import Adjusted, PlanePoints, adjusted_on
from tools.libac_rows import NEAR_M, Rows, mount_of_libac, mount_of_rows
from tools.libac_surfaces import planes_in

BORESIGHT_DEG, LEVER_M = (0.8, -1.5, 0.4), (-0.2, 0.04, 2.4)  # forward, port, up
NORMAL = np.array([-0.25, -0.93, -0.27])  # north, west, up, toward the boat
MIDDLE = np.array([NEAR_M[1], -NEAR_M[0], NEAR_M[2]])
LINES, POINTS = 60, 30
OFF_DEG, OFF_M = 0.3, 0.03  # of the coarse roll and x


def _table(heading_deg: float, start_s: float) -> np.ndarray:
    """Return rows (n, 22) of a pass by the plane, 1 m wide and high, 11 m from the boat, which rolls."""
    normal = NORMAL / np.linalg.norm(NORMAL)
    along = np.cross([0.0, 0.0, 1.0], normal) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], normal))
    B, heading = dcm_nwu(*np.radians(BORESIGHT_DEG)), np.radians(heading_deg)
    forward = np.array([np.cos(heading), -np.sin(heading), 0.0])
    table = np.zeros((LINES * POINTS, 22))
    for line in range(LINES):
        t = line * 0.02
        rph = np.radians([2 * np.sin(1.4 * t + start_s), 1.7 + 0.5 * np.sin(1.1 * t), heading_deg])
        p = MIDDLE + 11 * np.array([normal[0], normal[1], 0.0]) - [0, 0, 5] + (t - 0.6) * forward
        C = dcm_nwu(*rph)
        for k, up in enumerate(np.linspace(-0.5, 0.5, POINTS)):
            x = MIDDLE + (t / 1.2 - 0.5) * along + up * np.cross(normal, along)
            xs = B.T @ (C.T @ (x - p) - LEVER_M)
            sigmas = [0.003] * 3
            table[line * POINTS + k] = [*x, start_s + t + k * 3e-6, *xs, *sigmas, *rph, 0, 0, 0, *p, 0.01, 0.01, 0.003]
    return table


@pytest.fixture(scope="module")
def passes() -> list[Rows]:
    return [Rows.of(_table(20.8, 100.0)), Rows.of(_table(199.3, 500.0))]


@pytest.fixture(scope="module")
def true() -> Mounted:
    return mount_of_libac(BORESIGHT_DEG, LEVER_M)


def _adjusted(passes: list[Rows], true: Mounted) -> Adjusted:
    turn, shift_m = np.radians([0.0, OFF_DEG, 0.0]), np.array([OFF_M, 0.0, 0.0])
    coarse = Mounted(exp_so3(turn) @ true.R_body_from_sensor, true.lever_arm_body_m + shift_m)
    return adjusted_on([PlanePoints(rows, np.arange(len(rows))) for rows in passes], coarse)


def test_the_mount_of_the_rows_is_that_of_the_boresight(passes: list[Rows], true: Mounted) -> None:
    found = mount_of_rows(passes)
    assert found.settings() == pytest.approx(true.settings(), abs=1e-6)
    assert true.settings()["roll_deg"] == pytest.approx(BORESIGHT_DEG[0], abs=0.02)  # starboard down in both
    assert true.settings()["pitch_deg"] == pytest.approx(-BORESIGHT_DEG[1], abs=0.02)  # bow up here, bow down there
    assert true.lever_arm_body_m == pytest.approx([-LEVER_M[1], LEVER_M[0], LEVER_M[2]])


def test_points_are_placed_where_the_rows_have_them(passes: list[Rows], true: Mounted) -> None:
    for rows in passes:
        assert np.abs(rows.in_level(true) - rows.placed_m).max() < 1e-9


def test_the_plane_is_found_whole(passes: list[Rows], true: Mounted) -> None:
    normal = np.array([-NORMAL[1], NORMAL[0], NORMAL[2]]) / np.linalg.norm(NORMAL)
    for rows in passes:
        (found,) = planes_in(rows.in_level(true), rows.position_m.mean(axis=0))
        assert len(found.rows) == len(rows)
        assert found.plane.normal == pytest.approx(normal, abs=1e-6)


def test_opposite_courses_tell_of_roll_and_x_and_not_of_y(passes: list[Rows], true: Mounted) -> None:
    adjusted = _adjusted(passes, true)
    error, sigma = adjusted.mount.settings(), adjusted.mount.sigmas(adjusted.covariance)
    error = {key: value - true.settings()[key] for key, value in error.items()}
    assert adjusted.result.converged
    assert abs(error["roll_deg"]) < OFF_DEG / 10
    assert abs(error["x_m"]) < OFF_M / 5
    assert sigma["roll_deg"] < 0.1
    assert sigma["y_m"] > 0.045
    assert np.all(adjusted.shares <= 1 + 1e-9)
    assert np.all(np.diff(adjusted.shares) >= 0)


def test_courses_of_one_direction_do_not_tell_of_x(passes: list[Rows], true: Mounted) -> None:
    """The place of the plane takes it up."""
    adjusted = _adjusted([passes[0], Rows.of(_table(20.8, 500.0))], true)
    assert adjusted.result.converged
    assert adjusted.mount.sigmas(adjusted.covariance)["x_m"] > 0.045
