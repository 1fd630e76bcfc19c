"""Each reason to reject, and nothing else. What the reasons say is in test_wording.py."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pipeline.adjustment.pattern_tests import passes_test, pattern_tests
from pipeline.config.session import Drift
from pipeline.config.verdict import VerdictLimits
from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.mount_parameters import MOUNT_NAMES, PARAMETERS
from pipeline.report.coarse_mount import share_of_coarse_mount
from pipeline.report.drift_check import check_ins_drift
from pipeline.report.reason_codes import ReasonCode, Statement
from pipeline.report.verdict import rejections
from tests.support.evidence import (
    ADJUSTED,
    FIGURES,
    OFF,
    PASS_3,
    SEARCH,
    SIGMA,
    codes,
    drift,
    evidence,
    freed_table,
    judged,
    methods,
)

IN_TURN = replace(ADJUSTED, method="patent_alternating")
LIMITS = ((0.006, 6e-4), (0.0059, 5.9e-4))  # either side of the largest total sigmas
LEVEL = ADJUSTED.test_level
CLOCK = {"sigma": 3e-4, "expected": 5e-4}


def test_a_good_session_has_no_reason():
    assert judged(evidence()) == []
    assert judged(evidence(), IN_TURN) == []


def test_angles_to_enter_are_told_only_where_nothing_else_is_in_doubt():
    advised = replace(ADJUSTED, search=replace(SEARCH, angles_advice="; enter these angles"))
    for change, advice in (
        ({"mount": {"rotation_z_deg": -4.6}}, True),
        ({"mount": {"rotation_z_deg": -4.6, "lever_arm_z_m": 0.6}}, False),
        ({"mount": {}}, False),
        ({"mount": {"rotation_z_deg": -4.6, "ambiguous": True}}, False),
        ({"mount": {"rotation_z_deg": -4.6}, "pose": {"ambiguous": True}}, False),
        ({"mount": {"rotation_z_deg": -4.6}, "pose": {"within": False}}, False),
    ):
        reasons = judged(evidence(**change | {"mount": change["mount"] | {"within": False}}), advised)
        assert any("; enter these angles" in reason.words for reason in reasons) == advice
        assert ReasonCode.MOUNT_BEYOND_SEARCH in codes(reasons)


def test_where_labels_are_in_doubt_nothing_else_is_judged():
    doubtful = evidence(pose={"ambiguous": True}, summary={"converged": False}, patterns=[PASS_3])
    strict = replace(ADJUSTED, limits=VerdictLimits(max_sigma_deg=1e-6))
    assert codes(judged(doubtful, strict)) == [ReasonCode.AMBIGUOUS_TARGET_POSE]


def test_sigmas_are_held_to_both_limits():
    wide, narrow = (replace(ADJUSTED, limits=VerdictLimits(max_sigma_deg=d, max_sigma_m=m)) for d, m in LIMITS)
    assert judged(evidence(), wide) == []
    reasons = judged(evidence(), narrow)
    assert codes(reasons) == [ReasonCode.SIGMA_ABOVE_LIMIT] * 2
    assert [reason.words.split(" is ")[0] for reason in reasons] == ["total sigma of yaw", "total sigma of lever arm y"]


def test_a_laser_may_be_good_enough_in_part_but_not_in_none():
    narrow = replace(ADJUSTED, limits=VerdictLimits(max_sigma_deg=LIMITS[1][0], max_sigma_m=LIMITS[1][1]))
    assert judged(evidence(), replace(narrow, held=["yaw", "y"])) == []
    everything = [name for name, *_ in PARAMETERS]
    assert judged(evidence(), replace(narrow, held=everything[1:])) == []
    assert codes(judged(evidence(), replace(narrow, held=everything))) == [ReasonCode.NO_PARAMETER_ESTIMABLE]


@pytest.mark.parametrize("value", [-3.30e-3, -3.28e-3, 3.28e-3, 3.30e-3])
def test_a_coarse_mount_is_contradicted_from_the_limit_of_all_tests_on(value):
    """3.29 sigmas of a single test; it is then the reason, and no likely cause of residuals."""
    freed = {"unknown": "rotation_z", "value": value, "sigma": 1e-4, "expected": 1e-3}
    expected = [ReasonCode.COARSE_MOUNT_CONTRADICTED] if abs(value) > 3.29e-3 else []
    assert codes(judged(evidence(freed=freed))) == expected


def test_of_a_contradicted_coarse_mount_the_value_farthest_off_comes_first():
    wrong = [("rotation_z", 0.005), ("lever_arm_y", -0.009), ("rotation_x", 0.0035)]
    row = {"sigma": 5e-4, "expected": 1e-3}
    freed = freed_table(*(row | {"unknown": name, "value": value} for name, value in wrong))
    (reason,) = judged(replace(evidence(), freed=freed))
    assert "moved by -9.0 ± 0.5 mm along body y, 9.0 times" in reason.words
    assert "; beyond the limit of 3.6 as well: yaw; " in reason.words


@pytest.mark.parametrize(
    ("sigma_deg", "coarse_deg", "above", "unimproved"),
    [(0.049, 0.1, False, False), (0.051, 0.103, True, False), (0.049, 0.097, False, True), (0.051, 0.1, True, True)],
)
def test_a_value_is_good_within_its_limit_and_well_below_its_coarse_sigma(sigma_deg, coarse_deg, above, unimproved):
    """Both sides of a limit of 0.05° and of half the coarse sigma, about body z; all others are good."""
    total = dict.fromkeys(MOUNT_NAMES, 1e-6) | {"rotation_z": np.radians(sigma_deg)}
    coarse = dict.fromkeys(MOUNT_NAMES, 1.0) | {"rotation_z": np.radians(coarse_deg)}
    estimate = pd.DataFrame({"unknown": list(total), "sigma_total": list(total.values())})
    freed = pd.DataFrame({"unknown": list(coarse), "considered": list(coarse.values())})
    share = share_of_coarse_mount(SIGMA | {"yaw_deg": sigma_deg}, estimate, freed, VerdictLimits(), 0.5)
    assert (list(share.above_limit), list(share.unimproved)) == (["yaw"] * above, ["yaw"] * unimproved)
    assert share.held == ({"yaw": sigma_deg} if above or unimproved else {})
    assert [words in share.advice for words in ("above the verdict", "than the coarse mount")] == [above, unimproved]
    assert share_of_coarse_mount(None, estimate, freed, VerdictLimits(), 0.5).held == {}


@pytest.mark.parametrize(
    ("alternating", "patent", "code"),
    [
        ({"reason": "the sonar sees no horizontal face"}, {}, ReasonCode.PATENT_NO_RESULT),
        ({"converged": False}, {}, ReasonCode.PATENT_NOT_CONVERGED),
        ({}, {"rotation_vector_deg": [0.8, -0.8, 0.86]}, ReasonCode.PATENT_OFF_ADJUSTMENT),
        ({}, {"lever_arm_m": [0.1, 0.094, 0.1]}, ReasonCode.PATENT_OFF_ADJUSTMENT),
    ],
)
def test_a_patent_form_as_the_result_is_held_to_the_adjustment(alternating, patent, code):
    tables = evidence(alternating=alternating)
    assert rejections(tables, methods(**patent), ADJUSTED) == []
    assert codes(rejections(tables, methods(**patent), IN_TURN)) == [code]


def test_both_sensors_off_together_is_the_ins():
    for laser, expected in ((-0.011, "and the laser -11.0 mm off P2"), (0.011, "sonar lies -12.0 mm off P2")):
        of_laser = PASS_3 | {"sensor": "laser", "mean_m": laser, "normalised": -2.0}
        (reason,) = judged(evidence(patterns=[PASS_3, of_laser]))
        assert reason.code == ReasonCode.PASSES_DISAGREE
        assert expected in reason.words
        assert ("drift of the INS" in reason.words) == (laser < 0)


@pytest.mark.parametrize(
    ("value", "expected"), [(3.28 * 5e-4, []), (3.30 * 5e-4, [ReasonCode.ESTIMATE_OFF_SETTINGS])]
)
def test_what_was_freed_and_is_not_as_the_session_says(value, expected):
    freed = {"unknown": "mbes_latency", "estimated": True, "value": value} | CLOCK
    assert codes(judged(evidence(freed=freed))) == expected


@pytest.mark.parametrize(("limit_deg", "expected"), [(0.0059, True), (0.006, False)])
def test_an_ins_that_drifts_more_than_it_should_is_why_sigmas_are_large(limit_deg, expected):
    check = Statement(ReasonCode.INS_DRIFT_OFF_FIGURES, "the INS drifts otherwise")
    criteria = replace(ADJUSTED, limits=VerdictLimits(max_sigma_deg=limit_deg))
    reasons = rejections(evidence(), methods(), criteria, off_figures=check)
    assert reasons[:1] == ([check] if expected else [])
    assert set(codes(reasons[1:])) == ({ReasonCode.SIGMA_ABOVE_LIMIT} if expected else set())


def test_what_was_freed_where_there_is_no_result():
    nothing = {"unknown": "mbes_latency", "estimated": True, "expected": 4e-4, "value": 0.0, "sigma": np.nan}
    assert judged(evidence(freed=nothing)) == []


@pytest.mark.parametrize(("yaw_deg", "sources"), [(0.0, ("0.3", "0.4")), (90.0, ("0.4", "0.3"))])
def test_a_sigma_above_its_limit_names_its_two_largest_sources(yaw_deg, sources):
    """0.3° of noise about body y; 0.4° about body x by the sonar's ranges. With yaw 90°, roll turns about body x."""
    noise, total = np.zeros((2, 6))
    noise[:3], total[:3] = np.radians([0.001, 0.3, 0.001]), np.radians([0.4, 0.3, 0.001])
    mount = dict.fromkeys(("roll_deg", "pitch_deg", "x_m", "y_m", "z_m"), 0.0) | {"yaw_deg": yaw_deg}
    block = methods()["adjustment"] | {"mount": mount}
    block |= {"covariance": np.diag(noise**2).tolist(), "covariance_total": np.diag(total**2).tolist()}
    tables = evidence(freed={"unknown": "mbes_range", "effect_rotation_x": np.radians(0.4)})
    limits = VerdictLimits(max_sigma_deg=1e-9, max_sigma_m=1.0)
    reasons = rejections(tables, {"adjustment": block}, replace(ADJUSTED, limits=limits))
    ending = {words.split()[3]: words.partition("; ")[2] for words in (reason.words for reason in reasons)}
    pitch, roll = ("the sonar's ranges", "noise") if yaw_deg == 0 else ("noise", "the sonar's ranges")
    assert ending["pitch"] == f"largest sources: {pitch} ({sources[1]}°)"
    assert ending["roll"] == f"largest sources: {roll} ({sources[0]}°)"


def test_of_the_sources_of_a_sigma_two_are_named():
    mount = dict.fromkeys(("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m"), 0.0)
    block = methods()["adjustment"] | {"mount": mount}
    block |= {"covariance": (4e-3**2 * np.eye(6)).tolist(), "covariance_total": (5e-3**2 * np.eye(6)).tolist()}
    tables = evidence(freed={"unknown": "mbes_range", "effect_lever_arm_y": 0.003, "effect_lever_arm_x": 0.009})
    limits = VerdictLimits(max_sigma_deg=1.0, max_sigma_m=LIMITS[1][1])
    (reason,) = rejections(tables, {"adjustment": block}, replace(ADJUSTED, limits=limits))
    assert reason.words.endswith("; largest sources: noise (0.004 m), the sonar's ranges (0.003 m)")


def test_an_ins_that_is_allowed_no_drift_is_named_beside_the_first_cause():
    check = check_ins_drift(drift(1.0), Drift(**dict.fromkeys(FIGURES, 0.0)))
    assert rejections(evidence(), methods(), ADJUSTED, check) == []
    reasons = rejections(evidence(patterns=[OFF], freed={"value": 6e-4}), methods(), ADJUSTED, check)
    no_drift, residuals = ReasonCode.INS_DRIFT_NOT_GIVEN, ReasonCode.RESIDUALS_BY_ANGLE
    assert codes(reasons) == [ReasonCode.SUSPECTED_CAUSE, no_drift, residuals]
    assert codes(judged(evidence(patterns=[PASS_3]))) == [ReasonCode.PASSES_DISAGREE]


def table(*rows):
    return pd.DataFrame([{"by": by, "normalised": normalised} for by, normalised in rows])


def test_all_variables_have_one_limit():
    """Šidák over all three rows, not over those of a variable."""
    limit = joint_limit(3, LEVEL)
    assert limit == pytest.approx(3.588, abs=0.001)
    just, beyond = 0.999 * limit, -1.001 * limit
    angle, face = pattern_tests(table(("angle", just), ("angle", 0.0), ("face", beyond)), LEVEL)
    assert angle == {"by": "angle", "statistic": just, "dof": 2, "limit": limit, "passed": True}
    assert (face["statistic"], face["dof"], face["passed"]) == (-beyond, 1, False)


def test_the_consistency_of_passes_is_of_residuals_and_of_drift():
    agreed = passes_test(table(("pass", 1.0), ("drift", -3.0), ("face", 9.0)), LEVEL)
    assert (agreed["statistic"], agreed["dof"], agreed["passed"]) == (3.0, 2, True)
    assert agreed["limit"] == joint_limit(3, LEVEL)
    assert not passes_test(table(("pass", 1.0), ("drift", -3.7)), LEVEL)["passed"]
    alone = passes_test(table(("face", 9.0)), LEVEL)
    assert (alone["statistic"], alone["dof"], alone["passed"]) == (0.0, 0, True)


def test_the_strongest_part_of_the_points_comes_first():
    """A step of ten millimetres, 202 sigma, shows by angle as well: named once, by what shows it best."""
    step = {"by": "step", "normalised": -15.0, "mean_m": -0.0101, "sigma_mean_m": 5e-5}
    first, second = judged(evidence(patterns=[{"normalised": 6.0}, step, PASS_3 | {"normalised": -5.0}]))
    assert codes([first, second]) == [ReasonCode.RESIDUALS_STEP, ReasonCode.PASSES_DISAGREE]
    assert "steps by -10.1 mm (15.0 sigma beyond 3 mm, limit 3.6)" in first.words
    assert first.words.endswith("; residuals by angle lie beyond it too")


@pytest.mark.parametrize(
    ("family", "mean_m", "low", "tilted"),
    [("P3", 0.013, 20.0, True), ("P3", 0.013, 23.0, True), ("P3", 0.013, 24.0, False), ("P3", -0.013, 20.0, False)],
)
def test_steps_to_both_sides_are_transmit_sectors(family, mean_m, low, tilted):
    step = {"by": "step", "normalised": -15.0, "mean_m": -0.014, "family": "P1"}
    other = step | {"family": family, "mean_m": mean_m, "low": low, "normalised": 9.0}
    (reason,) = judged(evidence(patterns=[step, other]))
    assert reason.code == ReasonCode.RESIDUALS_STEP
    assert ("P1 steps by -14.0 mm, and from P3 by +13.0 mm (15.0" in reason.words) == tilted
    assert ("transmit sectors of different tilt" in reason.words) == tilted


def test_what_only_shows_that_something_is_wrong_comes_after_the_cause():
    cause, residuals = judged(evidence(patterns=[OFF], freed={"value": 6e-4}))
    assert "likely cause of residuals (strength 6)" in cause.words
    assert residuals.code == ReasonCode.RESIDUALS_BY_ANGLE


@pytest.mark.parametrize(("place", "limit"), [(0, np.radians(4.5)), (2, np.radians(4.5)), (3, 0.45), (5, 0.45)])
def test_a_mount_is_far_from_the_coarse_one_beyond_the_search_by_three_sigmas(place, limit):
    sigma = 1e-4  # of the evidence's estimate
    for sign in (-1.0, 1.0):
        for times, expected in ((2.9, []), (3.1, [ReasonCode.MOUNT_FAR_FROM_COARSE])):
            value = np.zeros(6)
            value[place] = sign * (limit + times * sigma)
            assert codes(judged(evidence(value=value.tolist()))) == expected


def test_of_an_adjustment_that_did_not_converge_no_value_is_judged():
    strict = replace(ADJUSTED, limits=VerdictLimits(max_sigma_deg=1e-6))
    diverged = evidence(summary={"converged": False}, patterns=[PASS_3], left_out=[{"why": "doubt"}], rms_m=0.06)
    assert codes(judged(diverged, strict)) == [ReasonCode.FACES_IN_DOUBT, ReasonCode.NOT_CONVERGED]
