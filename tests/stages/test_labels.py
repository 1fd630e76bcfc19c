"""Labels under drift, judged by a twin: the same session, seen by an INS without errors."""

from typing import Any

import numpy as np
import pytest

from pipeline.maths.geometry.rotations import rotation_from_quaternion
from pipeline.maths.geometry.trajectory import Trajectory
from tests.support.simulated import calibrated, made

DRIFT = {"horizontal_m": 0.015, "vertical_m": 0.03, "roll_pitch_deg": 0.01, "heading_deg": 0.03}
CLEAN: dict[str, Any] = {"laser": {"outlier_share": 0.0, "water_return_share": 0.0}}  # every point lies on the target
EXACT: dict[str, Any] = {"ins": {"white": {"position_m": 0.0, "attitude_deg": 0.0}}}
SEED = 8030


def columns(artefacts: dict[str, Any], name: str) -> dict[str, np.ndarray]:
    batches = list(artefacts[name].batches())
    return {key: np.concatenate([batch[key] for batch in batches]) for key in batches[0]}


def true_residuals(artefacts: dict[str, Any], twin: dict[str, Any], truth: dict[str, Any]) -> np.ndarray:
    """Distance of each labelled laser point from its face, placed with the true poses, in sigmas of its own noise."""
    points, poses = columns(artefacts, "segment/laser_labelled"), twin["georeference/poses"]
    trajectory = Trajectory.build(
        poses["t_ns"].to_numpy(),
        poses[["x_pool_m", "y_pool_m", "z_pool_m"]].to_numpy(),
        rotation_from_quaternion(poses[["qw", "qx", "qy", "qz"]].to_numpy()),
    )
    laser = np.column_stack([points[f"{axis}_laser_m"] for axis in "xyz"])
    mount = np.array(truth["laser"]["R_body_from_laser"]), np.array(truth["laser"]["lever_arm_m"])
    placed = trajectory.points_from_body(points["t_ns"], laser @ mount[0].T + mount[1])  # pool and target are one
    faces = artefacts["segment/faces"].set_index("face").loc[points["face"]]
    normals = faces[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy()
    away = np.einsum("ni,ni->n", normals, placed) - faces["distance_m"].to_numpy()
    cosine, range_m = points["cos_incidence"], np.linalg.norm(laser, axis=1)
    scenario = truth["settings"]["laser"]
    across = range_m * np.radians(scenario["angle_sigma_deg"])
    return np.asarray(away / np.hypot(scenario["range_sigma_m"] * cosine, across * np.sqrt(1 - cosine**2)))


@pytest.fixture(scope="module")
def under_drift() -> tuple[dict[str, Any], np.ndarray]:
    session, twin = made(CLEAN, {"ins": {"drift": DRIFT}}, seed=SEED), made(CLEAN, EXACT, seed=SEED)
    np.testing.assert_array_equal(session.laser["x_m"], twin.laser["x_m"])
    artefacts = calibrated(session, until="segment")
    assert artefacts["segment/provisional_mount"]["label_change"].iloc[0] < 0.005
    return artefacts, true_residuals(artefacts, calibrated(twin, until="georeference"), session.truth)


def test_no_labelled_laser_point_lies_on_another_face(under_drift: tuple[dict[str, Any], np.ndarray]) -> None:
    _, residuals = under_drift
    assert len(residuals) > 50_000
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(1.0, abs=0.05)  # the yardstick itself
    assert np.abs(residuals).max() < 6
