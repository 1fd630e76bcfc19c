"""Targets by their faces, through all stages: other shapes calibrate, and the patent's is one of them."""

import functools
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.artefacts.streams import Stream
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.report.reason_codes import ReasonCode
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from tests.support.effort import often
from tests.support.places import errors, sigmas
from tests.support.roots import SCENARIOS
from tests.support.simulated import THIN, calibrated, made, merged
from tests.support.targets import as_faces


def same(one: Any, other: Any) -> bool:
    if isinstance(one, Stream):
        return all(
            all(np.array_equal(a[name], b[name], equal_nan=a[name].dtype.kind == "f") for name in a)
            for a, b in zip(one.batches(), other.batches(), strict=True)
        )
    if isinstance(one, pd.DataFrame):
        pd.testing.assert_frame_equal(one, other, check_exact=True)
        return True
    return bool(one == other)


@pytest.mark.thorough
def test_the_patents_target_by_its_faces_gives_what_its_letters_give() -> None:
    session = made({"target": {"a": 6.0, "b": 2.4, "c": 0.8, "e": 0.4, "low_side": "north", "azimuth_deg": 47.0,
                               "origin": {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}}}, seed=4)
    by_letters = calibrated(session)
    faces = json.loads(json.dumps(as_faces(session.pool["target"])))
    by_faces = calibrated(replace(session, pool={"target": faces}))
    assert by_letters.keys() == by_faces.keys()
    for name, value in by_letters.items():
        assert same(value, by_faces[name]), name


@functools.lru_cache(maxsize=1)
def of_scenario(name: str) -> tuple[SimulatedSession, dict[str, Any]]:
    """A session of a scenario, and every artefact of it. Nobody changes them."""
    content = merged(read_yaml(SCENARIOS / f"{name}.yaml"), THIN)
    session = simulate_session(parse(Scenario, content, name), 3)
    return session, calibrated(session)


@pytest.mark.parametrize(
    ("name", "front", "codes"),
    [*often([], [("caisson", "left", [ReasonCode.SIGMA_ABOVE_LIMIT] * 2)]), ("dock", "fronts", [])],
)
def test_other_targets_calibrate(name: str, front: str, codes: list[str]) -> None:
    """The caisson's height is as good as ranges on one level face, its distance as all ranges: 6 mm, and it says so."""
    session, found = of_scenario(name)
    result = json.loads(found["report/calibration.json"])
    assert result["reason_codes"] == codes, result["reasons"]
    assert [reason.partition(" is ")[0] for reason in result["reasons"]] == [
        f"total sigma of lever arm {axis}" for axis in ("x", "z")[: len(codes)]
    ]
    assert np.all(np.abs(errors(result["mbes"], session.truth)) < 4 * sigmas(result["mbes"]))
    assert front in found["adjust/surfaces"]["family"].tolist()
    for method in ("patent_sequential", "patent_alternating", "patent_literal"):
        assert "roles P1, P2, P3" in result["methods"][method]["no_result"]
        assert result["methods"][method]["mount"] is None
    assert "roles P1, P2, P3" in found["angle_iterate/angles"]["reason"].iloc[0]


def test_a_wet_foot_is_parallel_to_its_wall_and_seen_by_the_sonar_alone() -> None:
    _, found = of_scenario("caisson")
    surfaces = found["adjust/surfaces"].set_index("family")
    normals = surfaces[[f"normal_{axis}_target_1" for axis in "xyz"]]
    for wall, foot in (("left", "toe-left"), ("right", "toe-right")):
        turned = np.degrees(np.linalg.norm(np.cross(normals.loc[wall], normals.loc[foot])))
        assert turned < 0.03  # as_built.angle_sigma_deg is 0.005
        assert surfaces.loc[foot, "laser_points"] == 0
        assert surfaces.loc[foot, "soundings"] > 300
    assert surfaces.loc["toe-left", "distance_m"] == pytest.approx(0.85 * np.sqrt(0.5), abs=0.01)
    labelled = next(found["segment/soundings_labelled"].batches())
    names = found["segment/faces"]["name"].to_numpy()[labelled["face"].astype(int)]
    assert "cope" not in names
