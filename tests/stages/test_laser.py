"""The laser's own calibration through its stages: results, fixed parameters, refusals."""

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

OFF = {"laser": {"coarse_angle_deg": 0.3, "coarse_lever_m": 0.03}, "mbes": {"ping_rate_hz": 0.5}}
DRIFT = {
    "ins": {
        "drift": {
            "horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03,
            "time_constant_s": 200.0,
        }
    }
}
EXACT = {"face_sigma_deg": 0.001, "plumb_sigma_deg": 0.001, "face_sigma_m": 0.0002}
WIDE = {"max_sigma_deg": 1.0, "max_sigma_m": 0.1}


def calibrated(session: SimulatedSession, more: dict[str, Any] | None = None, **pool: Any) -> dict[str, Any]:
    """Every artefact; ``more``: of session.yaml's laser."""
    settings = {name: value for name, value in session.session.items() if name != "mbes"}
    settings["laser"] = settings["laser"] | (more or {})
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


def test_what_cannot_be_given_is_held_at_its_coarse_value_and_named() -> None:
    session = made(OFF, DRIFT, seed=2)
    found = calibrated(session, laser_fit=EXACT)
    result = result_of(found)
    assert result["verdict"] == "accepted", result["reasons"]
    assert list(result["held"]) == ["yaw", "x", "y", "z"]
    assert 0.05 < result["held"]["yaw"] < 0.2
    assert all(0.005 < result["held"][name] < 0.05 for name in "xyz")
    assert "yaw (±" in result["geometry"]["advice"]
    coarse, total = session.session["laser"]["mount"], result["laser"]["mount"]
    for key in ("x_m", "y_m", "z_m"):
        assert total[key] == pytest.approx(coarse[key], abs=1e-12)
    sigma = np.sqrt(np.diag(result["laser"]["covariance_total"]))
    assert sigma[2] == pytest.approx(np.radians(0.5))
    assert sigma[3:] == pytest.approx([0.05] * 3)
    covariance = np.array(result["laser"]["covariance"])
    assert not covariance[2:].any()
    error = errors(result, session.truth)
    assert np.all(np.abs(error[:2]) < 3.5 * sigma[:2])


def test_a_surveyed_target_and_a_steady_ins_give_all_six() -> None:
    session = made(OFF, seed=2)
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


def test_a_target_out_of_plumb_within_its_sigma_keeps_the_errors_within_theirs() -> None:
    session = made(OFF, DRIFT, {"surroundings": {"tilt_deg": [0.03, -0.03]}}, seed=2)
    honest = result_of(calibrated(session, laser_fit={"plumb_sigma_deg": 0.03}))
    assert np.all(np.abs(errors(honest, session.truth)[:2]) < 3.5 * np.sqrt(np.diag(honest["laser"]["covariance"]))[:2])


def test_a_mount_far_off_is_refused() -> None:
    session = made({"laser": {"coarse_angle_deg": 2.0, "coarse_lever_m": 0.0}, "mbes": {"ping_rate_hz": 0.5}}, seed=2)
    result = result_of(calibrated(session, laser_fit=EXACT))
    assert result["verdict"] == "rejected"


def test_what_a_fine_calibration_held_keeps_its_surveyed_sigma() -> None:
    session = made(OFF, DRIFT, seed=2)
    six = np.diag([1e-6, 1e-6, 1e-6, 4e-6, 4e-6, 4e-6]).tolist()
    origin = {"file": "a", "sha256": "0" * 64, "date": "2026-05-12", "software": "poolcal"}
    laser = parse(SessionConfig, session.session, "session").laser
    fit = parse(PoolConfig, session.pool, "pool").laser_fit
    for more, expected in (
        ({"method": "coarse"}, [1e-6] * 3 + [4e-6] * 3),
        ({"method": "fine", "held": ["x", "y", "z"]}, [np.radians(0.5) ** 2] * 3 + [4e-6] * 3),
    ):
        content = laser.model_dump(mode="json") | {"mount_covariance": six, "mount_origin": origin | more}
        told = parse(type(laser), content, "laser")
        assert np.diag(coarse_covariance(told, fit)) == pytest.approx(expected)
    result = result_of(calibrated(session, {"mount_covariance": six, "mount_origin": origin | {"method": "coarse"}}))
    assert {"x", "y", "z"} <= set(result["held"])
    assert np.sqrt(np.diag(result["laser"]["covariance_total"]))[3:] == pytest.approx([0.002] * 3)


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


def test_the_dock_gives_the_lasers_angles_as_well() -> None:
    session = simulate_session(parse(Scenario, merged(read_yaml(SCENARIOS / "dock.yaml"), THIN, OFF), "dock"), 3)
    result = result_of(calibrated(session, laser_fit=EXACT, verdict=WIDE))
    error, sigma = errors(result, session.truth), np.sqrt(np.diag(result["laser"]["covariance_total"]))
    assert result["verdict"] == "accepted", result["reasons"]
    assert np.all(np.abs(error) < 3.5 * sigma)


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
