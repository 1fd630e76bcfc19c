"""The kinds of mistakes that campaigns plant, and what a rejected session is taken to name first."""

import copy
from typing import Any

import pytest

from pipeline.adjustment.parameter_strengths import SETS
from pipeline.config.yaml_models import parse
from pipeline.maths.adjustment.parameters import LASER_PARAMETERS, MBES_PARAMETERS, WET_PARAMETERS
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.sigma_sources import NOISE
from pipeline.simulation.face_faults import face_of_polygon
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.scenario import Scenario
from tools.mistake_effects import EFFECTS, MISTAKES, REFUSED
from tools.mistakes import BASE, named_first

WET = {f"wet_{family}_{name}" for family in ("P1", "P2", "P3", "H") for name in WET_PARAMETERS}
PARAMETERS = {*MBES_PARAMETERS, *LASER_PARAMETERS, *WET}


def scenario_of(name: str) -> dict[str, Any]:
    scenario: dict[str, Any] = {"name": "mistake", **copy.deepcopy(BASE)}
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


def test_a_near_field_that_nobody_declared_is_planted_as_one() -> None:
    session = {"mbes": {"focused": [False, False]}}
    MISTAKES["sonar: near field, aperture 0.19 m, not declared"].change({}, session, {})
    assert session["mbes"]["focused"] == [True, True]


def test_names_that_would_be_right_are_names_of_the_program() -> None:
    default = Scenario()
    polygons = build_mesh(default.target, default.surroundings).names
    faces = {face_of_polygon(default.target, polygon) for polygon in polygons} - {""}
    for name, kind in MISTAKES.items():
        for right in kind.right:
            assert right in set(ReasonCode) | faces | PARAMETERS | set(SETS) | {REFUSED, NOISE}, (name, right)


@pytest.mark.parametrize(
    ("codes", "explanations", "expected"),
    [
        (["suspected_cause"], [("parameter", "face_P1-1"), ("parameter", "sound_speed")], {"P1-1"}),
        (["suspected_cause"], [("parameter", "mbes_range")], {"mbes_range"}),
        (["residuals_by_face", "suspected_cause"], [("face", "P1-0"), ("parameter", "mbes_range")], {"P1-0"}),
        (["passes_disagree", "suspected_cause"], [("pass", "1"), ("parameter", "mbes_range")], {"passes_disagree"}),
        (["sigma_above_limit"], [], {"sigma_above_limit"}),
        (["too_few_soundings", "suspected_cause"], [("parameter", "mbes_range")], {"too_few_soundings"}),
        (["residuals_by_angle"], [], {"residuals_by_angle"}),
        (["not_converged", "suspected_cause"], [("parameter", "mbes_range")], {"mbes_range"}),
        (["suspected_cause"], [("set", "wet_bows")], {"wet_bows"}),
    ],
)
def test_what_is_named_first(codes: list[str], explanations: list[tuple[str, str]], expected: set[str]) -> None:
    hypotheses = [{"kind": kind, "name": name} for kind, name in explanations]
    result = {"reason_codes": codes, "reasons": codes, "hypotheses": hypotheses}
    named = named_first(result)
    assert expected <= named
    assert "sound_speed" not in named
    assert ("mbes_range" in named) == (expected == {"mbes_range"})


@pytest.mark.parametrize(("source", "is_named"), [("noise", True), ("the sonar's ranges", False)])
def test_noise_is_named_where_it_is_the_largest_source_of_a_sigma(source: str, is_named: bool) -> None:
    words = f"sigma of yaw is 0.06°, above 0.05°; largest sources: {source} (0.05°), noise (0.03°)"
    result = {"reason_codes": ["not_converged", "sigma_above_limit"], "reasons": ["", words], "hypotheses": []}
    assert ("noise" in named_first(result)) == is_named
