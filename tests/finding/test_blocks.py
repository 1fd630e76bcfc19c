"""The patent's target, whose sides are blocks with gaps between them, found in the laser's points."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.found import Found, Gaps, with_found
from pipeline.finding.found_text import table_text
from pipeline.finding.place import FoundPlace
from pipeline.finding.pool_file import pool_yaml
from tests.support.found_places import found
from tests.support.simulated import made


@pytest.fixture(scope="module")
def place() -> FoundPlace:
    """To 3.8 m below the water, where no gap ends."""
    return found(made({"track": {"distances_m": [4.0, 8.0, 5.0, 7.0]}, "laser": {"point_rate_hz": 20_000.0}}), 3.8)


def sides(place: FoundPlace) -> dict[str, np.ndarray]:
    """The gaps of both sides, above the true water: P1 looks to the south west, P3 to the north west."""
    found = {}
    for face in place.faces:
        slanted = min((1, 3), key=lambda eighth: abs(np.dot(face.plane.normal[:2], _toward(eighth)) - 1))
        if np.dot(face.plane.normal[:2], _toward(slanted)) > 0.99:
            found["P1" if slanted == 3 else "P3"] = np.concatenate([face.below_m, face.gaps_m]) + place.height_m - 12.0
    return found


def _toward(eighth: int) -> np.ndarray:
    angle = 2 * np.pi * (0.75 + (0.125 if eighth == 1 else -0.125))
    return np.array([np.sin(angle), np.cos(angle)])


@pytest.mark.parametrize("side", ["P1", "P3"])
def test_gaps_are_those_between_the_blocks_and_go_on_below_the_water(place: FoundPlace, side: str) -> None:
    """A gap of half a metre over each block of half a metre. Below the water nobody has seen them: each is higher."""
    gaps = sides(place)[side]
    first = 0.5 if side == "P1" else 0.0
    np.testing.assert_allclose(gaps.mean(axis=1) % 1.0, (first + 0.25) % 1.0, atol=0.04)
    np.testing.assert_allclose(np.diff(gaps.mean(axis=1)), 1.0, atol=0.03)
    assert gaps[0, 0] < -2.9
    assert gaps[-1, 1] > 2.4
    seen = gaps[gaps[:, 0] > 0.2]
    np.testing.assert_allclose(np.diff(seen, axis=1), 0.5, atol=0.08)
    assert np.all(np.diff(gaps[gaps[:, 0] < -0.6], axis=1) > 0.46)


def test_the_water_is_found_at_the_lower_end_of_a_wall_of_four_metres(place: FoundPlace) -> None:
    """The origin is at the water. A fiftieth of the points would be 8 cm of it."""
    assert place.height_m == pytest.approx(12.0, abs=0.04)


def test_the_wall_between_them_has_none(place: FoundPlace) -> None:
    assert sum(1 for face in place.faces if len(face.gaps_m)) == 2


def test_they_are_said_and_become_masks_beside_those_of_the_config(place: FoundPlace) -> None:
    assert table_text(place).count("m above the water, which repeat") == 2
    (name, *_) = [face.name for face in place.faces if len(face.gaps_m)]
    own = {"along_m": [0.0, 0.3], "height_m": [1.0, 1.2]}

    def find(_: Found) -> dict[str, Any]:
        content: dict[str, Any] = yaml.safe_load(pool_yaml(place))
        return content

    content = with_found({"target": {"kind": "found", "masks": {name: [own]}}}, Path("pool.yaml"), find)
    masks = content["target"]["faces"][name]["masks"]
    assert masks[-1] == own
    assert len(masks) > 5
    assert all(set(one) == {"height_m"} for one in masks[:-1])


@pytest.mark.parametrize(("gaps", "number"), [("repeated", 7), ("seen", 3), ("none", 0)])
def test_which_become_masks_can_be_said(place: FoundPlace, gaps: Gaps, number: int) -> None:
    faces = yaml.safe_load(pool_yaml(place, gaps))["target"]["faces"]
    (side,) = [face for face in place.faces if face.plane.normal[0] < 0 and face.plane.normal[1] < -0.5]
    assert len(faces[side.name].get("masks", [])) == number
