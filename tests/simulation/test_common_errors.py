"""Errors that several beams share, clocks, steering, and the INS's; each against what it does to recorded numbers."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipeline.config.load import load_session
from pipeline.config.session import Drift
from pipeline.errors import ConfigError
from pipeline.simulation.ins_errors import gauss_markov_drift
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.session import SimulatedSession, simulate_session, write_session
from tests.support.files.build import read
from tests.support.level_geometry import LEVEL, STILL, range_m

Change = Callable[..., Scenario]
Pass = Callable[..., SimulatedSession]
PORT = (-60.5, -19.5)  # beams that meet the floor, 3.3 m below the head


@pytest.fixture
def one_pass(changed: Change, noise_free: Scenario) -> Pass:
    """A pass at 5 m, level and still, the head 1 m under water; beams at whole degrees."""

    def simulated(**mbes: Any) -> SimulatedSession:
        given = {"mount": LEVEL, "beams": 131, "sector_deg": 130.0, "ping_rate_hz": 20.0} | mbes
        track = {"distances_m": [5.0], "ins_height_m": 1.0}
        return simulate_session(changed(noise_free, track=track, motion=STILL, mbes=given), 1)

    return simulated


def on_floor(session: SimulatedSession) -> tuple[np.ndarray, np.ndarray]:
    """Ranges and angles (rad) of beams on the floor, (pings, beams)."""
    mbes = session.mbes
    degrees = np.degrees(mbes["angle_rad"])
    rows = (degrees > PORT[0]) & (degrees < PORT[1])
    shape = (len(np.unique(mbes["ping"])), -1)
    return 750 * mbes["two_way_time_s"][rows].reshape(shape), mbes["angle_rad"][rows].reshape(shape)


def test_range_noise_of_a_ping_is_common_to_its_beams(one_pass: Pass) -> None:
    difference = on_floor(one_pass(ping_range_sigma_m=0.005))[0] - on_floor(one_pass())[0]
    assert np.ptp(difference, axis=1).max() < 1e-9
    assert difference[:, 0].std() == pytest.approx(0.005, rel=0.1)


def test_roll_of_a_ping_turns_all_its_beams(one_pass: Pass) -> None:
    """On the floor a range is 3.3 / cos of the true angle."""
    ranges, angles = on_floor(one_pass(ping_roll_sigma_deg=0.05))
    turned = np.degrees(-np.arccos(3.3 / ranges) - angles)
    assert np.ptp(turned, axis=1).max() < 1e-3
    assert turned[:, 0].std() == pytest.approx(0.05, rel=0.1)


def test_steering_noise_is_alike_in_neighbours(one_pass: Pass) -> None:
    ranges, angles = on_floor(one_pass(steering_sigma_deg=0.06, steering_correlation=0.8))
    noise = np.degrees(-np.arccos(3.3 / ranges) - angles)
    assert noise.std() == pytest.approx(0.06, rel=0.1)
    for apart, expected in ((1, 0.8), (4, 0.8**4)):
        assert np.mean(noise[:, apart:] * noise[:, :-apart]) / noise.var() == pytest.approx(expected, abs=0.06)
    assert np.mean(noise[1:] * noise[:-1]) / noise.var() == pytest.approx(0.0, abs=0.06)  # from ping to ping


def test_an_array_errs_with_the_sine_of_twice_the_angle(one_pass: Pass) -> None:
    ranges, angles = on_floor(one_pass(array_ripple_deg=0.05))
    off = np.degrees(-np.arccos(3.3 / ranges) - angles)
    np.testing.assert_allclose(off, 0.05 * np.sin(2 * angles), atol=1e-3)


def test_sound_that_is_faster_at_the_arrays_steers_outward_alone(one_pass: Pass) -> None:
    """sin(true) = 1.001 sin(recorded): the beam at 60° meets the wall higher up; the range straight down stays."""
    session = one_pass(head_speed_excess=0.001)
    true = np.arcsin(1.001 * np.sin(np.radians(60.0)))
    assert range_m(session, 60.0, 0.0) == pytest.approx(5.0 / np.sin(true), abs=2e-5)
    assert abs(5.0 / np.sin(true) - 5.0 / np.sin(np.radians(60.0))) > 5e-3
    assert range_m(session, 0.0, 0.0) == range_m(one_pass(), 0.0, 0.0)


def test_a_stamp_at_reception_is_later_by_the_two_way_time(one_pass: Pass) -> None:
    sent, received = (one_pass(format="parquet", stamp=stamp) for stamp in ("transmission", "reception"))
    np.testing.assert_array_equal(sent.mbes["two_way_time_s"], received.mbes["two_way_time_s"])
    later_s = (received.mbes["t_ns"] - sent.mbes["t_ns"]) / 1e9
    np.testing.assert_allclose(later_s, sent.mbes["two_way_time_s"], atol=1e-9)
    assert later_s.min() > 4e-3


def test_clock_jitter_moves_the_stamps_of_whole_pings(one_pass: Pass) -> None:
    plain, jitter = one_pass(), one_pass(pps_jitter_s=0.0005)
    moved_s = (jitter.pings["t_ns"] - plain.pings["t_ns"]) / 1e9
    assert moved_s.std() == pytest.approx(0.0005, rel=0.1)
    assert abs(moved_s.mean()) < 1e-4
    np.testing.assert_array_equal(jitter.mbes["two_way_time_s"], plain.mbes["two_way_time_s"])
    of_ping = dict(zip(jitter.pings["ping"].tolist(), jitter.pings["t_ns"].tolist(), strict=True))
    assert [of_ping[ping] for ping in jitter.mbes["ping"].tolist()] == jitter.mbes["t_ns"].tolist()


def test_stamps_of_detections_need_a_file_that_holds_them(tmp_path: Any) -> None:
    path = tmp_path / "s.yaml"
    path.write_text("name: s\nmbes:\n  stamp: reception\n")
    with pytest.raises(ConfigError, match="format = xtf: the sonar's own packets hold one time a ping"):
        load_scenario(path)


# --- the INS -----------------------------------------------------------------------------------------------------
def test_a_second_drift_comes_on_top(changed: Change, noisy: Scenario) -> None:
    """The same process as the first, of its own numbers, its own time constant; session.yaml tells the first alone."""
    first, second = ({"horizontal_m": 0.01, "vertical_m": 0.0, "roll_pitch_deg": 0.0, "heading_deg": 0.0,
                      "time_constant_s": tau} for tau in (200.0, 20.0))  # fmt: skip
    one, both = (
        simulate_session(changed(noisy, ins={"drift": first} | more), 2) for more in ({}, {"second_drift": second})
    )
    assert both.session == one.session
    assert both.session["ins"]["drift"]["time_constant_s"] == 200.0
    north_m = (both.ins["latitude_rad"] - one.ins["latitude_rad"]) * 6_358_000
    assert 0.005 < north_m.std() < 0.02
    np.testing.assert_allclose(both.ins["height_m"], one.ins["height_m"], atol=1e-6)  # the ellipsoid curves
    seconds = (one.ins["t_ns"] - one.ins["t_ns"][0]) / 1e9
    alone = gauss_markov_drift(Drift(**second), one.ins["t_ns"], np.random.default_rng(1))[1]
    rate = [np.mean(np.diff(values)[np.diff(seconds) < 1] ** 2) for values in (north_m, alone)]
    assert rate[0] == pytest.approx(rate[1], rel=0.1)  # 2 σ² dt / τ: tells the time constant
    declared = {"drift": second, "drift_declared": first}
    assert simulate_session(changed(noisy, ins=declared), 2).session["ins"]["drift"] == first


def test_gnss_steps_at_full_seconds(changed: Change, noise_free: Scenario) -> None:
    plain, stepping = (simulate_session(changed(noise_free, ins={"gnss_step_m": step}), 2) for step in (0.0, 0.004))
    up_m = stepping.ins["height_m"] - plain.ins["height_m"]
    second = stepping.ins["t_ns"] // 10**9
    steps = np.diff(up_m)
    at_second = np.diff(second) > 0
    assert np.abs(steps[~at_second]).max() < 1e-8
    assert np.sqrt(np.mean(steps[at_second] ** 2)) == pytest.approx(0.004, rel=0.3)
    np.testing.assert_array_equal(stepping.ins["roll_rad"], plain.ins["roll_rad"])


# --- draws -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("block", "values", "least"),
    [
        ("mbes", {"side_lobe_share": 0.3}, 0.5), ("mbes", {"image_share": 0.5}, 0.8),
        ("mbes", {"level_bias_m": 1e-12}, 0.3), ("mbes", {"steering_sigma_deg": 1e-12}, 0.0),
        ("mbes", {"ping_range_sigma_m": 1e-12}, 0.0), ("laser", {"splash_share": 0.5}, 0.9),
        ("laser", {"level_bias_m": 1e-12}, 0.5), ("ins", {"gnss_step_m": 1e-12}, 0.0),
        ("surroundings", {"unevenness_m": 1e-12}, 0.0),
        ("surroundings", {"face_faults": [{"faces": ["P1-1"], "shift_m": 0.01}]}, 0.8),
    ],
)  # fmt: skip
def test_an_effect_does_not_change_the_draws_of_others(
    changed: Change, noisy: Scenario, block: str, values: dict[str, Any], least: float
) -> None:
    """Other sensors' records are the same bytes. Own records that the effect does not concern are, too; where its size
    is next to nothing all stay what they are, but for those where a corner's reach ends."""
    plain, other = simulate_session(noisy, 3), simulate_session(changed(noisy, **{block: values}), 3)
    tables = {"mbes": "two_way_time_s", "laser": "x_m", "ins": "height_m"}
    for name, column in tables.items():
        one, two = getattr(plain, name), getattr(other, name)
        if name != block and block != "surroundings":
            for key in one:
                np.testing.assert_array_equal(one[key], two[key])
        elif len(one[column]) == len(two[column]):
            assert np.mean(one[column] == two[column]) >= least
            if 1e-12 in values.values():
                assert np.mean(np.abs(one[column] - two[column]) > 1e-7) < 1e-3
    assert len(other.mbes["t_ns"]) == pytest.approx(len(plain.mbes["t_ns"]), rel=1e-3)


def test_files_hold_a_cast_and_stamps_of_detections(changed: Change, noisy: Scenario, tmp_path: Any) -> None:
    given = {"format": "parquet", "stamp": "reception", "svp_declared": [[0.0, 1501.0], [4.0, 1499.0]]}
    scenario = changed(noisy, mbes=given)
    simulated = simulate_session(scenario, 2)
    write_session(simulated, tmp_path / "s", scenario)
    told = load_session(tmp_path / "s").mbes
    assert told is not None
    assert told.svp == ((0.0, 1501.0), (4.0, 1499.0))
    parts = [read("mbes", tmp_path / "s" / "mbes" / f"pass_{k}.parquet", "table")[0] for k in (0, 1)]
    np.testing.assert_array_equal(np.concatenate([part["t_ns"] for part in parts]), simulated.mbes["t_ns"])
