"""Sessions of a head whose transmit sectors are tilted differently, as a Kongsberg EM2042's are: the mount of the
receiving array comes back where the tilts are carried, and where they are hidden the session is rejected."""

import json

import numpy as np
import pytest

from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.planning import assessment
from pipeline.planning.plan_document import plan_document
from tests.support.effort import often
from tests.support.simulated import QUIET, THIN, calibrated, made

OUTER_DEG, CENTRE_DEG = -0.447, -0.701  # 0.254° apart
COARSE = {"mbes": {"coarse_angle_deg": 0.1}}  # so near that the plan, which knows no other mount, can be compared
SETTINGS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")


def symmetrical(border_deg):
    """Three sectors about the array's normal."""
    edges = ((-border_deg, OUTER_DEG), (border_deg, CENTRE_DEG), (90.0, OUTER_DEG))
    return {"mbes": {"format": "parquet", "sectors": [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges]}}


def by_ping(*tilts_deg):
    return {"mbes": {"format": "parquet", "ping_tilts_deg": list(tilts_deg)}}


def result_of(session, **more):
    return json.loads(calibrated(session, **more)["report/calibration.json"])


@pytest.fixture(scope="module")
def session():
    """The border lies in the middle of the target; noise as by default."""
    return made(symmetrical(40.0), COARSE, seed=6)


@pytest.fixture(scope="module")
def carried(session):
    return result_of(session)


def as_its_sigmas_say(result, session, errors_of):
    block = result["methods"]["adjustment"]
    error = errors_of(block, session.truth) * np.array([np.pi / 180] * 3 + [1e-3] * 3)
    return error @ np.linalg.solve(np.array(block["covariance"]), error) < 22.5  # 99.9 % of six degrees of freedom


def test_with_the_tilts_carried_the_result_is_right(session, carried, errors_of):
    assert carried["verdict"] == "accepted", carried["reasons"]
    assert as_its_sigmas_say(carried, session, errors_of)
    found, truth = carried["mbes"]["mount"], session.truth["mbes"]["mount"]
    for name in SETTINGS[:3]:
        assert found[name] == pytest.approx(truth[name], abs=0.03), name  # the array's, nothing taken off for the tilt


@pytest.mark.thorough
@pytest.mark.parametrize("scenario", [symmetrical(15.0), symmetrical(30.0), symmetrical(48.0), by_ping(0.0, 0.3)])
def test_wherever_the_border_lies_and_from_ping_to_ping(scenario, errors_of):
    made_so = made(scenario, seed=22)
    result = result_of(made_so)
    assert result["verdict"] == "accepted", result["reasons"]
    assert as_its_sigmas_say(result, made_so, errors_of)


def test_without_noise_the_truth_comes_back_whatever_the_tilts(errors_of):
    """They differ by 18° between sectors, and from ping to ping; and the head works with a wrong speed, which turns the
    tilts as well."""
    edges = ((-20.0, 8.0), (10.0, -0.75), (90.0, -10.0))
    tilted = by_ping(0.0, 0.4, -1.0)["mbes"] | {"sectors": [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges]}
    speed = {"sound_speed_true_m_s": 1500.0, "sound_speed_recorded_m_s": 1485.0, "give_true_sound_speed": True}
    quiet = made(QUIET, {"mbes": tilted}, {"mbes": speed}, seed=8)
    result = result_of(quiet)
    assert result["verdict"] == "accepted", result["reasons"]
    error = np.abs(errors_of(result["methods"]["adjustment"], quiet.truth))
    assert error[:3].max() < 3e-4  # as tests/stages/test_recovery.py
    assert error[3:].max() < 0.05


@pytest.mark.parametrize("key", often(["sigma_mount"], ["sigma_mount", "sigma_mount_total"]))
def test_a_plan_with_the_sectors_predicts_the_sigmas(key, session, carried):
    figures = {"ping_rate_hz": THIN["mbes"]["ping_rate_hz"], "sectors": symmetrical(40.0)["mbes"]["sectors"]}
    content = {"laser": THIN["laser"], "mbes": figures, "passes": [{"distance_m": d} for d in (4.0, 8.0, 5.0, 7.0)]}
    pool, settings = parse(PoolConfig, session.pool, "pool"), parse(SessionConfig, session.session, "session")
    found = plan_document(assessment.assess_plan(parse(Plan, content, "plan"), pool, settings))["given"][key]
    ratio = [found[name] / carried["methods"]["adjustment"][key][name] for name in SETTINGS]
    assert max(abs(np.log(ratio))) < np.log(1.15), dict(zip(SETTINGS, ratio, strict=True))


def without_tilts(session):
    """What a file says that has no place for them."""
    return {"mbes": session.mbes | {"transmit_tilt_rad": np.zeros_like(session.mbes["transmit_tilt_rad"])}}


def test_with_the_tilts_hidden_it_is_rejected_and_the_step_is_named(session, errors_of):
    hidden = result_of(session, raw=without_tilts(session))
    assert not as_its_sigmas_say(hidden, session, errors_of)
    assert hidden["verdict"] == "rejected"
    assert "at a receive angle of 40° the sonar's distance from P" in hidden["reasons"][0]
    assert "likely transmit sectors of different tilt" in hidden["reasons"][0]


@pytest.mark.thorough
@pytest.mark.parametrize("border_deg", [15.0, 30.0, 48.0])
def test_wherever_the_border_lies_the_step_is_named(border_deg):
    session = made(symmetrical(border_deg), seed=22)
    hidden = result_of(session, raw=without_tilts(session))
    assert hidden["verdict"] == "rejected"
    assert f"at a receive angle of {border_deg:.0f}° the sonar's distance from P" in hidden["reasons"][0]


@pytest.mark.thorough
@pytest.mark.parametrize("tilts_deg", [(0.0, 0.3), (0.0, 0.1, 0.3)])
def test_hidden_tilts_from_ping_to_ping_are_named(tilts_deg):
    """They shift whole pings, one forward and the next astern: more than the INS's white noise does."""
    session = made(by_ping(*tilts_deg), seed=22)
    hidden = result_of(session, raw=without_tilts(session))
    assert any("whole pings scatter" in words for words in hidden["warnings"])
    assert hidden["verdict"] == "rejected"
    assert hidden["reasons"][0].startswith(f"residuals go with pings: in one ping of {len(tilts_deg)} (")


@pytest.mark.thorough
def test_one_tilt_hidden_in_all_sectors_shows_nowhere():
    """README says so: it is taken for a yaw of the head, which is rolled by -48.8°."""
    session = made({"mbes": {"format": "parquet", "sectors": [{"to_deg": 90.0, "tilt_deg": -0.75}]}}, seed=22)
    hidden = result_of(session, raw=without_tilts(session))
    assert hidden["verdict"] == "accepted"
    yaw_deg = hidden["mbes"]["mount"]["yaw_deg"] - session.truth["mbes"]["mount"]["yaw_deg"]
    assert yaw_deg == pytest.approx(-0.72, abs=0.05)
