"""Every column of the epochs' design against differences of the observation itself."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.body_motion import BodyPoses
from pipeline.maths.adjustment.design_matrix import SensorOnSurface, parameter_design, pose_design
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import (
    LASER_PARAMETERS,
    MBES_FEATURES,
    MBES_PARAMETERS,
    FurtherHead,
    State,
)
from pipeline.maths.adjustment.weighting import common_variance
from pipeline.maths.geometry.rotations import exp_so3

STEP = 1e-6
ROOT = np.sqrt(0.5)
NORMALS = np.array([[-ROOT, -ROOT, 0.05], [-1.0, 0.02, -0.03], [-ROOT, ROOT, 0.0], [0.01, -0.008, 1.0]])
SURFACES = tuple(
    ObservedSurface.at(name, normal / np.linalg.norm(normal), np.array([0.3, -2.0 + k, 1.0]), 0.01 * k)
    for k, (name, normal) in enumerate(zip(("P1", "P2", "P3", "H"), NORMALS, strict=True))
)
P, VELOCITY, TURNING = np.array([-5.0, 1.0, 0.2]), np.array([0.1, 0.5, -0.05]), np.array([0.02, -0.01, 0.03])
R_LASER, T = Rotation.random(2, random_state=9).as_matrix()
LASER_LEVER = np.array([0.2, 0.5, 1.1])
FORM = np.linspace(0.2, 0.9, 7)  # of a bow, at the points


def observed(sensor: str, state: State, surface: int, x: np.ndarray, pose: np.ndarray) -> Any:
    """v of points x (n, 3) in the sensor's frame, seen from a pose in error; nothing linear here but the pose error."""
    other = dict(zip(state.names, state.additional_values(), strict=True))
    prefix, is_sonar = f"{sensor}_", sensor != "laser"
    if is_sonar:
        R, lever = state.mount_of(sensor)
    else:
        turn = np.array([other[f"laser_rotation_{axis}"] for axis in "xyz"])
        R, lever = exp_so3(turn) @ R_LASER, LASER_LEVER + [other[f"laser_lever_arm_{axis}"] for axis in "xyz"]
    latency = other[f"{prefix}latency"]
    turned = exp_so3(-TURNING * latency) @ T
    range_m = np.linalg.norm(x, axis=1)
    incidence = np.arccos(np.abs(x @ R.T @ T.T @ SURFACES[surface].normal) / range_m)
    bias = other[f"{prefix}range"]
    bias = bias + other[f"{prefix}incidence"] * (1 / np.cos(incidence) - 1) / (np.sqrt(2) - 1)
    if is_sonar and SURFACES[surface].family == "H":
        bias = bias + other[f"{prefix}level_range"]
    longer = 1 + bias / range_m
    r = (x * longer[:, None] @ R.T + lever) @ turned.T
    X = P - VELOCITY * latency + pose[:3] + r + np.cross(pose[3:], r)
    one = state.surfaces[surface]
    if is_sonar:
        one = one.updated(*(other[f"wet_{one.family}_{name}"] for name in ("turn_1", "turn_2", "shift")))
        bow = 0.0 if one.family == "H" else other[f"wet_{one.family}_bow"]
        return (X - one.centre_m) @ one.normal - one.shift_m - bow * FORM
    return (X - one.centre_m) @ one.normal - one.shift_m


@pytest.mark.parametrize("sensor", ["mbes", "mbes_2", "laser"])
@pytest.mark.parametrize("surface", range(4))
def test_columns_are_derivatives(sensor: str, surface: int) -> None:
    rng = np.random.default_rng(surface)
    R, other = Rotation.random(2, random_state=surface).as_matrix()
    second = FurtherHead("mbes_2", other, np.array([-0.4, 0.1, -1.8]))
    state = State.at(R, np.array([0.3, 0.2, -2.0]), SURFACES, further=[second])
    x, still = 3 * rng.normal(size=(7, 3)), np.zeros(6)
    mount, lever = (R_LASER, LASER_LEVER) if sensor == "laser" else state.mount_of(sensor)
    one = SURFACES[surface]
    x[:2] *= -np.sign(x[:2] @ mount.T @ T.T @ one.normal)[:, None] * [[1], [-1]]  # both sides: of H there are bottoms
    r = (x @ mount.T + lever) @ T.T
    ray = x @ mount.T @ T.T / np.linalg.norm(x, axis=1, keepdims=True)
    slant = ray @ one.normal
    by_incidence = slant * (1 / np.abs(slant) - 1) / (np.sqrt(2) - 1)
    q = np.vstack([np.ones(7), one.tangents @ r.T, slant, by_incidence])
    if sensor != "laser":  # the sonar's other features are tested where they are made
        q = np.vstack([q[:4], np.zeros((len(MBES_FEATURES) - 2, 7)), by_incidence, FORM])
    features = len(q)
    poses = BodyPoses(P[None], T[None], np.concatenate([VELOCITY, TURNING])[None])
    C = parameter_design(state, SensorOnSurface(sensor, lever, surface, features), poses)[0]
    K = pose_design(SURFACES, np.array([surface]))[0]
    columns = state.columns(sensor, surface)

    def slope(change: Any) -> np.ndarray:
        """Columns of derivatives; ``change(h)`` gives state and pose."""
        ends = [observed(sensor, moved, surface, x, pose) for moved, pose in (change(STEP), change(-STEP))]
        return (ends[0] - ends[1]) / (2 * STEP)

    whole = np.zeros((7, state.size))
    whole[:, columns] = q.T @ C
    for k in range(state.size):
        unit = np.eye(state.size)[k]
        numeric = slope(lambda h, unit=unit: (state.updated(h * unit), still))
        np.testing.assert_allclose(whole[:, k], numeric, atol=3e-8, err_msg=state.names[k])
    for k in range(6):
        unit = np.eye(6)[k]
        np.testing.assert_allclose(q[:3].T @ K[:, k], slope(lambda h, unit=unit: (state, h * unit)), atol=2e-8)


def test_the_common_variance_is_the_scatter_of_points_under_noisy_records() -> None:
    """Poses in error by a mean of two records' noise, each component with a sigma of its own."""
    rng = np.random.default_rng(4)
    white = np.array([0.001, 0.003, 0.002, 4e-4, 2e-4, 6e-4])
    r, shares = 5 * rng.normal(size=(4, 3)), np.array([0.0, 0.3, 0.5, 1.0])
    sooner, later = white * rng.normal(size=(2, 100_000, 6))
    for one, K in zip(SURFACES, pose_design(SURFACES, np.arange(4)), strict=True):
        q = np.vstack([np.ones(4), one.tangents @ r.T])
        found = common_variance(K.T @ q, shares, white)
        for place, s, variance in zip(r, shares, found, strict=True):
            pose = (1 - s) * sooner + s * later
            moved = (pose[:, :3] + np.cross(pose[:, 3:], place)) @ one.normal
            assert variance == pytest.approx(np.var(moved), rel=0.024)


def test_a_state_moves_each_unknown_by_its_name() -> None:
    state = State.at(np.eye(3), np.zeros(3), SURFACES)
    assert len(set(state.names)) == state.size == len(MBES_PARAMETERS) + len(LASER_PARAMETERS) + 7 * len(SURFACES)
    step = np.arange(1, state.size + 1) * 1e-4
    moved = state.updated(step)
    values = dict(zip(state.names, moved.additional_values(), strict=True))
    for k, name in enumerate(state.names):
        own = name in ("rotation_x", "rotation_y", "rotation_z") or name.startswith("lever_arm") or name[0] in "PH"
        assert values[name] == pytest.approx(0.0 if own else step[k])
    np.testing.assert_allclose(moved.lever_arm_m, step[3:6])
    assert moved.surfaces[3].shift_m - SURFACES[3].shift_m == pytest.approx(step[state.names.index("H_shift")])
    assert replace(moved, additional=state.additional).additional_values().any() == np.False_


def test_heads_share_the_water_and_the_wet_faces_and_nothing_else() -> None:
    further = [FurtherHead(name, np.eye(3), np.zeros(3)) for name in ("mbes_2", "mbes_3")]
    state = State.at(np.eye(3), np.zeros(3), SURFACES, further=further)
    alone = State.at(np.eye(3), np.zeros(3), SURFACES)
    assert state.names[: alone.size] == alone.names
    of_head = [np.array(state.names)[state.columns(head, 2)].tolist() for head in state.heads]
    assert of_head[0] == np.array(alone.names)[alone.columns("mbes", 2)].tolist()
    for name, columns in zip(("mbes_2", "mbes_3"), of_head[1:], strict=True):
        shared = set(columns) & set(of_head[0])
        assert shared == {
            *(f"P3_{part}" for part in ("turn_1", "turn_2", "shift")),
            *(f"wet_P3_{part}" for part in ("turn_1", "turn_2", "shift", "bow")),
            "sound_speed",
            "sound_speed_gradient",
        }
        for first, own in zip(of_head[0], columns, strict=True):  # in the order of the design
            assert own in (first, f"{name}_{first.removeprefix('mbes_')}")
    assert not set(of_head[1]) & set(of_head[2]) - set(of_head[0])


def test_each_head_takes_its_own_steps() -> None:
    further = [FurtherHead("mbes_2", R_LASER, LASER_LEVER), FurtherHead("mbes_3", T, np.zeros(3))]
    state = State.at(np.eye(3), np.zeros(3), SURFACES, further=further)
    step = np.random.default_rng(3).normal(size=state.size) * 1e-3
    moved = state.updated(step)
    for head in state.heads:
        (R, lever), (before, lever_before) = moved.mount_of(head), state.mount_of(head)
        of_head = step[state.mount_columns(head)]
        np.testing.assert_allclose(R, exp_so3(of_head[:3]) @ before, atol=1e-15)
        np.testing.assert_allclose(lever - lever_before, of_head[3:], atol=1e-15)
    kept = np.array([not (name[0] in "PH" and name.partition("_")[2] in ("turn_1", "turn_2")) for name in state.names])
    centred = moved.deviation_from(state)
    surfaces = np.array([0.01 * k for k in range(4)])
    centred[state.surface_slice][2::3] -= surfaces  # a shift counts from the centre, not from the other state
    np.testing.assert_allclose(centred[kept], step[kept], atol=1e-15)
