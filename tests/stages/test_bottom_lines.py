"""Lines over a flat bottom beside a wall: what they add to the mount is what a patch test's geometry says."""

import json
from typing import Any

import numpy as np
import pytest

from pipeline.artefacts.from_tables import trajectory_in_target
from tests.support.docks import of_faces
from tests.support.effort import often
from tests.support.simulated import calibrated, made, without_biases

MOUNT = {"roll_deg": -1.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
WALL = {"corners": [[0, 6, -4], [0, -6, -4], [0, -6, 2], [0, 6, 2]]}
RETURN = {"corners": [[2.5, 8.5, -4], [0, 6, -4], [0, 6, 2], [2.5, 8.5, 2]]}
BOTTOM = {"corners": [[-12, -6, -4], [-1, -6, -4], [-1, 6, -4], [-12, 6, -4]], "seen": "wet"}
RANGE_M, ANGLE_RAD = 0.008, np.radians(0.06)  # the sonar's noise


def session(faces: dict[str, Any], drift: bool) -> Any:
    """A wall, a return and a bottom, passed both ways at two distances; without drift the INS is free from errors."""
    still = {"ins": {"white": {"position_m": 0.0, "attitude_deg": 0.0}}}
    track = {"distances_m": [4.0, 4.0, 7.0, 7.0], "courses": ["along", "back"], "half_length_m": 6.0}
    blocks = of_faces(faces) | {
        "track": track,
        "laser": {"field_deg": [-130.0, 130.0]},
        "mbes": {"mount": MOUNT, "sector_deg": 140.0, "ping_rate_hz": 5.0, "point_beams": True, "corner_share": 0.0,
                 "outlier_share": 0.0, "surface_share": 0.0, "coarse_angle_deg": 0.1, "coarse_lever_m": 0.02},
    }  # fmt: skip
    return without_biases(made(blocks, {} if drift else still, seed=3))


def information(found: dict[str, Any], faces: dict[str, Any]) -> np.ndarray:
    """(6, 6): of the soundings on the bottom about ε and δ, its plane unknown, by hand.

    A sounding at x from the sonar, body axes, lies at p + R ((1 + [ε]×) x + l + δ). Its height above z = a + b X + c Y
    changes by m · (ε × x + δ) = (x × m) · ε + m · δ with m the upward normal in body axes; by range and angle it has
    the sigma of RANGE_M along the ray and r ANGLE_RAD across it, in the plane of the fan.
    """
    tables = found["georeference/poses"], found["segment/target_pose"]
    trajectory, number = trajectory_in_target(*tables), list(faces).index("bottom")
    parts = [part.columns for part in found["segment/soundings_labelled"].parts]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    rows = columns["face"] == number
    own = np.column_stack([columns[f"{axis}_mbes_m"][rows] for axis in "xyz"]).astype(float)
    roll, pitch, yaw = np.radians([MOUNT["roll_deg"], MOUNT["pitch_deg"], MOUNT["yaw_deg"]])
    cr, sr, cp, sp, cy, sy = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    about_y = np.array([[cr, 0, sr], [0, 1, 0], [-sr, 0, cr]])
    about_x = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    body = own @ (about_z @ about_x @ about_y).T
    position, R = trajectory.poses_at(columns["t_ns"][rows])
    placed = position + np.einsum("nij,nj->ni", R, body + np.array([0.30, 0.20, -2.01]))
    up = R[:, 2, :]  # the target's z in body axes
    length = np.linalg.norm(body, axis=1)
    along = body / length[:, None]
    across = np.cross(along, np.array([0.0, 1.0, 0.0]))  # about the boat's y axis, nearly
    sigma = np.hypot(RANGE_M * np.sum(along * up, axis=1), ANGLE_RAD * length * np.sum(across * up, axis=1))
    sigma = sigma / np.sqrt(columns["edge_weight"][rows])
    design = np.hstack([np.cross(body, up), up]) / sigma[:, None]
    plane = np.column_stack([np.ones(len(placed)), placed[:, 0], placed[:, 1]]) / sigma[:, None]
    left = design - plane @ np.linalg.lstsq(plane, design, rcond=None)[0]
    return left.T @ left


@pytest.mark.parametrize("drift", often([True], [False, True]))
def test_a_bottom_adds_what_the_geometry_of_a_patch_test_says(drift: bool) -> None:
    """Without errors of the INS the information adds up; with them it adds less. Roll gains most."""
    walls = {"wall": WALL, "return": RETURN}
    without = session(walls | {"bottom": BOTTOM}, drift)
    before = calibrated(without, pool={"target": {"faces": walls}})
    after = calibrated(without)
    covariances = [
        np.array(json.loads(found["report/calibration.json"])["methods"]["adjustment"]["covariance"])
        for found in (before, after)
    ]
    expected = np.linalg.inv(np.linalg.inv(covariances[0]) + information(after, walls | {"bottom": BOTTOM}))
    ratio = np.sqrt(np.diag(covariances[1]) / np.diag(expected))
    if drift:
        assert (ratio > 0.95).all()
    else:
        np.testing.assert_allclose(ratio, 1.0, atol=0.1)
    assert np.sqrt(covariances[1][1, 1] / covariances[0][1, 1]) < 0.55  # roll
