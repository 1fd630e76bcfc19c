"""An INS that errs twenty times as fast as its session says: the adjustment finds it, and its sigmas count with it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.simulated import calibrated, made, through, without_biases
from tools.campaigns import DRIFT, WHITE
from tools.session_rows import errors_of

STATED = DRIFT["drift"]
TRUE = {"horizontal_m": 0.01, "vertical_m": 0.015, "roll_pitch_deg": 0.005, "heading_deg": 0.01, "time_constant_s": 10}
EXACT = {"sigmas": 1.0, "time_constant": 1.0}


@pytest.fixture(scope="module")
def judged():
    """calibration.json, the errors, the covariance and table freed: with the data counting, and with exact figures."""
    session = without_biases(made({"ins": {"drift": TRUE}, "mbes": WHITE["mbes"]}, seed=5))  # they would hide much
    found, known = [], None
    for more in ({}, {"drift_within": EXACT}):
        ins = session.session["ins"] | {"drift": STATED} | more
        artefacts = calibrated(replace(session, session=session.session | {"ins": ins}), known=known)
        known = through("segment", artefacts)  # labels need no figures of the drift but the session's
        result = json.loads(artefacts["report/calibration.json"])
        block = result["methods"]["adjustment"]
        error = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), session.truth)
        found.append((result, error, np.array(block["covariance"]), artefacts["adjust/freed"]))
    return found


def test_the_time_constant_is_found_and_said(judged):
    result = judged[0][0]
    estimated = result["ins_drift_estimated"]
    expected = np.log(TRUE["time_constant_s"])
    sigma = estimated["sigma_log"]["time_constant_s"]
    assert abs(np.log(estimated["time_constant_s"]) - expected) < 3 * sigma
    assert 0.05 < sigma < 0.6
    assert "ins_drift_off_figures" in result["warning_codes"]
    assert result["ins_drift"] | STATED == result["ins_drift"]  # the session's own stay beside them


def test_the_sigmas_count_with_it(judged):
    (_, error, covariance, _), (_, _, believed, _) = judged
    assert error @ np.linalg.solve(covariance, error) < chi2.ppf(0.999, 6)
    assert covariance[5, 5] > 1.25**2 * believed[5, 5]  # z; figures that are right change it by a tenth at most
    assert np.all(np.linalg.eigvalsh(covariance - 0.9 * believed) > 0)


def test_exact_figures_are_believed(judged):
    estimated = judged[1][0]["ins_drift_estimated"]
    assert {name: estimated[name] for name in STATED} == pytest.approx(STATED)
    assert set(estimated["sigma_log"].values()) == set(estimated["deviation"].values()) == {0}
    assert "ins_drift_off_figures" not in judged[1][0]["warning_codes"]


@pytest.mark.thorough
def test_drift_is_not_blamed_for_a_wrong_sound_speed():
    """Fans steered with a speed 0.1 % above the water's look turned from pass to pass, as by an INS that drifts."""
    speeds = {"sound_speed_recorded_m_s": 1501.5, "head_speed_excess": 0.001}
    found = calibrated(made({"ins": DRIFT, "mbes": speeds}, seed=1))
    document, freed = json.loads(found["report/calibration.json"]), found["adjust/freed"].set_index("unknown")
    assert document["hypotheses"][0]["name"] == "sound_speed"
    of_speed = freed.loc["sound_speed"]
    assert of_speed["by_session"] > 1.3 * abs(of_speed["value"] / of_speed["sigma"])
    assert of_speed["value"] == pytest.approx(-0.001, abs=3 * of_speed["sigma"])
    assert "; a larger drift of the INS would explain less): the sound speed" in document["reasons"][0]
    assert "ins_drift_above_settings" not in document["reason_codes"]


def test_an_ins_that_does_drift_remains_the_explanation(judged):
    for _, _, _, freed in judged:
        assert freed["by_session"].isna().all()
