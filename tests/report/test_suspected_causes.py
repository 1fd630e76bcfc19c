"""Suspected causes: from which limit on there are any, and which parameter or set of parameters is named first."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from pipeline.adjustment.parameter_strengths import SETS
from pipeline.config.session import Drift
from pipeline.language.chosen import translated
from pipeline.report.cause_words import WORDS_OF_SETS
from pipeline.report.drift_check import check_ins_drift
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.verdict import explanations, rejections
from tests.support.evidence import ADJUSTED, PASS_3, codes, drift, evidence, freed_table, judged, methods
from tests.support.left_english import english_of

ONE = {"sigma": 1e-4, "expected": 1e-4}


def test_both_sides_of_the_limit_of_one_parameter():
    """Noise and all a-priori sigmas count together; a normal deviate exceeds 3.29 with the chance 0.001."""
    near, far = ({"value": value, "sigma": 3e-4, "expected": 5e-4} for value in (3.28 * 5e-4, 3.30 * 5e-4))
    assert judged(evidence(freed=near)) == []
    assert codes(judged(evidence(freed=far))) == [ReasonCode.SUSPECTED_CAUSE]


def test_the_limit_is_for_all_parameters_together():
    """Of 87 parameters one exceeds 4.39 with the chance 0.001 = 1 - (1 - p)^87; those not determined do not count."""
    limit = norm.isf((1 - 0.999 ** (1 / 87)) / 2)
    others = [{"unknown": f"face_{k}", "value": 0.0, "sigma": 1e-4, "expected": 1e-4} for k in range(86)]
    others += [{"unknown": "face_unseen", "value": np.nan, "sigma": np.nan, "expected": np.nan}]
    for share, expected in ((0.99, []), (1.01, [ReasonCode.SUSPECTED_CAUSE])):
        one = {"unknown": "face_P1-3", "value": share * limit * 1e-4, "sigma": 1e-4, "expected": 1e-4}
        reasons = judged(replace(evidence(), freed=freed_table(one, *others)))
        assert codes(reasons) == expected
        assert all("face P1-3 stands out by +0.4 ± 0.1 mm" in reason.words for reason in reasons)


def test_of_several_causes_the_most_telling_is_named():
    sigmas = (("mbes_range", 1e-3), ("laser_range", 1e-4))
    sonar, laser = ({"unknown": name, "expected": sigma, "sigma": sigma} for name, sigma in sigmas)
    freed = freed_table(sonar | {"value": 0.01}, laser | {"value": 0.002})
    (reason,) = judged(replace(evidence(), freed=freed))
    assert reason.code == ReasonCode.SUSPECTED_CAUSE
    assert "strength 20): the laser's ranges: they should be +2.0 ± 0.1 mm longer; other causes" in reason.words
    assert reason.words.endswith("would explain it less well: 1")


@pytest.mark.parametrize(("value", "is_named"), [(0.00181, True), (0.00179, False)])
def test_a_cause_within_two_sigmas_of_the_first_is_named_beside_it(value, is_named):
    names = (("mbes_range", 0.002), ("laser_range", value), ("mbes_level_range", 0.001))
    one = {"expected": 1e-4, "sigma": 1e-4}
    freed = freed_table(*(one | {"unknown": name, "value": value} for name, value in names))
    (reason,) = judged(replace(evidence(), freed=freed))
    words = reason.words
    assert "(strength 20): the sonar's ranges: they should be +2.0 ± 0.1 mm longer" in words
    nearly = "longer; nearly as well (strength 18): the laser's ranges: they should be +1.8 ± 0.1 mm"
    assert (nearly in words) == is_named
    assert words.endswith(f"; other causes that would explain it less well: {1 if is_named else 2}")


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("further", [{}, {"by_session": 30.0}])
def test_a_cause_is_in_chinese_whatever_stands_behind_it(monkeypatch, number, further):
    one = {"expected": 1e-4, "sigma": 1e-4} | further
    values = (("mbes_latency", 0.002), ("laser_range", 0.0019), ("mbes_level_range", 0.001))
    freed = freed_table(*(one | {"unknown": name, "value": value} for name, value in values[:number]))
    (reason,) = judged(replace(evidence(), freed=freed))
    assert ("larger drift" in reason.words) == bool(further)
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    words = translated(reason.words)
    assert not list(english_of([words])), words
    assert words.startswith("残差的可能原因（强度 ")
    assert "）：声呐时钟：" in words
    assert words.endswith("；解释程度较差的其他原因：1 个") == (number == 3 and not further)


def test_a_known_error_is_as_strong_as_its_prior_information_lets_it_be():
    """4 mm of a bow known to 1 mm, 20 sigmas of noise, explain less than 0.5 mm of a face, which is fixed."""
    bow = {"unknown": "wet_P2_bow", "value": 0.004, "sigma": 2e-4, "expected": 1.02e-3, "strength": 3.92}
    bow |= {"considered": 1e-3}
    face = {"unknown": "face_P1-0", "value": 5e-4, "sigma": 1e-4, "expected": 1e-4}
    (reason,) = judged(replace(evidence(), freed=freed_table(bow, face)))
    assert "(strength 5): the target: face P1-0 stands out by +0.5 ± 0.1 mm" in reason.words
    assert "nearly as well (strength 4): the target: its wet faces of the wall are bowed outward" in reason.words


@pytest.mark.parametrize(("share", "is_named"), [(0.99, False), (1.01, True)])
def test_a_face_that_is_off_by_no_more_than_its_sigma_allows_is_no_cause(share, is_named):
    """A face known to 0.5 mm: what it may be off explains more than a bow that is contradicted."""
    bow = {"unknown": "wet_P2_bow", "value": 0.007, "sigma": 2e-4, "expected": 1e-3, "considered": 1e-3}
    bow |= {"strength": 6.7}
    shift_m = share * norm.isf((1 - 0.999**0.5) / 2) * np.hypot(1e-4, 0.5e-3)
    face = {"unknown": "face_P1-0", "value": shift_m, "sigma": 1e-4, "considered": 0.5e-3}
    (reason,) = judged(replace(evidence(), freed=freed_table(bow, face | {"expected": 6e-4})))
    assert ("face P1-0 stands out" in reason.words) == is_named
    assert ("(strength 7): the target: its wet faces of the wall are bowed" in reason.words) != is_named


def test_of_a_set_those_that_explain_little_are_not_named():
    one = {"expected": 1e-4, "sigma": 1e-4}
    bows = (("wet_P1_bow", 8e-4), ("wet_P2_bow", 7e-4), ("wet_P3_bow", 1e-5))
    freed = freed_table(*(one | {"unknown": name, "value": value} for name, value in bows))
    every = {"parameters": " ".join(name for name, _ in bows), "strength": 11.0}
    (reason,) = judged(replace(evidence(sets=[every]), freed=freed))
    assert "are bowed (P1 and P2 most); survey them" in reason.words


def test_a_parameter_that_only_the_session_s_drift_determines_is_no_cause():
    unseen = {"unknown": "mbes_range", "value": np.nan, "sigma": np.nan, "expected": np.nan, "by_session": 50.0}
    (reason,) = judged(replace(evidence(), freed=freed_table({"unknown": "laser_range", "value": 1e-3} | ONE, unseen)))
    assert "(strength 10): the laser's ranges" in reason.words


def test_what_made_the_drift_less_likely_is_named_itself():
    """With the larger drift a latency is 3.3 sigmas; with the session's own it explains most."""
    latency = {"unknown": "mbes_latency", "value": 3.3e-4, "by_session": 30.0} | ONE
    face = {"unknown": "face_P1-0", "value": 5e-4, "by_session": 8.0} | ONE
    (reason,) = judged(replace(evidence(), freed=freed_table(latency, face)))
    assert "(strength 30; a larger drift of the INS would explain less): the sonar's clock" in reason.words


def test_a_contradicted_parameter_is_a_cause_where_errors_that_correlate_make_it_better_known():
    """Its value is beyond the limit of what all errors together explain, not of its own."""
    row = {"unknown": "laser_range", "value": 3e-3, "sigma": 2e-4, "considered": 1e-3, "expected": 4e-4}
    (reason,) = judged(replace(evidence(), freed=freed_table(row)))
    assert reason.code == ReasonCode.SUSPECTED_CAUSE


@pytest.mark.parametrize(("strength", "is_named"), [(6.1, True), (5.9, False)])
def test_a_set_stands_in_place_of_its_parameters_where_it_is_stronger_than_each(strength, is_named):
    """Two bows of 6 and 5.5 sigmas."""
    one = {"expected": 1e-4, "sigma": 1e-4}
    bows = (("wet_P1_bow", 5.5e-4), ("wet_P2_bow", 6e-4))
    freed = freed_table(*(one | {"unknown": name, "value": value} for name, value in bows))
    both = {"parameters": "wet_P1_bow wet_P2_bow", "strength": strength}
    tables = replace(evidence(sets=[both]), freed=freed)
    (reason,) = judged(tables)
    set_words = "wet faces of more than one family are bowed (P2 and P1)"
    words = set_words if is_named else "its wet faces of the wall are bowed outward, by +0.6 ± 0.1 mm"
    assert reason.words.startswith(f"likely cause of residuals (strength 6): the target: {words}")
    assert (set_words in reason.words) == is_named
    found = [(one.kind, one.name) for one in explanations(tables, ADJUSTED)]
    single = [("parameter", "wet_P2_bow"), ("parameter", "wet_P1_bow")]
    assert found == ([("set", "wet_bows"), *single] if is_named else single)


@pytest.mark.parametrize(("strength", "is_named"), [(7.99, True), (8.01, False)])
def test_of_the_parameters_of_a_set_those_that_explain_nearly_as_well_are_named_too(strength, is_named):
    one = {"unknown": "wet_P2_bow", "value": 6e-4, "expected": 1e-4, "sigma": 1e-4}
    both = {"parameters": "wet_P1_bow wet_P2_bow", "strength": strength}
    (reason,) = judged(replace(evidence(sets=[both]), freed=freed_table(one)))
    assert ("nearly as well (strength 6): the target: its wet faces of the wall are bowed" in reason.words) == is_named


def test_every_set_has_words():
    assert set(WORDS_OF_SETS) == set(SETS)


def test_a_set_alone_is_no_reason():
    """Where no parameter is contradicted nothing needs an explanation."""
    assert judged(evidence(sets=[{"strength": 50.0}])) == []


@pytest.mark.parametrize(("by_session", "blames_drift"), [(np.nan, True), (13.0, False)])
def test_what_explains_more_than_any_drift_is_not_laid_to_the_drift(by_session, blames_drift):
    """A drift between passes of nine sigmas; a sound speed of six, and of 13 without more drift than is stated."""
    drifting = PASS_3 | {"by": "drift", "sensor": "ins", "family": "turn_z", "mean_m": -0.002, "normalised": 9.0}
    check = check_ins_drift(drift(2.0), Drift())
    tables = evidence(patterns=[drifting], freed={"value": 6e-4, "by_session": by_session})
    reasons = rejections(tables, methods(), ADJUSTED, check)
    cause, between = ReasonCode.SUSPECTED_CAUSE, ReasonCode.INS_DRIFT_BETWEEN_PASSES
    above = ReasonCode.INS_DRIFT_ABOVE_SETTINGS
    assert codes(reasons) == ([between, above, cause] if blames_drift else [cause, between])
    assert explanations(tables, ADJUSTED)[0].kind == ("drift" if blames_drift else "parameter")
    words = {reason.code: reason.words for reason in reasons}[cause]
    assert ("(strength 13; a larger drift of the INS would explain less): the sound speed" in words) != blames_drift
