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
    """calibration.json with the data counting, and with the session's figures taken as exact; and the errors."""
    session = without_biases(made({"ins": {"drift": TRUE}, "mbes": WHITE["mbes"]}, seed=5))  # they would hide much
    found, known = [], None
    for more in ({}, {"drift_within": EXACT}):
        ins = session.session["ins"] | {"drift": STATED} | more
        artefacts = calibrated(replace(session, session=session.session | {"ins": ins}), known=known)
        known = through("segment", artefacts)  # labels need no figures of the drift but the session's
        result = json.loads(artefacts["report/calibration.json"])
        block = result["methods"]["adjustment"]
        error = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), session.truth)
        found.append((result, error, np.array(block["covariance"])))
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
    (_, error, covariance), (_, _, believed) = judged
    assert error @ np.linalg.solve(covariance, error) < chi2.ppf(0.999, 6)
    assert covariance[5, 5] > 1.25**2 * believed[5, 5]  # z; figures that are right change it by a tenth at most
    assert np.all(np.linalg.eigvalsh(covariance - 0.9 * believed) > 0)


def test_exact_figures_are_believed(judged):
    estimated = judged[1][0]["ins_drift_estimated"]
    assert {name: estimated[name] for name in STATED} == pytest.approx(STATED)
    assert set(estimated["sigma_log"].values()) == set(estimated["deviation"].values()) == {0}
    assert "ins_drift_off_figures" not in judged[1][0]["warning_codes"]
