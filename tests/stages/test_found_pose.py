"""The pose of a found target whose edges, inside the true ones, drew the search far along what its faces leave open."""

import copy

import numpy as np
import pytest

from pipeline.maths.target.registration import SearchResult
from pipeline.target import pose_search
from tests.support.docks import DOCK
from tests.support.simulated import calibrated, made


@pytest.mark.parametrize("drawn_m", [(0.0, 0.0, 2.4), (0.0, 3.0, -2.4)])
def test_it_comes_back_from_where_no_point_is_on_a_face(
    drawn_m: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wall of 2 m above the water, lifted by more: all points would be below the water."""
    session = made(copy.deepcopy(DOCK), {"track": {"distances_m": [4.0, 6.0]}}, seed=31)
    wall = {"wall": DOCK["target"]["faces"]["wall"]}
    found = SearchResult(np.array([0.0, *drawn_m]), 0.9, 0.0, within=False)
    monkeypatch.setattr(pose_search, "_best_start", lambda *_: found)
    made_by = calibrated(session, "segment", pool={"target": {"faces": wall, "found": True}})
    pose = made_by["segment/target_pose"].iloc[0]
    away = [pose[f"origin_{axis}_pool_m"] for axis in "xyz"]
    assert np.abs(away).max() < 0.01
