"""Any course past any side: to port, both ways, round a circle, on the spot, between the walls of a lock."""

import json
from typing import Any

import numpy as np
import pytest

from tests.support.docks import BOTH_SIDES, LOCK, MOUNT
from tests.support.effort import often
from tests.support.simulated import QUIET, calibrated, made, without_biases

EXACT_DEG, EXACT_MM = 1e-4, 0.01
PORT: dict[str, Any] = {
    "mbes": {"mount": MOUNT | {"roll_deg": 48.8, "x_m": -0.30}},
    "laser": {"field_deg": [-130.0, -30.0]},
    "track": {"courses": ["back"]},
}
COURSES: dict[str, tuple[dict[str, Any], ...]] = {
    "to port": (PORT,),
    "both ways": (BOTH_SIDES, {"track": {"courses": ["along", "back"]}}),
    "circle": (BOTH_SIDES, {"track": {"courses": ["circle"], "circle_radius_m": 1.5, "distances_m": [4.0, 7.0]}}),
    "on the spot": (
        BOTH_SIDES,
        {"track": {"courses": ["circle"], "circle_radius_m": 0.2, "speed_m_s": 0.03, "distances_m": [4.0, 7.0]}},
    ),
    "in a lock": (BOTH_SIDES, LOCK),
}


@pytest.mark.parametrize("course", often(["to port", "both ways", "circle"], COURSES))
def test_without_noise_the_truth_comes_back(course: str, errors_of: Any) -> None:
    session = without_biases(made(QUIET, *COURSES[course], seed=5))
    found = calibrated(session)
    result = json.loads(found["report/calibration.json"])
    assert result["verdict"] == "accepted", result["reasons"]
    error = np.abs(errors_of(result["methods"]["adjustment"], session.truth))
    assert error[:3].max() < EXACT_DEG
    assert error[3:].max() < EXACT_MM
    if course == "in a lock":
        seen = found["adjust/cells"].groupby(["sensor", "family"])["count"].sum()
        assert {family for sensor, family in seen.index if sensor == "mbes"} == {"right", "niche", "left"}
