"""Both sides of the limits of the labels' checks."""

import numpy as np
import pandas as pd
import pytest

from pipeline.report.label_checks import LARGEST_SHARE_OF_GATE, MAX_LABEL_CHANGE, noise_cut_by_gate, unsettled_labels
from pipeline.report.reason_codes import ReasonCode


def cut_normal(gate_in_sigmas: float) -> float:
    """RMS of normal noise that a gate has cut off, as a share of the gate."""
    noise = np.random.default_rng(3).normal(size=400_000)
    return float(np.sqrt(np.mean(noise[np.abs(noise) < gate_in_sigmas] ** 2)) / gate_in_sigmas)


@pytest.mark.parametrize(("gate_in_sigmas", "cut"), [(5.0, False), (2.6, False), (2.2, True), (0.3, True)])
def test_noise_that_the_gate_cuts_off_is_a_reason(gate_in_sigmas: float, cut: bool) -> None:
    rms_m = 0.06 * cut_normal(gate_in_sigmas)
    rows = [("laser", "P1", 1000, 0.005), ("mbes", "P1", 400, rms_m), ("mbes", "P1", 100, rms_m)]
    cells = pd.DataFrame(rows, columns=["sensor", "family", "count", "rms_m"])
    found = noise_cut_by_gate(cells, {"laser": 0.05, "mbes": 0.06})
    assert [statement.code for statement in found] == [ReasonCode.NOISE_CUT_BY_GATE] * cut
    assert all("on P1 scatter" in statement.words and "soundings" in statement.words for statement in found)


def test_each_sensor_has_its_own_gate() -> None:
    cells = pd.DataFrame(
        [("laser", "H", 50, 0.05 * (LARGEST_SHARE_OF_GATE + 0.01)), ("mbes", "H", 50, 0.03)],
        columns=["sensor", "family", "count", "rms_m"],
    )
    (found,) = noise_cut_by_gate(cells, {"laser": 0.05, "mbes": 0.1})
    assert found.words.startswith("laser points on H scatter")


@pytest.mark.parametrize(
    ("label_change", "words"),
    [
        (float("nan"), "no sample of the points could be adjusted: they are labelled with the INS's drift"),
        (1.01 * MAX_LABEL_CHANGE, "still changed 1.0 % of the labels"),
        (0.99 * MAX_LABEL_CHANGE, None),
        (0.0, None),
    ],
)
def test_labels_that_have_not_settled_warn(label_change: float, words: str | None) -> None:
    found = unsettled_labels(label_change)
    assert [statement.code for statement in found] == ([] if words is None else [ReasonCode.LABELS_UNSETTLED])
    assert all(words is not None and words in statement.words for statement in found)
