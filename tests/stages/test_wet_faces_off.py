"""Wet faces that stand off the dry ones: no drift of the INS makes up for them where labels are made."""

import copy
from typing import Any

import numpy as np
import pytest

from pipeline.adjustment.problem import designed_planes
from pipeline.adjustment.provisional import corrected_context
from pipeline.adjustment.weighted_iteration import WeightedIteration
from pipeline.maths.adjustment.pseudo_observations import displacement
from pipeline.target.labelled_points import LabellingContext
from tests.support.docks import DOCK
from tests.support.effort import often
from tests.support.simulated import calibrated, made

WET_FAULTS = [  # each wall leans, and is turned, its own way below the water
    {"faces": ["wall"], "part": "wet", "shift_m": 0.02, "turn_deg": [0.1, 0.0]},
    {"faces": ["south"], "part": "wet", "shift_m": -0.026, "turn_deg": [0.25, -0.12]},
    {"faces": ["north"], "part": "wet", "shift_m": -0.012, "turn_deg": [-0.25, 0.1]},
]
TRACK = {"track": {"distances_m": [4.0, 7.0, 5.0], "half_length_m": 6.0}, "laser": {"point_rate_hz": 8000.0}}
DRIFT = {
    "horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03, "time_constant_s": 200.0,
}  # fmt: skip


@pytest.mark.parametrize("found", often([True], [False, True]))
def test_the_target_does_not_turn_to_make_wet_faces_fit(found: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The provisional adjustment leaves it where the laser sees it: within 0.1°, and 2 cm."""
    moved: list[np.ndarray] = []

    def recorded(context: LabellingContext, adjustment: WeightedIteration) -> LabellingContext:
        surfaces = adjustment.last.linearisation.state.surfaces
        moved.append(displacement(surfaces, designed_planes(context.model)))
        return corrected_context(context, adjustment)

    monkeypatch.setattr("pipeline.adjustment.provisional.corrected_context", recorded)
    blocks: list[dict[str, Any]] = [copy.deepcopy(DOCK), TRACK, {"ins": {"rate_hz": 100.0, "drift": DRIFT}}]
    blocks[0]["surroundings"]["face_faults"] = WET_FAULTS
    pool = {"target": {"found": found}, "as_built": {"offset_sigma_m": 0.02, "angle_sigma_deg": 0.1}}
    calibrated(made(*blocks, seed=11), "segment", pool=pool)
    assert len(moved) >= 2
    for displaced in moved:
        assert np.degrees(abs(displaced[5])) < 0.1
        assert np.abs(displaced[:2]).max() < 0.02
