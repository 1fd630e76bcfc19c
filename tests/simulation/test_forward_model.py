"""The forward model against trigonometry by hand, and against a georeferencing written out from the conventions."""

from collections.abc import Callable

import numpy as np
import pytest
from pyproj import Transformer
from scipy.spatial.transform import Rotation

from pipeline.simulation.motion import R_level_from_body
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from pipeline.simulation.site import R_ecef_from_level
from tests.support.level_geometry import LEVEL, LEVEL_CURVES, STILL, distance_to_model_m, range_m

Change = Callable[..., Scenario]


def one_pass(changed: Change, noise_free: Scenario, mount: dict[str, float], **motion: float) -> SimulatedSession:
    """A pass at 5 m with everything level and still but what is given; the sonar 1 m under water."""
    scenario = changed(
        noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL | motion,
        mbes={"mount": LEVEL | mount, "beams": 131, "sector_deg": 130.0},
    )
    return simulate_session(scenario, 1)


def test_level_beams_meet_wall_and_floor(changed: Change, noise_free: Scenario) -> None:
    session = one_pass(changed, noise_free, {})
    assert range_m(session, 60.0, 0.0) == pytest.approx(5.0 / np.sin(np.radians(60)), abs=LEVEL_CURVES)
    assert range_m(session, 0.0, 0.0) == pytest.approx(4.3 - 1.0, abs=LEVEL_CURVES)  # the floor, 0.3 m below the foot
    assert range_m(session, -30.0, 0.0) == pytest.approx(3.3 / np.cos(np.radians(30)), abs=LEVEL_CURVES)


def test_starboard_down_lowers_the_starboard_beam(changed: Change, noise_free: Scenario) -> None:
    by_vessel = one_pass(changed, noise_free, {}, roll_offset_deg=10.0)
    # the sonar hangs 2 m below the INS: with starboard down it swings to port by 2 sin 10°, and comes up
    depth = 2 * np.cos(np.radians(10)) - 1
    assert range_m(by_vessel, 0.0, 0.0) == pytest.approx((4.3 - depth) / np.cos(np.radians(10)), abs=LEVEL_CURVES)
    assert range_m(by_vessel, 40.0, 0.0) == pytest.approx((4.3 - depth) / np.cos(np.radians(30)), abs=LEVEL_CURVES)
    assert range_m(by_vessel, -40.0, 0.0) == pytest.approx((4.3 - depth) / np.cos(np.radians(50)), abs=LEVEL_CURVES)
    by_mount = one_pass(changed, noise_free, {"roll_deg": -10.0})  # starboard up: the beam at 50° looks along 60°
    assert range_m(by_mount, 50.0, 0.0) == pytest.approx(5.0 / np.sin(np.radians(60)), abs=LEVEL_CURVES)


def test_bow_up_turns_the_fan_forward(changed: Change, noise_free: Scenario) -> None:
    session = one_pass(changed, noise_free, {"pitch_deg": 10.0})
    assert range_m(session, 0.0, 0.0) == pytest.approx(3.3 / np.cos(np.radians(10)), abs=LEVEL_CURVES)
    # of the beam at 60° the component that looks down is tipped forward: y = +cos 60 sin 10 > 0
    # so that it is on the wall already at y = -1.6, and off it again at y = 1.4
    assert range_m(session, 60.0, -1.6) == pytest.approx(5.0 / np.sin(np.radians(60)), abs=LEVEL_CURVES)
    assert range_m(session, 60.0, 1.4) > 5.0 / np.sin(np.radians(60)) + 0.05


def test_yaw_is_counter_clockwise_and_azimuth_clockwise(changed: Change, noise_free: Scenario) -> None:
    mount = one_pass(changed, noise_free, {"yaw_deg": 10.0})  # the starboard beam looks ahead, to +y
    expected = 5.0 / np.sin(np.radians(60)) / np.cos(np.radians(10))
    assert range_m(mount, 60.0, -2.0) == pytest.approx(expected, abs=LEVEL_CURVES)  # hits y = -1.12, on the wall
    assert range_m(mount, 60.0, 1.0) != pytest.approx(expected, abs=1e-2)  # hits y = 1.88, a block or the back wall
    heading = one_pass(changed, noise_free, {}, heading_offset_deg=10.0)  # the starboard beam looks astern, to -y
    assert range_m(heading, 60.0, 2.0) == pytest.approx(expected, abs=LEVEL_CURVES)
    assert range_m(heading, 60.0, -1.0) != pytest.approx(expected, abs=1e-2)


def test_ins_reports_the_track_clockwise_from_north(changed: Change, noise_free: Scenario) -> None:
    target = noise_free.target.model_dump() | {"azimuth_deg": 90.0}
    session = simulate_session(changed(noise_free, target=target, motion=STILL), 1)
    ins = session.ins
    assert np.degrees(ins["azimuth_rad"]) == pytest.approx(90.0, abs=1e-4)
    first = ins["t_ns"] < session.truth["passes"][0]["end_ns"]
    assert np.all(np.diff(ins["longitude_rad"][first]) > 0)  # +y is east
    assert np.degrees(ins["latitude_rad"][first]) == pytest.approx(36.0 + 4.0 / 110_970, abs=1e-6)  # -x is north: 4 m


def test_attitude_and_level_are_the_conventions_rotations() -> None:
    roll, pitch, azimuth = np.random.default_rng(0).uniform(-3, 3, (3, 20))
    expected = Rotation.from_euler("ZXY", np.stack([-azimuth, pitch, roll], axis=1)).as_matrix()
    np.testing.assert_allclose(R_level_from_body(roll, pitch, azimuth), expected, atol=1e-14)
    expected = Rotation.from_euler("ZX", np.stack([azimuth + np.pi / 2, np.pi / 2 - pitch], axis=1)).as_matrix()
    np.testing.assert_allclose(R_ecef_from_level(pitch, azimuth), expected, atol=1e-14)


@pytest.mark.parametrize("azimuth_deg", [0.0, -163.0, 71.0])
@pytest.mark.parametrize("sensor", ["laser", "mbes"])
def test_points_georeferenced_by_hand_lie_on_the_target(
    changed: Change, noise_free: Scenario, place: Callable[..., np.ndarray], sensor: str, azimuth_deg: float
) -> None:
    target = noise_free.target.model_dump() | {"azimuth_deg": azimuth_deg}
    session = simulate_session(changed(noise_free, target=target), 3)
    mount = session.truth["mbes"]["mount"] if sensor == "mbes" else session.session["laser"]["mount"]
    points = place(session, sensor, mount, every=11)
    assert len(points) > 300
    assert np.abs(distance_to_model_m(points, 8.0, 3.0, 1.0, 0.5)).max() < 5e-6
    on_wall = (np.abs(points[:, 0]) < 1e-3) & (np.abs(points[:, 1]) < 1.4)
    assert on_wall.sum() > 30
    assert (points[:, 2] < 0).all() if sensor == "mbes" else (points[:, 2] > 0).all()
    coarse = place(session, "mbes", session.session["mbes"]["mount"], every=11)
    assert np.median(distance_to_model_m(coarse, 8.0, 3.0, 1.0, 0.5)) > 1e-3  # the test can fail


def test_latency_is_added_to_recorded_times(changed: Change, noise_free: Scenario) -> None:
    plain = simulate_session(noise_free, 1)
    late = simulate_session(changed(noise_free, mbes={"latency_s": 0.25}, laser={"latency_s": -0.5}), 1)
    np.testing.assert_array_equal(late.mbes["t_ns"], plain.mbes["t_ns"] + 250_000_000)
    np.testing.assert_array_equal(late.laser["t_ns"], plain.laser["t_ns"] - 500_000_000)
    np.testing.assert_array_equal(late.mbes["two_way_time_s"], plain.mbes["two_way_time_s"])
    assert late.session["mbes"]["latency_s"] == 0.0
    declared = simulate_session(changed(noise_free, mbes={"latency_s": 0.25, "latency_declared_s": 0.2}), 1)
    assert declared.session["mbes"]["latency_s"] == 0.2


def test_wrong_sound_speed_scales_ranges_and_sines(changed: Change, noise_free: Scenario) -> None:
    wrong = {"sound_speed_true_m_s": 1500.0, "sound_speed_recorded_m_s": 1485.0}
    scenario = changed(
        noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL,
        mbes=wrong | {"mount": LEVEL, "beams": 131, "sector_deg": 130.0},
    )
    session = simulate_session(scenario, 1)
    true_angle = np.arcsin(1500 / 1485 * np.sin(np.radians(60.0)))
    assert range_m(session, 60.0, 0.0) * 1500 / 1485 == pytest.approx(5.0 / np.sin(true_angle), abs=LEVEL_CURVES)
    assert session.session["mbes"]["sound_speed_m_s"] is None
    told = simulate_session(changed(scenario, mbes={"give_true_sound_speed": True}), 1)
    assert told.session["mbes"]["sound_speed_m_s"] == 1500.0


@pytest.mark.parametrize("gradient", [0.5, -0.5])
def test_where_sound_is_faster_below_beams_bend_upward(
    changed: Change, noise_free: Scenario, gradient: float
) -> None:
    """Exactly, of an arc: sin t = p c, x = (cos t0 - cos t1) / (p g), time = ln(tan(t1 / 2) / tan(t0 / 2)) / g."""
    scenario = changed(
        noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL,
        mbes={"mount": LEVEL, "beams": 131, "sector_deg": 130.0, "sound_speed_gradient_1_s": gradient},
    )  # fmt: skip
    session = simulate_session(scenario, 1)
    speed = scenario.mbes.sound_speed_true_m_s
    for angle_deg in (60.0, 64.0):
        start = np.radians(angle_deg)
        p = np.sin(start) / speed
        end = np.arccos(np.cos(start) - 5.0 * p * gradient)
        time_s = np.log(np.tan(end / 2) / np.tan(start / 2)) / gradient
        straight = 5.0 / np.sin(start)
        assert abs(speed * time_s - straight) > 1e-3
        assert range_m(session, angle_deg, 0.0) == pytest.approx(speed * time_s, abs=2 * LEVEL_CURVES)


def test_separate_projector_lengthens_the_path(changed: Change, noise_free: Scenario) -> None:
    mbes = {"mount": LEVEL, "beams": 131, "sector_deg": 130.0, "projector_offset_m": [0.0, 0.3, 0.119]}
    scenario = changed(noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL, mbes=mbes)
    down = np.array([0.0, 0.0, -3.3])
    expected = (3.3 + np.linalg.norm(down - [0.0, 0.3, 0.119])) / 2
    assert range_m(simulate_session(scenario, 1), 0.0, 0.0) == pytest.approx(expected, abs=LEVEL_CURVES)


def test_angle_noise_turns_the_beam_not_the_record(changed: Change, noise_free: Scenario) -> None:
    session = simulate_session(
        changed(
            noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL,
            mbes={"mount": LEVEL, "beams": 131, "sector_deg": 130.0, "angle_sigma_deg": 0.06, "ping_rate_hz": 10.0},
        ), 1,
    )
    mbes = session.mbes
    assert len(np.unique(mbes["angle_rad"])) == 131
    middle = np.abs(mbes["t_ns"] - session.truth["passes"][0]["start_ns"] - 4.5 / 0.4 * 1e9) < 1.4 / 0.4 * 1e9
    on_wall = middle & (mbes["angle_rad"] > np.radians(59.5)) & (mbes["angle_rad"] < np.radians(64))
    true_angle = np.arcsin(5.0 / (750 * mbes["two_way_time_s"][on_wall]))
    noise = np.degrees(true_angle - mbes["angle_rad"][on_wall])
    assert noise.std() == pytest.approx(0.06, rel=0.15)
    assert abs(noise.mean()) < 0.01


def test_laser_points_placed_in_ecef_are_the_same_points(
    changed: Change, noise_free: Scenario, place: Callable[..., np.ndarray]
) -> None:
    latency = {"latency_s": 0.3, "latency_declared_s": 0.3}
    placed = simulate_session(changed(noise_free, laser=latency | {"frame": "EPSG:4978"}), 1)
    raw = simulate_session(noise_free, 1)
    origin = placed.truth["target"]["origin"]
    centre = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True).transform(
        origin["longitude_deg"], origin["latitude_deg"], origin["height_m"]
    )
    ecef = np.stack([placed.laser[name] for name in ("x_m", "y_m", "z_m")], axis=1)[::50]
    points = place(raw, "laser", raw.session["laser"]["mount"], every=50)
    np.testing.assert_allclose(np.linalg.norm(ecef - centre, axis=1), np.linalg.norm(points, axis=1), atol=2e-6)
    up = np.array([np.cos(0.2 * np.pi) * np.cos(np.radians(120.1)), np.cos(0.2 * np.pi) * np.sin(np.radians(120.1)), 0])
    up[2] = np.sin(0.2 * np.pi)  # latitude 36°
    np.testing.assert_allclose((ecef - centre) @ up, points[:, 2], atol=2e-6)
    assert placed.session["laser"]["frame"] == "EPSG:4978"
