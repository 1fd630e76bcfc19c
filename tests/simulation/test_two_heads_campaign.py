"""The campaign of two heads sees a cross-covariance that is not true, and none where it is."""

import json
import re

import numpy as np
import pandas as pd

from tools.two_heads import report

ROOT = np.random.default_rng(1).normal(size=(12, 12))
TRUE = ROOT @ ROOT.T / 12 + 0.2 * np.eye(12)


def told(*stated: np.ndarray, sessions: int = 2000) -> str:
    """What is said of sessions with true errors, and one covariance after the other."""
    errors = np.random.default_rng(2).multivariate_normal(np.zeros(12), TRUE, size=sessions)
    rows = {"accepted": True, "errors": [json.dumps(e.tolist()) for e in errors]}
    covariances = [json.dumps(stated[k % len(stated)].tolist()) for k in range(sessions)]
    return report("kind", pd.DataFrame(rows | {"covariance": covariances}))


def share(text: str) -> tuple[float, float]:
    found = re.search(r"share found (-?[0-9.]+) ± ([0-9.]+)", text)
    assert found is not None
    return float(found[1]), float(found[2])


def test_a_true_covariance_passes() -> None:
    text = told(TRUE)
    assert "OUTSIDE" not in text
    value, sigma = share(text)
    assert abs(value - 1) < 3.5 * sigma < 0.2


def test_a_cross_covariance_of_the_wrong_sign_is_seen_though_each_head_is_right() -> None:
    wrong = TRUE.copy()
    wrong[:6, 6:] *= -0.2
    wrong[6:, :6] *= -0.2
    text = told(wrong)
    assert re.search(r"NSE of first head .* inside", text)
    assert re.search(r"NSE of second head .* inside", text)
    assert re.search(r"NSE of their difference .* OUTSIDE", text)
    value, sigma = share(text)
    assert value + 3.5 * sigma < 0


def test_a_cross_covariance_that_scatters_about_the_true_one_is_true() -> None:
    """Sessions that state half of it, and others one and a half times as much: by each session's own it were 0.8."""
    more, less = TRUE.copy(), TRUE.copy()
    for scattered, factor in ((more, 1.5), (less, 0.5)):
        scattered[:6, 6:] *= factor
        scattered[6:, :6] *= factor
    text = told(more, less)
    value, sigma = share(text)
    assert abs(value - 1) < 3.5 * sigma < 0.2
    assert "of their squares 0.80 alike in all sessions" in text
