"""Faces that do not stand where the design says, against planes and curves cut by hand; and layered water."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from pipeline.errors import ConfigError
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.relief import Relief
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from tests.support.level_geometry import LEVEL, LEVEL_CURVES, STILL, range_m

Change = Callable[..., Scenario]
Pass = Callable[..., SimulatedSession]
HEAD = np.array([-5.0, 0.0, -1.0])


def ray(angle_deg: float) -> np.ndarray:
    return np.array([np.sin(np.radians(angle_deg)), 0.0, -np.cos(np.radians(angle_deg))])


def range_to_plane_m(origin: np.ndarray, direction: np.ndarray, normal: np.ndarray, point: np.ndarray) -> float:
    return float(normal @ (point - origin) / (normal @ direction))


@pytest.fixture
def one_pass(changed: Change, noise_free: Scenario) -> Pass:
    """A pass at 5 m, level and still, the head 1 m under water; beams at whole degrees; and the faults of faces."""

    def simulated(*faults: dict[str, Any], **mbes: Any) -> SimulatedSession:
        scenario = changed(
            noise_free, track={"distances_m": [5.0], "ins_height_m": 1.0}, motion=STILL,
            surroundings={"face_faults": list(faults)},
            mbes={"mount": LEVEL, "beams": 161, "sector_deg": 160.0, "ping_rate_hz": 10.0} | mbes,
        )  # fmt: skip
        return simulate_session(scenario, 1)

    return simulated


def test_a_shifted_face_stands_toward_the_boat_or_higher(one_pass: Pass) -> None:
    fault = {"faces": ["P2", "P1-1", "P1-1-top"], "part": "wet", "shift_m": 0.01}
    plain, off = one_pass(), one_pass(fault)
    for angle_deg, y_m, cosine in (
        (60.0, 0.0, np.sin(np.radians(60.0))),  # the wall
        (74.0, -2.0, np.sin(np.radians(74.0)) / np.sqrt(2)),  # P1-1, from z = -3 to -2.5
        (75.0, -1.6, np.cos(np.radians(75.0))),  # its top
    ):
        nearer = range_m(plain, angle_deg, y_m) - range_m(off, angle_deg, y_m)
        assert nearer == pytest.approx(0.01 / cosine, abs=LEVEL_CURVES)
    assert range_m(plain, 68.0, -2.0) == range_m(off, 68.0, -2.0)  # P1-0, or beside it
    for name in ("x_m", "y_m", "z_m"):
        np.testing.assert_array_equal(plain.laser[name], off.laser[name])  # the dry part stands
    of_all = one_pass({"faces": ["H"], "shift_m": 0.01})
    higher = range_m(plain, 75.0, -1.6) - range_m(of_all, 75.0, -1.6)
    assert higher == pytest.approx(0.01 / np.cos(np.radians(75.0)), abs=LEVEL_CURVES)
    whole = one_pass({"faces": ["P2"], "shift_m": 0.01})
    assert np.mean(whole.laser["x_m"] != plain.laser["x_m"]) > 0.1


@pytest.mark.parametrize("turn_deg", [(0.3, 0.0), (0.0, 0.3)], ids=["ccw from above", "upper edge to the boat"])
def test_a_face_is_turned_about_the_middle_of_its_part(one_pass: Pass, turn_deg: tuple[float, float]) -> None:
    """The wet wall from z = -4 to 0, about (0, 0, -2). Its normal (-1, 0, 0) turns to -y, or down."""
    session = one_pass({"faces": ["P2"], "part": "wet", "turn_deg": list(turn_deg)})
    angle = np.radians(0.3)
    normal = -np.array([np.cos(angle), np.sin(angle), 0.0] if turn_deg[0] else [np.cos(angle), 0.0, np.sin(angle)])
    for angle_deg, y_m in ((60.0, 1.2), (60.0, -1.2), (70.0, 1.2)):
        when = session.pings["t_ns"] - session.truth["passes"][0]["start_ns"]
        y = -4.5 + 0.4 * when[np.argmin(np.abs(-4.5 + 0.4 * when / 1e9 - y_m))] / 1e9
        expected = range_to_plane_m(HEAD + np.array([0, y, 0]), ray(angle_deg), normal, np.array([0.0, 0.0, -2.0]))
        assert range_m(session, angle_deg, y_m) == pytest.approx(expected, abs=3 * LEVEL_CURVES)
        assert abs(expected - 5.0 / np.sin(np.radians(angle_deg))) > 5e-4


def test_a_bowed_wall_is_a_parabola_under_water(one_pass: Pass) -> None:
    session = one_pass({"faces": ["P2"], "part": "wet", "bow_m": -0.01})
    for angle_deg in (60.0, 70.0, 79.0):

        def before_wall_m(r: float, angle_deg: float = angle_deg) -> float:
            x, _, z = HEAD + r * ray(angle_deg)
            return float(x - 0.01 * (1 - ((z + 2) / 2) ** 2))  # pushed back, by 1 cm at z = -2

        assert range_m(session, angle_deg, 0.0) == pytest.approx(brentq(before_wall_m, 4.0, 7.0), abs=LEVEL_CURVES)
    assert brentq(before_wall_m, 4.0, 7.0) > 5.0 / np.sin(np.radians(79.0)) + 0.005


def test_both_sensors_see_the_same_uneven_faces(
    changed: Change, noise_free: Scenario, place: Callable[..., np.ndarray]
) -> None:
    """Points on the wall lie as far before it as the relief is high there; and the field has its sigma and length."""
    scenario = changed(noise_free, surroundings={"unevenness_m": 0.004, "unevenness_length_m": 0.4})
    session = simulate_session(scenario, 3)
    mesh = build_mesh(scenario.target, scenario.surroundings)
    relief = Relief(scenario.target, scenario.surroundings, mesh, 3)
    wall = mesh.names.index("wall_3")

    for sensor, truth in (("mbes", session.truth["mbes"]), ("laser", session.truth["laser"])):
        points = place(session, sensor, truth["mount"], every=3)
        on_wall = points[(np.abs(points[:, 0]) < 0.02) & (np.abs(points[:, 1]) < 1.4) & (np.abs(points[:, 2]) < 3.9)]
        assert len(on_wall) > 100
        np.testing.assert_allclose(-on_wall[:, 0], relief.heights_m(np.full(len(on_wall), wall), on_wall), atol=5e-6)
        assert np.std(on_wall[:, 0]) > 0.001
    many = np.random.default_rng(0).uniform(-20, 20, (5000, 3)) * [0, 1, 1]
    own, beside = [], []
    for seed in range(6):
        field = Relief(scenario.target, scenario.surroundings, mesh, seed)
        on_wall = np.full(len(many), wall)
        own.append(field.heights_m(on_wall, many))
        beside.append(field.heights_m(on_wall, many + np.array([0.0, 0.4, 0.0])))
    assert np.std(own) == pytest.approx(0.004, rel=0.02)
    assert np.corrcoef(np.ravel(own), np.ravel(beside))[0, 1] == pytest.approx(np.exp(-0.5), abs=0.02)


def test_a_fault_of_an_unknown_face_is_refused(changed: Change, noise_free: Scenario) -> None:
    words = "face_faults.0..faces: the target has no face 'P9'; its faces are H, P1, P1-0"
    with pytest.raises(ConfigError, match=words):
        simulate_session(changed(noise_free, surroundings={"face_faults": [{"faces": ["P9"]}]}), 1)


def test_faces_of_a_list_have_their_own_names(scenarios: Any) -> None:
    scenario = load_scenario(scenarios / "dock.yaml")
    mesh = build_mesh(scenario.target, scenario.surroundings)
    relief = Relief(scenario.target, scenario.surroundings, mesh, 1)
    assert set(relief.faces) - {""} == set(scenario.target.faces)
    assert not relief


# --- layered water -----------------------------------------------------------------------------------------------
PROFILE = [[0.0, 1506.0], [1.5, 1503.0], [2.0, 1497.0], [6.0, 1495.0]]


@pytest.mark.parametrize("angle_deg", [-50.0, 0.0, 62.0, 70.0])
def test_beams_bend_through_layers(one_pass: Pass, angle_deg: float) -> None:
    """Integrated: dX/dt = c d, dd/dt = -(grad c - d (d · grad c)). At the head, 1 m deep, sound has 1504 m/s: the array
    works with 1500, so that it looks outward of what it records."""
    depths, speeds = np.array(PROFILE).T
    session = one_pass(sound_speed_profile=PROFILE, svp_declared=[[0.0, 1500.0], [5.0, 1501.0]])
    assert session.session["mbes"]["svp"] == [[0.0, 1500.0], [5.0, 1501.0]]
    sine = 1504 / 1500 * np.sin(np.radians(angle_deg))
    start = np.concatenate([HEAD, [sine, 0.0, -np.sqrt(1 - sine**2)]])

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        speed = np.interp(-y[2], depths, speeds)
        slope = np.interp(-y[2] + 1e-6, depths, speeds) - np.interp(-y[2] - 1e-6, depths, speeds)
        grad = np.array([0.0, 0.0, -slope / 2e-6])
        return np.concatenate([speed * y[3:], -(grad - y[3:] * (y[3:] @ grad))])

    def floor(_: float, y: np.ndarray) -> float:
        return float(y[2] + 4.3)

    def wall(_: float, y: np.ndarray) -> float:
        return float(y[0])

    for event in (floor, wall):
        event.terminal = True
    end = solve_ivp(rate, (0, 0.02), start, events=(floor, wall), rtol=1e-10, atol=1e-12, max_step=2e-5)
    expected = 1500 * end.t[-1]  # the range as recorded
    assert range_m(session, angle_deg, 0.0) == pytest.approx(expected, abs=1e-4)
    assert abs(expected - range_m(one_pass(), angle_deg, 0.0)) > 2e-3


def test_an_even_gradient_as_a_profile_is_the_gradient(one_pass: Pass) -> None:
    by_gradient = one_pass(sound_speed_gradient_1_s=0.5)
    by_profile = one_pass(sound_speed_profile=[[0.0, 1499.5], [10.0, 1504.5]])
    for angle_deg in (-60.0, 0.0, 60.0):
        assert range_m(by_profile, angle_deg, 0.0) == pytest.approx(range_m(by_gradient, angle_deg, 0.0), abs=5e-5)


def test_profiles_that_cannot_be_are_refused(tmp_path: Any) -> None:
    path = tmp_path / "s.yaml"
    for text, words in (
        ("sound_speed_profile: [[0, 1500.0]]", "two depths or more"),
        ("svp_declared: [[2, 1500.0], [1, 1500.0]]", "each greater"),
        ("sound_speed_profile: [[0, 1500.0], [2, 1501.0]]\n  sound_speed_gradient_1_s: 0.1", "leave these out"),
    ):
        path.write_text(f"name: s\nmbes:\n  {text}\n")
        with pytest.raises(ConfigError, match=words):
            load_scenario(path)
