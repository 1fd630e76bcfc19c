"""Beams of tilted transmit sectors, against arguments by hand and an integration of the ray equation."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from pipeline.config.load import load_session
from pipeline.errors import ConfigError
from pipeline.simulation.beams import BeamBundles, directions_in_mbes, swing_rad, transmit_tilts_rad
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.raycast import RayCaster
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.session import SimulatedSession, simulate_session, write_session
from tests.support.files.build import read
from tests.support.level_geometry import LEVEL, LEVEL_CURVES, STILL, distance_to_model_m, range_m

Change = Callable[..., Scenario]


def sectors(*edges: tuple[float, float]) -> dict[str, Any]:
    """The keys of a fan in sectors (to_deg, tilt_deg)."""
    return {"format": "parquet", "sectors": [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges]}


def one_pass(changed: Change, noise_free: Scenario, mount: dict[str, float], **mbes: Any) -> SimulatedSession:
    """A pass at 5 m, level and still, the sonar 1 m under water, 3.3 m above the floor; beams at whole degrees."""
    scenario = changed(
        noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL,
        mbes={"mount": LEVEL | mount, "beams": 131, "sector_deg": 130.0} | mbes,
    )  # fmt: skip
    return simulate_session(scenario, 1)


def test_a_ray_by_hand() -> None:
    """Of 1 m at θ = 30°, τ = -0.75° half a metre is to starboard, 13.09 mm astern; the rest is down."""
    swing, there = swing_rad(np.array([0.5]), np.radians([-0.75]))
    ray = directions_in_mbes(swing, np.radians([-0.75]))[0]
    assert there[0]
    assert ray == pytest.approx([0.5, -0.0130896, -np.sqrt(1 - 0.25 - 0.0130896**2)], abs=1e-7)


@pytest.mark.parametrize("tilt_deg", [-45.0, -10.0, -0.75, 0.3, 10.0])
def test_rays_keep_both_angles_with_the_arrays(tilt_deg: float) -> None:
    """Every ray of a cone has the same angle with its axis: 90° - θ with x, 90° - τ with y."""
    sines = np.linspace(-0.999, 0.999, 41)
    tilts = np.full(41, np.radians(tilt_deg))
    swing, there = swing_rad(sines, tilts)
    rays = directions_in_mbes(swing, tilts)[there]
    assert there.sum() > 25
    np.testing.assert_array_equal(there, np.arccos(np.abs(sines)) > np.abs(tilts))  # else the cones do not meet
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(np.arccos(rays[:, 0]), np.arccos(sines[there]), atol=1e-12)
    np.testing.assert_allclose(np.degrees(np.arccos(rays[:, 1])), 90.0 - tilt_deg, atol=1e-12)
    assert (rays[:, 2] < 0).all()


def test_a_fan_that_is_not_tilted_is_the_plane_athwart() -> None:
    angles = np.radians(np.linspace(-85.0, 85.0, 35))
    swing, there = swing_rad(np.sin(angles), np.zeros(35))
    assert there.all()
    np.testing.assert_allclose(swing, angles, atol=1e-13)


@pytest.mark.parametrize("tilt_deg", [-10.0, 10.0])
def test_a_fan_tilted_forward_meets_the_wall_earlier(changed: Change, noise_free: Scenario, tilt_deg: float) -> None:
    """The beam at 60° reaches the wall's front after 5 / sin 60° = 5.77 m whatever the tilt, and that 5.77 sin τ, one
    metre, further ahead. The front is there from y = -1.5 to 1.5."""
    session = one_pass(changed, noise_free, {}, **sectors((90.0, tilt_deg)))
    wall, ahead = 5.0 / np.sin(np.radians(60.0)), np.sign(tilt_deg)
    for y in (-2.2, 0.0, 0.2):
        assert range_m(session, 60.0, ahead * y) == pytest.approx(wall, abs=LEVEL_CURVES)
    assert range_m(session, 60.0, ahead * 0.9) > wall + 0.05
    down = 3.3 / np.cos(np.radians(10.0))
    assert range_m(session, 0.0, 0.0) == pytest.approx(down, abs=LEVEL_CURVES)
    # at 30° to port the floor's point lies r / 2 to port, r sin 10° ahead, 3.3 m below: Pythagoras
    assert range_m(session, -30.0, 0.0) == pytest.approx(3.3 / np.sqrt(0.75 - np.sin(np.radians(10)) ** 2), abs=1e-5)


def test_each_sector_has_its_tilt_and_each_ping_its_own(changed: Change, noise_free: Scenario) -> None:
    """A border belongs to the sector that ends there; pings take turns by their numbers, dropped ones as well."""
    given = sectors((-45.5, -0.447), (50.5, -0.75), (90.0, -0.5)) | {"ping_tilts_deg": [0.0, 0.3, 1.0]}
    mbes = one_pass(changed, noise_free, {}, **given, dropped_ping_share=0.2).mbes
    angle, tilt = np.rint(np.degrees(mbes["angle_rad"])).astype(int), np.degrees(mbes["transmit_tilt_rad"])
    of_ping = np.array([0.0, 0.3, 1.0])[mbes["ping"] % 3]
    assert len(np.unique(np.diff(np.unique(mbes["ping"])))) > 1  # some are dropped
    for low, high, expected in ((-65, -46, -0.447), (-45, -45, -0.75), (-44, 50, -0.75), (51, 65, -0.5)):
        rows = (angle >= low) & (angle <= high)
        assert rows.sum() > 20
        np.testing.assert_allclose(tilt[rows], expected + of_ping[rows], atol=1e-12)
    at_border = changed(noise_free, mbes=sectors((0.0, 1.0), (90.0, 2.0))).mbes
    tilts = transmit_tilts_rad(at_border, np.array([-1e-9, 0.0, 1e-9]), np.array([7]))
    np.testing.assert_allclose(np.degrees(tilts), [[1.0, 1.0, 2.0]])


@pytest.mark.parametrize(
    "mbes",
    [
        sectors((-46.0, -0.447), (50.0, -0.75), (90.0, -0.447)),
        sectors((0.0, 10.0), (90.0, -10.0)) | {"ping_tilts_deg": [0.0, 0.4]},
        sectors((0.0, -10.0), (90.0, 6.0)) | {"sound_speed_recorded_m_s": 1485.0},
        sectors((0.0, -10.0), (90.0, 6.0)) | {"sound_speed_recorded_m_s": 1515.0, "point_beams": False},
    ],
    ids=["em2042", "large", "recorded speed too low", "too high, wide beams"],
)
def test_points_georeferenced_by_hand_lie_on_the_target(
    changed: Change, noise_free: Scenario, place: Callable[..., np.ndarray], mbes: dict[str, Any]
) -> None:
    session = simulate_session(changed(noise_free, mbes=mbes), 3)
    mount = session.truth["mbes"]["mount"]

    def distances_m(tilt_sign: float, speed_of_head: bool = False) -> np.ndarray:
        changes = {"transmit_tilt_rad": tilt_sign * session.mbes["transmit_tilt_rad"]}
        truth = session.truth
        if speed_of_head:
            truth = truth | {"sound_speed_true_m_s": truth["sound_speed_recorded_m_s"]}
        told = dataclasses.replace(session, mbes=session.mbes | changes, truth=truth)
        return distance_to_model_m(place(told, "mbes", mount, every=11), 8.0, 3.0, 1.0, 0.5)

    found = distances_m(1.0)
    assert len(found) > 300
    if mbes.get("point_beams", True):
        assert found.max() < 5e-6
    assert np.mean(found < 5e-6) > 0.8  # wide beams that touch an edge lie beside it
    assert np.mean(distances_m(-1.0) < 1e-4) < 0.7  # on wall and floor alone a tilt may hide
    assert np.mean(distances_m(0.0) < 1e-4) < 0.7
    if "sound_speed_recorded_m_s" in mbes:
        assert np.median(distances_m(1.0, speed_of_head=True)) > 1e-3


def test_a_wide_beam_is_wide_in_both_angles(changed: Change, noise_free: Scenario) -> None:
    """The parts of a beam of 0.2° by 0.3°, nearly at the end of its fan: their angles with the arrays' axes."""
    seen: list[np.ndarray] = []

    class Watched(RayCaster):
        def first_met(self, origins_m: Any, directions: Any) -> Any:
            seen.append(directions)
            return super().first_met(origins_m, directions)

    wide = {"beam_deg": [0.2, 0.3], "point_beams": False, "sub_rays": [3, 3]}
    scenario = changed(noise_free, mbes=wide)
    beams = BeamBundles(scenario.mbes, Watched(build_mesh(scenario.target, scenario.surroundings)), 0.0)
    for angle_deg, tilt_deg in ((60.0, -20.0), (-70.0, 5.0), (10.0, 0.0)):
        tilt = np.radians([[tilt_deg]])
        swing, _ = swing_rad(np.sin(np.radians([[angle_deg]])), tilt)
        _, axes = beams.paths(np.array([[-5.0, 0.0, -1.0]]), np.eye(3)[None], swing, tilt)
        rays = seen.pop()
        np.testing.assert_array_equal(axes[0, 0], rays[4])
        across, along = (np.degrees(np.arcsin(rays[:, k])) for k in (0, 1))
        np.testing.assert_allclose(across, angle_deg + np.repeat([-0.1, 0.0, 0.1], 3), atol=2e-3)
        np.testing.assert_allclose(along, tilt_deg + np.tile([-0.15, 0.0, 0.15], 3), atol=1e-9)


def test_angle_noise_strays_across_and_keeps_the_tilt(changed: Change, noise_free: Scenario) -> None:
    """On the wall y of a sounding is r sin τ whatever the noise; its range 5 / sin θ tells the angle's noise."""
    session = one_pass(changed, noise_free, {}, **sectors((90.0, -5.0)), angle_sigma_deg=0.06)
    mbes = session.mbes
    middle = np.abs(mbes["t_ns"] - session.truth["passes"][0]["start_ns"] - 5.0 / 0.4 * 1e9) < 0.9 / 0.4 * 1e9
    on_wall = middle & (mbes["angle_rad"] > np.radians(59.5)) & (mbes["angle_rad"] < np.radians(64))
    assert on_wall.sum() > 50
    noise = np.degrees(np.arcsin(5.0 / (750 * mbes["two_way_time_s"][on_wall])) - mbes["angle_rad"][on_wall])
    assert noise.std() == pytest.approx(0.06, rel=0.3)
    np.testing.assert_allclose(np.degrees(mbes["transmit_tilt_rad"]), -5.0, atol=1e-12)


def test_separate_projector_lengthens_the_tilted_path(changed: Change, noise_free: Scenario) -> None:
    offset = [0.0, 0.3, 0.119]
    session = one_pass(changed, noise_free, {}, **sectors((90.0, -8.0)), projector_offset_m=offset)
    hit = np.array([0.0, -3.3 * np.tan(np.radians(8.0)), -3.3])
    expected = (np.linalg.norm(hit) + np.linalg.norm(hit - offset)) / 2
    assert range_m(session, 0.0, 0.0) == pytest.approx(expected, abs=LEVEL_CURVES)


@pytest.mark.parametrize("gradient", [0.5, -0.5])
@pytest.mark.parametrize("angle_deg", [0.0, 62.0])
def test_where_sound_is_faster_below_tilted_beams_bend_upward(
    changed: Change, noise_free: Scenario, gradient: float, angle_deg: float
) -> None:
    """Integrated: dX/dt = c d, dd/dt = -(grad c - d (d · grad c)), until the floor or the wall; the head bow up by 20°
    the middle beam looks forward by 30°, so that it bends along the track."""
    mbes = sectors((90.0, 10.0)) | {"sound_speed_gradient_1_s": gradient}
    session = one_pass(changed, noise_free, {"pitch_deg": 20.0}, **mbes)
    speed, start = 1500.0, np.array([-5.0, 0.0, -1.0])
    across, forward = np.sin(np.radians([angle_deg, 10.0]))
    in_mbes = [across, forward, -np.sqrt(1 - across**2 - forward**2)]
    ray = Rotation.from_euler("x", 20.0, degrees=True).apply(in_mbes)

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        grad, d = np.array([0.0, 0.0, -gradient]), y[3:]
        return np.concatenate([(speed - gradient * (y[2] - start[2])) * d, -(grad - d * (d @ grad))])

    def floor(_: float, y: np.ndarray) -> float:
        return float(y[2] + 4.3)

    def wall(_: float, y: np.ndarray) -> float:
        return float(y[0])

    for event in (floor, wall):
        event.terminal = True
    end = solve_ivp(rate, (0, 0.02), np.r_[start, ray], events=(floor, wall), rtol=1e-11, atol=1e-13)
    straight = min(-3.3 / ray[2], 5.0 / ray[0] if ray[0] > 0 else np.inf)
    assert abs(speed * end.t[-1] - straight) > 3e-4
    y = -end.y[1, -1]  # so that it arrives in the middle of the wall
    assert range_m(session, angle_deg, float(y)) == pytest.approx(speed * end.t[-1], abs=3 * LEVEL_CURVES)


def test_the_file_holds_the_tilts(tmp_path: Path, changed: Change, noisy: Scenario) -> None:
    scenario = changed(noisy, mbes=sectors((0.0, -0.447), (90.0, -0.75)) | {"latency_s": 0.1})
    simulated = simulate_session(scenario, 5)
    write_session(simulated, tmp_path / "s", scenario)
    session = load_session(tmp_path / "s")
    assert session.mbes is not None
    assert (session.mbes.format, list(session.mbes.files)) == ("table", ["mbes/*.parquet"])
    paths = [tmp_path / "s" / "mbes" / f"pass_{k}.parquet" for k in (0, 1)]
    tilts = np.concatenate([pq.read_table(path)["transmit_tilt_deg"].to_numpy() for path in paths])
    assert set(np.round(tilts, 9)) == {-0.447, -0.75}
    parts = [read("mbes", path, "table") for path in paths]
    assert not any(dropped for _, dropped in parts)
    for name, values in simulated.mbes.items():
        found = np.concatenate([columns[name] for columns, _ in parts])
        np.testing.assert_allclose(found, values, rtol=1e-14, atol=0, err_msg=name)


def test_a_file_without_place_for_tilts_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    for text, words in (
        ("sectors: [{to_deg: 90.0, tilt_deg: -0.75}]", "format = xtf: the sonar's own packets hold no transmit tilt"),
        ("format: r2s\n  ping_tilts_deg: [0.0, 0.3]", "format = r2s"),
        ("format: parquet\n  sectors: [{to_deg: 50.0, tilt_deg: -0.75}]", "the last one with to_deg: 90"),
        ("format: parquet\n  sectors: [{to_deg: 90.0, tilt_deg: 30}]\n  ping_tilts_deg: [16]", "add up to 46.0°"),
    ):
        path.write_text(f"name: tilted\nmbes:\n  {text}\n")
        with pytest.raises(ConfigError) as caught:
            load_scenario(path)
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)
