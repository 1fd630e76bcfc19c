"""What would explain the residuals: parameters and parts of the points in one list, the strongest first."""

import pytest

from pipeline.report.hypotheses import Hypothesis
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.suspected_causes import suspected_causes
from pipeline.report.verdict import explanations
from tests.support.evidence import ADJUSTED, OFF, PASS_3, evidence, judged


@pytest.mark.parametrize(("mean_m", "is_first"), [(0.00061, True), (0.00059, False)])
def test_the_stronger_of_a_parameter_and_a_part_of_the_points_is_named_first(mean_m, is_first):
    """Both are values over sigmas of noise: 6 sigma of the parameter, against 6.1 or 5.9 of the step."""
    tables = evidence(patterns=[OFF | {"by": "step", "mean_m": mean_m}], freed={"value": 6e-4})
    reasons = {reason.code: reason.words for reason in judged(tables)}
    in_order = [ReasonCode.RESIDUALS_STEP, ReasonCode.SUSPECTED_CAUSE]
    assert list(reasons) == (in_order if is_first else in_order[::-1])
    unless = "unless the face, step, height, pass or ping named above is itself the cause (strength 6)"
    assert (unless in reasons[ReasonCode.SUSPECTED_CAUSE]) == is_first
    step = Hypothesis("step", "20", pytest.approx(1e4 * mean_m), "a step of the fan at 20°")
    words = suspected_causes(tables.freed, tables.sets, ADJUSTED.test_level)[0].words
    parameter = Hypothesis("parameter", "sound_speed", pytest.approx(6.0), words)
    assert explanations(tables, ADJUSTED) == ([step, parameter] if is_first else [parameter, step])


def test_the_strongest_part_of_the_points_is_described_and_every_variable_is_a_hypothesis():
    """A face 6 sigma off, which a step beside it exceeds by more, but with a larger sigma."""
    step = OFF | {"by": "step", "mean_m": 0.0006, "sigma_mean_m": 1.5e-4, "normalised": 9.0}
    face = OFF | {"by": "face", "low": 0.0, "mean_m": 0.0006, "sigma_mean_m": 1e-4, "normalised": 5.0}
    tables = evidence(patterns=[step, face, OFF | {"normalised": 4.0}])
    (reason,) = judged(tables)
    assert reason.code == ReasonCode.RESIDUALS_BY_FACE
    assert reason.words.endswith("; residuals by step and angle lie beyond it too")
    name = tables.faces["name"].iloc[0]
    found = [(one.kind, one.name, one.words) for one in explanations(tables, ADJUSTED)]
    assert found == [("face", name, f"face {name}"), ("step", "20", "a step of the fan at 20°")]


def test_a_pass_is_as_strong_as_the_mounts_change_without_it():
    """What changes in one pass may show in the mount more than in any mean."""
    tables = evidence(patterns=[PASS_3], parts={"part": "without pass 3", "normalised": 150.0})
    assert explanations(tables, ADJUSTED)[0] == Hypothesis("pass", "3", 150.0, "pass 3")
    for other in ({"part": "without pass 3", "normalised": 2.0}, {"part": "without pass 2", "normalised": 150.0}):
        tables = evidence(patterns=[PASS_3], parts=other)
        assert explanations(tables, ADJUSTED)[0] == Hypothesis("pass", "3", pytest.approx(120.0), "pass 3")


def test_where_the_labels_are_in_doubt_nothing_is_explained():
    assert explanations(evidence(pose={"ambiguous": True}, patterns=[PASS_3]), ADJUSTED) == []
    assert explanations(evidence(summary={"reason": "too few"}, patterns=[PASS_3]), ADJUSTED) == []


def test_the_first_reason_and_the_first_explanation_are_of_one_thing():
    """A pass and the drift in it, and a face: what is described first is what stands first in the list."""
    face = OFF | {"by": "face", "low": 0.0, "mean_m": 0.002, "sigma_mean_m": 1e-4, "normalised": 9.0}
    drift = PASS_3 | {"by": "drift", "sensor": "ins", "family": "turn_z", "mean_m": -0.002, "normalised": 4.5}
    for patterns, code, kind in (
        ([PASS_3, face], ReasonCode.PASSES_DISAGREE, "pass"),
        ([PASS_3, drift], ReasonCode.INS_DRIFT_BETWEEN_PASSES, "drift"),
    ):
        tables = evidence(patterns=patterns)
        assert (judged(tables)[0].code, explanations(tables, ADJUSTED)[0].kind) == (code, kind)
