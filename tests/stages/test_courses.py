"""Any course past any side: to port, both ways, round a circle, on the spot, between the walls of a lock."""

import json
from typing import Any

import numpy as np
import pytest

from tests.support.docks import of_faces
from tests.support.simulated import QUIET, calibrated, made, without_biases

EXACT_DEG, EXACT_MM = 1e-4, 0.01
MOUNT = {"pitch_deg": 1.2, "yaw_deg": -2.0, "y_m": 0.20, "z_m": -2.01}
WIDE: dict[str, Any] = {  # a head that looks down and hears both sides, a scanner that sees both
    "mbes": {"mount": MOUNT | {"roll_deg": -1.8, "x_m": 0.30}, "sector_deg": 150.0},
    "laser": {"field_deg": [-130.0, 130.0]},
}
PORT: dict[str, Any] = {
    "mbes": {"mount": MOUNT | {"roll_deg": 48.8, "x_m": -0.30}},
    "laser": {"field_deg": [-130.0, -30.0]},
    "track": {"courses": ["back"]},
}
LOCK: dict[str, Any] = of_faces(  # a wall with a niche, and across the boat one that leans back
    {
        "right": {"corners": [[0, 4, -4], [0, -4, -4], [0, -4, 2], [0, 4, 2]]},
        "niche": {"corners": [[1.5, 5.5, -4], [0, 4, -4], [0, 4, 2], [1.5, 5.5, 2]]},
        "left": {"corners": [[-9, -4, -4], [-9, 4, -4], [-12, 4, 2], [-12, -4, 2]]},
    },
    azimuth_deg=163.0,
) | {"track": {"distances_m": [4.0, 5.0, 6.0, 7.0], "half_length_m": 6.0, "courses": ["along", "back"]}}
COURSES: dict[str, tuple[dict[str, Any], ...]] = {
    "to port": (PORT,),
    "both ways": (WIDE, {"track": {"courses": ["along", "back"]}}),
    "circle": (WIDE, {"track": {"courses": ["circle"], "circle_radius_m": 1.5, "distances_m": [4.0, 7.0]}}),
    "on the spot": (
        WIDE,
        {"track": {"courses": ["circle"], "circle_radius_m": 0.2, "speed_m_s": 0.03, "distances_m": [4.0, 7.0]}},
    ),
    "in a lock": (WIDE, LOCK),
}


@pytest.mark.parametrize("course", COURSES)
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
