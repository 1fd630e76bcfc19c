"""The rows of the drift's test by pass: which way the boat went counts for roll and pitch."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.adjustment.residual_statistics import _drift_rows
from pipeline.gps_time import NS
from pipeline.maths.adjustment.pose_errors import DriftEstimate, Knots, PoseNoise
from pipeline.maths.geometry.rotations import rotation_from_attitude

SECONDS = np.concatenate([start + np.arange(0.0, 2.0, 0.2) for start in (0.0, 80.0)])
PASSES = pd.DataFrame({"start_ns": [0, 80 * NS], "end_ns": [2 * NS, 82 * NS]})
NOISE = PoseNoise(np.zeros(6), np.array([0.015, 0.015, 0.02, 1e-4, 1e-4, 5e-4]), 200.0)


def sigmas(*azimuths_deg: float) -> dict[str, float]:
    """Sigma of each turn in the first of two passes less that in the second, over that of the drift."""
    heading = np.radians(np.repeat(azimuths_deg, len(SECONDS) // 2))
    R = rotation_from_attitude(np.radians(np.full(len(SECONDS), 8.0)), np.zeros(len(SECONDS)), heading)
    knots = Knots(np.arange(len(SECONDS)), SECONDS, np.ones(len(SECONDS) - 1, dtype=bool))
    trajectory = SimpleNamespace(t_ns=(SECONDS * NS).astype(np.int64), R_frame_from_body=R)
    problem: Any = SimpleNamespace(
        model=SimpleNamespace(body=SimpleNamespace(trajectory=trajectory)), prior=SimpleNamespace(noise=NOISE)
    )
    adjustment: Any = SimpleNamespace(drift=DriftEstimate(knots, np.ones((len(SECONDS), 6))))
    rows = _drift_rows(problem, adjustment, PASSES)
    assert [row["count"] for row in rows] == [10] * 6
    of_drift = dict(zip(("turn_x", "turn_y", "turn_z"), NOISE.drift[3:], strict=True))
    return {str(row["family"]): float(row["sigma_mean_m"]) / of_drift[str(row["family"])] for row in rows[:3]}


def test_on_the_opposite_course_roll_and_pitch_may_differ_more() -> None:
    """Two errors of the correlation ρ differ by the variance 2 (1 - ρ), or by 2 (1 + ρ) if one is turned round."""
    one_way, both_ways = sigmas(20.0, 20.0), sigmas(20.0, 200.0)
    rho = np.exp(-80 / 200)
    alike, apart = np.sqrt(2 * (1 - rho)), np.sqrt(2 * (1 + rho))
    assert one_way == pytest.approx({"turn_x": alike, "turn_y": alike, "turn_z": alike}, rel=0.01)
    assert both_ways == pytest.approx({"turn_x": apart, "turn_y": apart, "turn_z": alike}, rel=0.01)
