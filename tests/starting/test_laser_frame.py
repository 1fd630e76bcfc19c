"""The frame of laser points: the scanner's own, a CRS that the INS confirms, or a question."""

from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS, Transformer

from pipeline.checking.file_survey import SurveyedFile
from pipeline.readers.file_kind import LAS
from pipeline.starting import laser_frame
from pipeline.starting.boat_track import BoatTrack
from pipeline.starting.file_groups import FileGroup
from pipeline.starting.laser_frame import FrameProposal, propose_frame

PLACE = (120.1, 36.0, 12.0)  # longitude, latitude, height
ECEF_M = np.array(Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True).transform(*PLACE))
TRACK = BoatTrack(36.0, 120.1, 12.0, ECEF_M, None, 0.0, 0.0)


def _proposed(
    point: tuple[float, ...], declared: str, monkeypatch: pytest.MonkeyPatch, track: BoatTrack | None = TRACK
) -> FrameProposal:
    columns = {axis: np.array([value, value + 1.0]) for axis, value in zip(("x_m", "y_m", "z_m"), point, strict=True)}
    file = SurveyedFile("laser", "a.las", 1, records=2, columns=columns)
    wkt = CRS.from_user_input(declared).to_wkt() if declared else ""
    monkeypatch.setattr(laser_frame, "crs_of_las", lambda *_: wkt)
    return propose_frame(FileGroup("laser", LAS, (file,), ("a.las",)), Path(), track)


def _in(crs: str) -> tuple[float, ...]:
    return tuple(Transformer.from_crs("EPSG:4979", crs, always_xy=True).transform(*PLACE))


def test_points_near_their_origin_are_the_scanners(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _proposed((3.0, -40.0, 2.0), "", monkeypatch).frame == "laser"
    assert _proposed((3.0, -40.0, 2.0), "", monkeypatch, None).frame == "laser"


def test_earth_centred_points_at_the_boat(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _proposed(tuple(ECEF_M), "", monkeypatch).frame == "EPSG:4978"
    assert _proposed(tuple(ECEF_M + 2000.0), "", monkeypatch).frame == "FILL_IN"
    assert _proposed(tuple(ECEF_M), "", monkeypatch, None).frame == "FILL_IN"


@pytest.mark.parametrize(("crs", "heights"), [("EPSG:32651", "FILL_IN"), ("EPSG:4549", "FILL_IN"), ("EPSG:4978", None)])
def test_a_declared_crs_that_the_ins_confirms(crs: str, heights: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    point = _in(crs)
    found = _proposed((*point, 12.0)[:3], crs, monkeypatch)
    assert (found.frame, found.heights) == (crs, heights)


def test_a_declared_crs_that_the_ins_denies(monkeypatch: pytest.MonkeyPatch) -> None:
    east, north, up = _in("EPSG:32651")
    for point, crs in (((east + 2000.0, north, up), "EPSG:32651"), ((east, north, up), "EPSG:32650")):
        assert _proposed(point, crs, monkeypatch).frame == "FILL_IN"
    assert _proposed((3.0, -40.0, 2.0), "EPSG:32651", monkeypatch).frame == "FILL_IN"


def test_a_crs_that_cannot_be_used_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _proposed((600000.0, 200000.0, 400.0), "EPSG:2056", monkeypatch)
    assert found.frame == "FILL_IN"
    assert "ellipsoid Bessel" in found.why
