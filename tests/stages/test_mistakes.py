"""The kinds of mistakes that campaigns plant, and what a rejected session is taken to name first."""

import copy
from typing import Any

import pandas as pd
import pytest

from pipeline.config.yaml_models import parse
from pipeline.maths.adjustment.parameters import LASER_PARAMETERS, MBES_PARAMETERS, WET_PARAMETERS
from pipeline.report.reason_codes import ReasonCode
from pipeline.simulation.face_faults import face_of_polygon
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.scenario import Scenario
from tools.campaigns import THIN
from tools.mistake_kinds import EFFECTS, MISTAKES
from tools.mistakes import named_first

WET = {f"wet_{family}_{name}" for family in ("P1", "P2", "P3", "H") for name in WET_PARAMETERS}
PARAMETERS = {*MBES_PARAMETERS, *LASER_PARAMETERS, *WET}


def scenario_of(name: str) -> dict[str, Any]:
    scenario: dict[str, Any] = {"name": "mistake", **copy.deepcopy(THIN)}
    MISTAKES[name].change(scenario, {}, {})
    return scenario


def test_every_kind_is_a_scenario_of_its_own() -> None:
    """Those that change the scenario differ from the good session and from each other; sizes grow threefold."""
    good = parse(Scenario, scenario_of("nothing wrong, INS drifts"), "good")
    for effect in EFFECTS:
        small, large = (parse(Scenario, scenario_of(name), name) for name in effect.kinds())
        assert len({good.model_dump_json(), small.model_dump_json(), large.model_dump_json()}) == 3
        assert small.ins.drift_declared in (None, good.ins.drift)  # session.yaml has the good session's figures
        assert small.ins.drift == good.ins.drift or small.ins.drift_declared == good.ins.drift
    for name in MISTAKES:
        parse(Scenario, scenario_of(name), name)


def test_names_that_would_be_right_are_names_of_the_program() -> None:
    default = Scenario()
    polygons = build_mesh(default.target, default.surroundings).names
    faces = {face_of_polygon(default.target, polygon) for polygon in polygons} - {""}
    for name, kind in MISTAKES.items():
        for right in kind.right:
            assert right in set(ReasonCode) | faces | PARAMETERS, (name, right)


def artefacts(*causes: tuple[str, float]) -> dict[str, Any]:
    """Tests of fixed parameters, each of a sigma of 1, and two means of faces."""
    freed = pd.DataFrame(causes, columns=["unknown", "value"]).assign(sigma=1.0, expected=1.1, estimated=False)
    patterns = pd.DataFrame({"by": ["face", "face", "pass"], "low": [0.0, 1.0, 2.0], "normalised": [5.0, -6.0, 9.0]})
    return {"adjust/freed": freed, "adjust/patterns": patterns, "segment/faces": pd.DataFrame({"name": ["P2", "P1-0"]})}


@pytest.mark.parametrize(
    ("codes", "causes", "expected"),
    [
        (["suspected_cause"], [("mbes_range", 5.0), ("wet_P1-1_shift", -7.0), ("sound_speed", 3.0)], "P1-1"),
        (["residuals_by_angle", "suspected_cause"], [("mbes_range", 5.0)], "mbes_range"),
        (["residuals_by_face", "suspected_cause"], [("mbes_range", 50.0)], "P1-0"),
        (["passes_disagree", "suspected_cause"], [("mbes_range", 50.0)], "passes_disagree"),
        (["sigma_above_limit"], [], "sigma_above_limit"),
    ],
)
def test_what_is_named_first(codes: list[str], causes: list[tuple[str, float]], expected: str) -> None:
    named = named_first(codes, artefacts(*causes))
    assert expected in named
    assert "P2" not in named
    assert ("mbes_range" in named) == (expected == "mbes_range")
