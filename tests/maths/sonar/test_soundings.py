"""From travel time and two angles to a point: against turned rays, the simulator's forward model, and differences."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from pipeline.maths.sonar.ray_tracing import Cast
from pipeline.maths.sonar.soundings import (
    across_beam,
    beam_half_widths,
    points_in_mbes,
    receive_angle,
    refracted_points,
)
from pipeline.simulation.beams import directions_in_mbes, swing_rad
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.motion import Movement
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.session import simulate_session
from tests.support.roots import SCENARIOS

NOISE_FREE = SCENARIOS / "noise_free.yaml"
SPEED = 1480.0
BEAMS_DEG = (-120.0, -103.0, -79.0, -30.0, 0.0, 20.0, 65.0, 103.0, 170.0)
ANGLES_DEG, TILTS_DEG = (grid.ravel() for grid in np.meshgrid(BEAMS_DEG, [-10.0, -0.75, 0.0, 10.0]))
UP = Rotation.from_euler("ZXY", [12.0, 2.0, -48.0], degrees=True).as_matrix()


def points(angles: np.ndarray, tilts: np.ndarray, ranges: float = 6.0, **more: Any) -> np.ndarray:
    """(n, 3) by points_in_mbes, all of them possible."""
    n = len(angles)
    found, valid = points_in_mbes(np.full(n, 2 * ranges / SPEED), angles, tilts, np.full(n, SPEED), **more)
    assert valid.all()
    return found


def turned(angles_deg: np.ndarray, tilts_deg: np.ndarray) -> np.ndarray:
    """(n, 3) unit rays: of the receive beam without tilt, turned about the receiving array, which keeps it in its beam,
    until the angle with the transmitting array is 90° - τ."""
    upright = Rotation.from_euler("Y", -angles_deg[:, None], degrees=True).apply([0.0, 0.0, -1.0])
    about_x = np.arcsin(np.sin(np.radians(tilts_deg)) / -upright[:, 2])
    return np.asarray(Rotation.from_euler("X", about_x[:, None]).apply(upright))


def test_by_hand() -> None:
    """6 m at 30° to starboard, the fan tilted astern by 0.75°: 3 m to starboard, 78.5 mm astern, the rest down."""
    found = points(np.radians([30.0]), np.radians([-0.75]))[0]
    assert found == pytest.approx([3.0, -0.07853757, -np.sqrt(36 - 9 - 0.07853757**2)], abs=1e-7)


def test_a_ray_lies_on_both_cones() -> None:
    """Starboard +, forward +, and beyond 90° above the array's plane."""
    expected = 6.0 * turned(ANGLES_DEG, TILTS_DEG)
    np.testing.assert_allclose(points(np.radians(ANGLES_DEG), np.radians(TILTS_DEG)), expected, rtol=0, atol=1e-12)
    beyond = np.abs(ANGLES_DEG) > 90
    assert (expected[beyond, 2] > 0).all()
    assert (expected[~beyond, 2] < 0).all()
    assert (expected[:, 0] * np.sin(np.radians(ANGLES_DEG)) >= 0).all()
    assert (expected[:, 1] * TILTS_DEG >= 0).all()


def test_the_simulators_rays_are_the_same() -> None:
    grids = np.meshgrid(np.radians(np.arange(-79, 80)), np.radians([-10, -0.447, 10]))
    angles, tilts = (grid.ravel() for grid in grids)
    swing, there = swing_rad(np.sin(angles), tilts)
    assert there.all()
    np.testing.assert_allclose(points(angles, tilts), 6.0 * directions_in_mbes(swing, tilts), rtol=0, atol=1e-12)


@pytest.mark.parametrize("recorded", [1500.0, 1477.0])
def test_soundings_of_the_simulator_lie_where_they_were_made(recorded: float) -> None:
    """Point beams without noise, sectors tilted by 10° either way, other tilts from ping to ping, and a recorded speed
    that is wrong: with the true poses every sounding lies on one of the target's planes."""
    edges = ((-30.0, -10.0), (10.0, -0.75), (90.0, 9.7))
    sectors = [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges]
    content = load_scenario(NOISE_FREE).model_dump(mode="json")
    content["mbes"] |= {"sectors": sectors, "ping_tilts_deg": [0.0, 0.3], "format": "parquet", "ping_rate_hz": 2.0}
    content["mbes"] |= {"sound_speed_recorded_m_s": recorded, "projector_offset_m": [0.02, 0.3, 0.1], "beams": 131}
    content["laser"]["point_rate_hz"] = 100.0
    content["track"]["distances_m"] = [5.0]
    scenario = Scenario.model_validate_json(json.dumps(content), strict=True)
    made, mesh = simulate_session(scenario, 4), build_mesh(scenario.target, scenario.surroundings)
    pose = Movement(scenario, 4).pose(0, made.mbes["t_ns"])

    def off_m(tilts: np.ndarray) -> np.ndarray:
        names = (made.mbes["two_way_time_s"], made.mbes["angle_rad"], tilts, made.mbes["sound_speed_m_s"])
        found, valid = points_in_mbes(
            *names, true_sound_speed_m_s=1500.0, projector_offset_m=np.array([0.02, 0.3, 0.1])
        )
        assert valid.all()
        body = R_body_from_sensor(scenario.mbes.mount).apply(found) + lever_arm_m(scenario.mbes.mount)
        target = pose.position_target_m + np.einsum("nij,nj->ni", pose.R_target_from_body, body)
        return np.asarray(np.min(np.abs(target @ mesh.normals.T - mesh.distances_m), axis=1))

    tilts = made.mbes["transmit_tilt_rad"]
    assert len(tilts) > 3000
    assert set(np.round(np.degrees(tilts), 6)) == {-10.0, -9.7, -0.75, -0.45, 9.7, 10.0}
    assert off_m(tilts).max() < 1e-9
    for wrong in (-tilts, np.zeros_like(tilts), tilts + np.radians(0.01)):
        assert off_m(wrong).max() > 1e-4


def test_where_cones_do_not_meet_there_is_no_point() -> None:
    """They touch where |θ| + |τ| = 90°."""
    angles = np.radians([79.99, 80.01, -80.01, 100.01, 99.99])
    tilts = np.radians([10.0, 10.0, -10.0, 10.0, -10.0])
    found, valid = points_in_mbes(np.full(5, 0.008), angles, tilts, np.full(5, SPEED))
    assert valid.tolist() == [True, False, False, True, False]
    assert np.isfinite(found).all()
    # and so with the true speed: both sines grow
    _, valid = points_in_mbes(np.full(5, 0.008), angles, tilts, np.full(5, SPEED), true_sound_speed_m_s=1.01 * SPEED)
    assert not valid.any()


def test_a_wrong_speed_turns_both_angles() -> None:
    k = 1.02
    angles, tilts = np.radians([-60.0, 10.0, 50.0]), np.radians([10.0, -10.0, -5.0])
    found = points(angles, tilts, true_sound_speed_m_s=k * SPEED)
    sines = k * np.sin(angles), k * np.sin(tilts)
    expected = k * 6.0 * turned(*(np.degrees(np.arcsin(one)) for one in sines))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_projector_apart_keeps_the_path() -> None:
    offset = np.array([0.1, 0.3, 0.12])
    found = points(np.radians(ANGLES_DEG), np.radians(TILTS_DEG), projector_offset_m=offset)
    path = np.linalg.norm(found, axis=1) + np.linalg.norm(found - offset, axis=1)
    np.testing.assert_allclose(path, 12.0, atol=1e-12)
    unit = found / np.linalg.norm(found, axis=1)[:, None]
    np.testing.assert_allclose(unit, turned(ANGLES_DEG, TILTS_DEG), atol=1e-12)


def test_the_receive_angle_comes_back_whatever_the_tilt() -> None:
    found = receive_angle(points(np.radians(ANGLES_DEG), np.radians(TILTS_DEG)))
    np.testing.assert_allclose(np.degrees(found), ANGLES_DEG, atol=1e-10)


def difference(by: str, step: float = 1e-6) -> np.ndarray:
    """(n, 3) central difference of the points by one of the two angles, with the other fixed."""
    angles, tilts = np.radians(ANGLES_DEG), np.radians(TILTS_DEG)
    turn = np.array([step, 0.0]) if by == "angle" else np.array([0.0, step])
    ends = [points(angles + sign * turn[0], tilts + sign * turn[1]) for sign in (1, -1)]
    return (ends[0] - ends[1]) / (2 * step)


def test_how_points_move_with_the_angle_of_the_receive_beam() -> None:
    found = across_beam(*points(np.radians(ANGLES_DEG), np.radians(TILTS_DEG)).T).T
    np.testing.assert_allclose(found, difference("angle"), rtol=1e-6, atol=1e-7)
    level = TILTS_DEG == 0
    np.testing.assert_allclose(np.linalg.norm(found[level], axis=1), 6.0, rtol=1e-12)
    assert (np.linalg.norm(found[~level & (ANGLES_DEG != 0)], axis=1) > 6.0 + 1e-6).all()


def test_at_the_end_of_a_fan_the_movement_is_bounded() -> None:
    """There the true one grows beyond all bounds."""
    ends = points(np.radians([79.9999, -79.9999]), np.radians([10.0, 10.0]))
    assert np.all(np.linalg.norm(across_beam(*ends.T), axis=0) < 5 * 6.0)


def test_half_axes_of_a_footprint_are_half_the_widths_of_both_beams() -> None:
    """Signs of an axis do not matter. Not of rays within 15° of the arrays' plane: there the cones nearly touch."""
    across_rad, along_rad = np.radians([0.5, 1.0])
    seen = points(np.radians(ANGLES_DEG), np.radians(TILTS_DEG))
    far = np.abs(seen[:, 2]) > 6.0 * np.sin(np.radians(15.0))
    assert far.sum() > 20
    found = beam_half_widths(seen[far], across_rad, along_rad)
    for axis, by, width in zip(found, ("angle", "tilt"), (across_rad, along_rad), strict=True):
        expected = difference(by)[far] * width / 2
        signs = np.sign(np.einsum("ni,ni->n", axis, expected))[:, None]
        np.testing.assert_allclose(axis * signs, expected, rtol=3e-5, atol=1e-8)  # tan of half the width


ODD = np.abs(ANGLES_DEG) < 79  # rays that some more speed at the head does not turn into the array's plane


def test_traced_through_water_of_one_speed_is_the_true_speed() -> None:
    angles, tilts = np.radians(ANGLES_DEG[ODD]), np.radians(TILTS_DEG[ODD])
    n = len(angles)
    cast = Cast(np.array([0.0, 20.0]), np.array([1.01 * SPEED] * 2))
    R = np.repeat(UP[None], n, axis=0)
    found = refracted_points(points(angles, tilts), np.full(n, SPEED), R, np.full(n, 0.8), cast)
    np.testing.assert_allclose(found, points(angles, tilts, true_sound_speed_m_s=1.01 * SPEED), atol=2e-6)


def test_tilted_rays_through_a_cast_end_where_the_ray_equation_says() -> None:
    """Integrated in three dimensions: dX/dt = c d, dd/dt = -(grad c - d (d · grad c)), z up, for half the travel time;
    the head works with a wrong speed, so that both sines are larger by c at the head / that speed."""
    cast = Cast(np.array([0.0, 1.5, 4.0, 9.0]), np.array([1490.0, 1484.0, 1492.0, 1489.0]))
    head, wrong = 0.9, 1475.0
    angles, tilts = np.array([-65.0, -20.0, 0.0, 40.0, 62.0]), np.array([10.0, -10.0, 8.0, -0.75, -6.0])
    time_s = 2 * 7.0 / wrong
    rays, _ = points_in_mbes(np.full(5, time_s), np.radians(angles), np.radians(tilts), np.full(5, wrong))
    found = refracted_points(rays, np.full(5, wrong), np.repeat(UP[None], 5, axis=0), np.full(5, head), cast)
    k = float(cast.speed_at(np.array([head]))[0]) / wrong
    sines = [np.degrees(np.arcsin(k * np.sin(np.radians(one)))) for one in (angles, tilts)]
    bent = []
    for start, end in zip(turned(*sines) @ UP.T, found @ UP.T, strict=True):

        def rate(_: float, y: np.ndarray) -> np.ndarray:
            depth, d = head - y[2], y[3:]
            c = float(np.interp(depth, cast.depth_m, cast.speed_m_s))
            layer = np.clip(np.searchsorted(cast.depth_m, depth, side="right") - 1, 0, 2)
            inside = cast.depth_m[0] < depth < cast.depth_m[-1]
            slope = np.diff(cast.speed_m_s)[layer] / np.diff(cast.depth_m)[layer] if inside else 0.0
            grad = np.array([0.0, 0.0, -slope])
            return np.concatenate([c * d, -(grad - d * (d @ grad))])

        begin, span = np.r_[np.zeros(3), start], (0, time_s / 2)
        done = solve_ivp(rate, span, begin, rtol=1e-10, atol=1e-12, max_step=time_s / 2000)
        np.testing.assert_allclose(end, done.y[:3, -1], atol=2e-5)
        bent.append(np.linalg.norm(done.y[:3, -1] - start * 7.0 * k))
    assert min(bent) > 1e-3
