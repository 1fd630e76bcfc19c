"""The laser's own calibration through its stages: results, what rests on the coarse mount, refusals."""

import json
from typing import Any

import numpy as np
import pytest

from pipeline.adjustment.laser_design import coarse_mount
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import LaserPrior, narrow, settings_by_name, stage_config
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.mount import Mounted, mount_of
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from stages import adjust
from stages.in_memory import calibrate_in_memory
from tests.support.effort import often
from tests.support.mount_errors import mount_error, rotation_error
from tests.support.roots import SCENARIOS
from tests.support.simulated import THIN, made, merged
from tools.stress_campaigns import WITHIN_10_S

OFF = {"laser": {"coarse_angle_deg": 0.3, "coarse_lever_m": 0.03}, "mbes": {"ping_rate_hz": 0.5}}
DRIFT = {
    "ins": {
        "drift": {
            "horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03,
            "time_constant_s": 200.0,
        }
    }
}
FAST = {"ins": {"rate_hz": 200.0}}  # where it is asked how small the sigmas are
EXACT = {"face_sigma_deg": 0.001, "plumb_sigma_deg": 0.001, "face_sigma_m": 0.0002}
WIDE = {"max_sigma_deg": 1.0, "max_sigma_m": 0.1}
EXACTLY = {"drift_within": {"sigmas": 1.0, "time_constant": 1.0}}


def calibrated(
    session: SimulatedSession, more: dict[str, Any] | None = None, ins: dict[str, Any] | None = None, **pool: Any
) -> dict[str, Any]:
    """Every artefact; ``more``: of session.yaml's laser; ``ins``: of its INS."""
    settings = {name: value for name, value in session.session.items() if name != "mbes"}
    settings["laser"] = settings["laser"] | (more or {})
    settings["ins"] = settings["ins"] | (ins or {})
    raw = {"ins": session.ins, "laser": session.laser}
    given = parse(SessionConfig, settings, "session"), parse(PoolConfig, session.pool | pool, "pool")
    return calibrate_in_memory(*given, raw)


def result_of(found: dict[str, Any]) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(found["report/calibration.json"])
    return content


def errors(result: dict[str, Any], truth: dict[str, Any]) -> np.ndarray:
    """(6,) true minus found: rotation vector about body x, y, z (rad), lever arm (m)."""
    return mount_error(result["laser"], truth, "laser")


@pytest.mark.parametrize("drift", often([DRIFT], [{}, DRIFT]))
@pytest.mark.parametrize("seed", often([2], [2, 3]))
def test_a_mount_wrong_by_three_tenths_of_a_degree_and_3_cm_comes_back(drift: dict[str, Any], seed: int) -> None:
    session = made(OFF, drift, seed=seed)
    fit = EXACT | {"hold_share": 1.0}
    result = result_of(calibrated(session, laser_fit=fit, verdict=WIDE))
    assert result["verdict"] == "accepted", result["reasons"]
    assert result["held"] == {}
    sigma = np.sqrt(np.diag(result["laser"]["covariance_total"]))
    error = errors(result, session.truth)
    assert np.all(np.abs(error) < 3.5 * sigma)
    assert np.all(sigma[:2] < np.radians(0.02))
    if not drift:
        assert np.all(np.abs(error) < np.r_[[np.radians(0.01)] * 3, [0.01] * 3])  # of 0.3° and 3 cm


def test_what_the_session_determines_badly_is_estimated_and_named() -> None:
    session = made(OFF, DRIFT, seed=2)
    result = result_of(calibrated(session, laser_fit=EXACT))
    assert result["verdict_in_words"] == "accepted in part: roll, pitch", result["reasons"]
    block = result["laser"]
    sigmas = block["sigma_mount_total"]
    assert result["held"] == {"yaw": sigmas["yaw_deg"]} | {name: sigmas[f"{name}_m"] for name in "xyz"}
    assert result["rests_on_coarse"] == []
    assert "yaw (±" in result["geometry"]["advice"]
    total, noise = (np.array(block[key]) for key in ("covariance_total", "covariance"))
    sigma = np.sqrt(np.diag(total))
    assert np.all(sigma[3:] > 0.005)
    assert np.all(sigma < 0.5 * np.repeat([np.radians(0.5), 0.05], 3))  # of the coarse mount
    error = errors(result, session.truth)
    assert error @ np.linalg.solve(total, error) < 22.5  # 99.9 % of six degrees of freedom
    assert total[2, 4] < -0.15 * sigma[2] * sigma[4]  # all six with each other: yaw and y
    assert np.linalg.eigvalsh(total - noise).min() > -1e-12


@pytest.mark.thorough
def test_an_ins_that_errs_faster_than_its_session_says_widens_the_sigmas() -> None:
    """Errors within 10 s where 200 s are stated; roll and pitch keep the sigma of a slow drift's mean."""
    session = made(OFF, {"ins": {"drift": WITHIN_10_S, "drift_declared": DRIFT["ins"]["drift"]}}, seed=5)
    pool = {"laser_fit": EXACT, "verdict": WIDE}
    believed, found = (result_of(calibrated(session, ins=more, **pool)) for more in (EXACTLY, {}))
    sigmas = [np.sqrt(np.diag(result["laser"]["covariance_total"])) for result in (believed, found)]
    assert sigmas[1][2] > 1.3 * sigmas[0][2]  # yaw
    assert np.all(sigmas[1][:2] > 0.99 * sigmas[0][:2])
    error, total = errors(found, session.truth), np.array(found["laser"]["covariance_total"])
    assert error @ np.linalg.solve(total, error) < 22.5
    estimated = found["ins_drift_estimated"]
    assert estimated["time_constant_s"] == 200.0
    assert estimated["horizontal_m"] == pytest.approx(WITHIN_10_S["horizontal_m"] * np.sqrt(200 / 10), rel=0.25)  # rate
    assert estimated["roll_pitch_deg"] >= 0.01  # not below the session's


def test_a_surveyed_target_and_a_steady_ins_give_all_six() -> None:
    session = made(OFF, FAST, seed=2)
    fit = EXACT | {"origin_sigma_m": 0.001, "azimuth_sigma_deg": 0.002}
    result = result_of(calibrated(session, laser_fit=fit))
    assert result["held"] == {}
    assert result["verdict"] == "accepted", result["reasons"]
    sigma = np.sqrt(np.diag(result["laser"]["covariance"]))
    assert np.all(sigma[3:] < 0.0015)
    assert np.all(np.abs(errors(result, session.truth)) < 3.5 * np.sqrt(np.diag(result["laser"]["covariance_total"])))


def test_a_surveyed_origin_that_is_wrong_is_seen_in_the_lever_arm() -> None:
    """The sign: a target believed 2 cm farther along +x than it stands draws the laser by as much to starboard."""
    session = made(OFF | {"surroundings": {"origin_error_m": [0.02, 0.0, 0.0]}}, seed=2)
    result = result_of(calibrated(session, laser_fit=EXACT | {"origin_sigma_m": 0.001, "azimuth_sigma_deg": 0.002}))
    assert errors(result, session.truth)[3] == pytest.approx(-0.02, abs=0.004)


@pytest.mark.thorough
def test_a_target_out_of_plumb_within_its_sigma_keeps_the_errors_within_theirs() -> None:
    session = made(OFF, DRIFT, {"surroundings": {"tilt_deg": [0.03, -0.03]}}, seed=2)
    honest = result_of(calibrated(session, laser_fit={"plumb_sigma_deg": 0.03}))
    total, noise = (np.sqrt(np.diag(honest["laser"][key]))[:2] for key in ("covariance_total", "covariance"))
    assert np.all(np.abs(errors(honest, session.truth)[:2]) < 3.5 * total)
    assert np.all(total > np.radians(0.03))
    assert np.all(noise < np.radians(0.02))  # the target's own sigmas are no noise


def test_a_mount_far_off_is_refused() -> None:
    session = made({"laser": {"coarse_angle_deg": 2.0, "coarse_lever_m": 0.0}, "mbes": {"ping_rate_hz": 0.5}}, seed=2)
    result = result_of(calibrated(session, laser_fit=EXACT))
    assert result["verdict"] == "rejected"


SIX = np.diag([1e-6, 1e-6, 1e-6, 4e-6, 4e-6, 4e-6])
ORIGIN = {"file": "a", "sha256": "0" * 64, "date": "2026-05-12", "software": "poolcal"}


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"method": "coarse"}, [1e-6] * 3 + [4e-6] * 3),
        ({"method": "fine", "held": ["x", "y", "z"]}, [np.radians(0.5) ** 2] * 3 + [4e-6] * 3),
        ({"method": "fine", "held": ["x"], "coarse": True}, [9e-6] * 3 + [1e-6] * 3),
        ({"method": "fine", "coarse": False}, [np.radians(0.5) ** 2] * 3 + [0.05**2] * 3),
    ],
    ids=["surveyed", "by an older version", "from a survey", "from the pool's sigmas"],
)
def test_no_data_count_twice_after_a_fine_calibration(more: dict[str, Any], expected: list[float]) -> None:
    """The coarse mount is that of the survey, wherever the adjustment starts."""
    session = made(OFF, DRIFT, seed=2)
    laser = parse(SessionConfig, session.session, "session").laser
    fit = narrow(LaserPrior, parse(PoolConfig, session.pool, "pool").laser_fit)
    mount = laser.mount
    if "coarse" in more:
        mount = mount.model_copy(update={"z_m": 0.7})
        covariance = {"covariance": np.diag(expected).tolist()} if more["coarse"] else {}
        more = more | {"coarse": {"mount": mount.model_dump()} | covariance}
    content = laser.model_dump(mode="json") | {"mount_covariance": SIX.tolist(), "mount_origin": ORIGIN | more}
    mounted, found = coarse_mount(parse(type(laser), content, "laser"), fit)
    assert mounted.settings() == pytest.approx(mount.model_dump())
    assert np.diag(found) == pytest.approx(expected)


def test_a_coarse_mount_that_the_points_contradict_is_refused_and_named() -> None:
    """Wrong by 0.3° and stated with 0.057°; with its true sigma such a session is accepted (above)."""
    session = made(OFF, DRIFT, FAST, seed=2)
    given = {"mount_covariance": SIX.tolist(), "mount_origin": ORIGIN | {"method": "coarse"}}
    found = calibrated(session, given, laser_fit=EXACT)
    result = result_of(found)
    assert result["reason_codes"] == ["coarse_mount_contradicted"]
    rows = found["adjust/freed"].set_index("unknown")
    coarse = mount_of(parse(SessionConfig, session.session, "session").laser.mount)
    wrong = rotation_error(session.truth["laser"]["R_body_from_laser"], coarse.R_body_from_sensor)
    for name, error in zip(("rotation_x", "rotation_y"), wrong, strict=False):
        row = rows.loc[name]
        assert abs(row["value"] - error) < 4 * row["sigma"], name
        assert np.hypot(row["sigma"], 1e-3) <= row["expected"] < 1.1e-3  # with the systematic errors
    (reason,) = result["reasons"]
    first = max(("rotation_x", "rotation_y"), key=lambda name: abs(rows.loc[name, "value"]))
    size = f"turned by {np.degrees(rows.loc[first, 'value']):+.3f} ± "
    assert size in reason, reason


@pytest.mark.thorough
def test_a_good_survey_is_hardly_improved_and_said_to_be_what_the_values_rest_on() -> None:
    slight = {"laser": {"coarse_angle_deg": 0.03, "coarse_lever_m": 0.002}, "mbes": {"ping_rate_hz": 0.5}}
    session = made(slight, DRIFT, seed=2)
    given = {"mount_covariance": SIX.tolist(), "mount_origin": ORIGIN | {"method": "coarse"}}
    result = result_of(calibrated(session, given, laser_fit=EXACT))
    assert result["verdict_in_words"] == "accepted in part: roll, pitch", result["reasons"]
    assert result["rests_on_coarse"] == list(result["held"]) == ["yaw", "x", "y", "z"]
    assert "not clearly better than the coarse mount" in result["geometry"]["advice"]
    sigma = np.sqrt(np.diag(result["laser"]["covariance_total"]))
    assert np.all(sigma[3:] <= 0.002)
    assert np.all(sigma[3:] > 0.0018)
    assert np.all(np.abs(errors(result, session.truth)) < 3.5 * sigma)


def test_what_is_calibrated_is_the_sonar_or_the_laser() -> None:
    """Without a sonar the prior information of ``laser_fit`` counts; limits of the verdict adjust nothing anew."""
    session = made(OFF, seed=2)
    both = parse(SessionConfig, session.session, "session")
    alone = both.model_copy(update={"mbes": None})
    pool = parse(PoolConfig, session.pool | {"verdict": WIDE}, "pool")
    of_sonar, of_laser = (stage_config(adjust.Config, settings_by_name(pool, given)) for given in (both, alone))
    assert (of_sonar.mbes, of_sonar.laser_fit) == (both.mbes, None)
    assert (of_laser.mbes, of_laser.laser_fit) == (None, narrow(LaserPrior, pool.laser_fit))
    usual = parse(PoolConfig, session.pool | {"laser_fit": {"hold_share": 0.9}}, "pool")
    assert stage_config(adjust.Config, settings_by_name(usual, alone)) == of_laser


@pytest.mark.thorough
def test_the_dock_gives_the_lasers_angles_as_well() -> None:
    session = simulate_session(parse(Scenario, merged(read_yaml(SCENARIOS / "dock.yaml"), THIN, OFF), "dock"), 3)
    result = result_of(calibrated(session, laser_fit=EXACT, verdict=WIDE))
    error, sigma = errors(result, session.truth), np.sqrt(np.diag(result["laser"]["covariance_total"]))
    assert result["verdict"] == "accepted", result["reasons"]
    assert np.all(np.abs(error) < 3.5 * sigma)


@pytest.mark.thorough
def test_the_sonars_total_takes_the_lasers_covariance_as_whole_calibrations_do() -> None:
    """It grows by (G v)(G v)ᵀ for a covariance v vᵀ; G v from calibrations with the laser moved by v and by -v.

    v: a turn about body x, y, z (rad) and a shift along them (m), R = Exp(v[:3]) R₀, as mount_covariance has it.
    """
    session = made({"ins": DRIFT["ins"], "laser": {"point_rate_hz": 1500.0}, "mbes": {"ping_rate_hz": 4.0}}, seed=4)
    raw = {"ins": session.ins, "laser": session.laser, "mbes": session.mbes}
    pool = parse(PoolConfig, session.pool, "pool")
    v = np.array([2e-4, 2e-4, -2e-4, 3e-3, -3e-3, 3e-3])
    mounted = mount_of(parse(SessionConfig, session.session, "session").laser.mount)

    def found(side: float, share: float) -> dict[str, Any]:
        R = exp_so3(side * v[:3]) @ mounted.R_body_from_sensor
        moved = Mounted(R, mounted.lever_arm_body_m + side * v[3:]).settings()
        block = (share * np.outer(v, v) + 1e-14 * np.eye(6)).tolist()
        laser = session.session["laser"] | {"mount": moved, "mount_covariance": block}
        given = parse(SessionConfig, session.session | {"laser": laser}, "session")
        content: dict[str, Any] = result_of(calibrate_in_memory(given, pool, raw))["mbes"]
        return content

    share = 1e4  # so much that all else is nothing beside it
    growth = np.array(found(0.0, share)["covariance_total"]) / share
    one, other = found(1.0, 1.0), found(-1.0, 1.0)
    turn = rotation_error(one["R_body_from_mbes"], other["R_body_from_mbes"])
    Gv = np.concatenate([turn, np.subtract(one["lever_arm_m"], other["lever_arm_m"])]) / 2.0
    unit = np.repeat([np.abs(Gv[:3]).max(), np.abs(Gv[3:]).max()], 3)
    np.testing.assert_allclose(growth / np.outer(unit, unit), np.outer(Gv, Gv) / np.outer(unit, unit), atol=0.15)
