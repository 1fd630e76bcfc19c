"""What is said of walls that nobody has surveyed: what is left out, what is in doubt, what is rough."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.artefacts.catalogue.results import GROUPS
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.wall_checks import faces_in_doubt, faces_left_out, left_out_block, rough_walls
from tests.support.evidence import codes, evidence, judged, left_out_table

STEP: dict[str, Any] = {"why": "step", "unknown": "", "value": 0.0571, "sigma": np.nan}


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({}, "the soundings on north are left out (900), for the other faces contradict them: likely north stands "
         "there 94 ± 9 mm farther toward the boat than above"),
        ({"value": -0.03}, "likely north stands there 30 ± 9 mm farther back than above"),
        ({"unknown": "wet_north_turn_1", "value": 0.02, "sigma": 0.002}, "is turned there by +1.1 ± 0.1° against"),
        ({"unknown": "wet_north_bow", "value": -0.02}, "north is bowed there by -20 ± 9 mm at half depth"),
        ({"why": "few", "points": 4}, "the soundings on north are left out, for they are too few to trust (4)"),
        ({"why": "scatter"}, "the soundings on north are left out (900): they lie all over the gate"),
        (STEP | {"high_m": -3.24}, "the soundings on north from 3.2 m below the water down are left out (900): there "
         "the wall stands off its plane by +57 mm"),
        (STEP | {"low_m": -0.55}, "on north down to 0.6 m below the water are"),
        (STEP | {"low_m": -2.0, "high_m": -1.5}, "on north from 1.5 to 2.0 m below the water are"),
        (STEP | {"sensor": "laser", "high_m": 0.35}, "the laser points on north up to 0.3 m above the water are"),
        (STEP, "the soundings on north at all heights are"),
        (STEP | {"why": "mixed", "area_m2": 1.625, "share": 0.124, "low_m": -2.0, "high_m": -1.5}, "the soundings on "
         "1.6 m² of north, from 1.5 to 2.0 m below the water, are left out (900, 12 % of those on it): pass after"),
        (STEP | {"low_m": -0.6, "high_m": 0.05}, "on north from 0.0 to 0.6 m below the water are"),
        (STEP | {"sensor": "laser", "low_m": 1.2}, "the laser points on north from 1.2 m above the water up are"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_what_is_left_out_is_named_with_its_place(row: dict[str, Any], words: str) -> None:
    table = left_out_table(row)
    (statement,) = faces_left_out(table)
    assert statement.code == ReasonCode.FACE_LEFT_OUT
    assert words in statement.words
    (entry,) = left_out_block(table)["left_out"]
    assert entry["words"] == statement.words
    assert (entry["low_m"], entry["high_m"]) == (row.get("low_m"), row.get("high_m"))
    assert not faces_in_doubt(table)
    assert codes(judged(evidence(left_out=[row]))) == []


def test_faces_in_doubt_reject_and_are_not_left_out() -> None:
    rows = [{"why": "doubt"}, {"why": "doubt", "family": "wall", "unknown": "wet_wall_shift", "value": -0.07}]
    (reason,) = judged(evidence(left_out=rows))
    assert reason.code == ReasonCode.FACES_IN_DOUBT
    assert "It may be this: north stands there 94 ± 9 mm farther toward the boat than above; or wall" in reason.words
    assert "; or wall stands there 70 ± 9 mm farther back than above. But" in reason.words
    assert left_out_block(left_out_table(*rows)) == {}
    assert faces_left_out(left_out_table(*rows)) == []


@pytest.mark.parametrize(("patch_m", "said"), [(0.0009, False), (0.0011, True), (np.nan, False)])
def test_a_wall_is_rough_from_a_millimetre_on(patch_m: float, said: bool) -> None:
    row = dict.fromkeys(column.name for column in GROUPS.columns) | {"sensor": "mbes", "family": "P2"}
    groups = pd.DataFrame([row | {"patch_m": patch_m}, row | {"sensor": "laser", "patch_m": 0.0}])
    found = list(rough_walls(groups))
    assert [one.code for one in found] == [ReasonCode.ROUGH_WALL] * said
    if said:
        assert found[0].words.startswith("below the water, patches of the walls stand off their planes (P2 by 1 mm)")


def test_a_further_head_names_itself() -> None:
    row = dict.fromkeys(column.name for column in GROUPS.columns) | {"sensor": "mbes_2", "family": "P2"}
    of_laser = row | {"sensor": "laser", "patch_m": 0.0}
    (found,) = rough_walls(pd.DataFrame([row | {"patch_m": 0.004}, of_laser]))
    assert found.words.startswith("mbes_2: below the water, patches of the walls")


def test_a_bottom_is_no_rough_wall() -> None:
    row = dict.fromkeys(column.name for column in GROUPS.columns) | {"patch_m": 0.004}
    seen = [("mbes", "wall-1"), ("mbes", "bottom-1"), ("laser", "wall-1")]
    found = rough_walls(pd.DataFrame([row | {"sensor": sensor, "family": family} for sensor, family in seen]))
    assert ["bottom" in one.words for one in found] == [False, False]
