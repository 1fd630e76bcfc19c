"""Places of GSF's soundings: north, east and up of the ping's position along its heading, against PROJ's geodesic."""

import struct
from pathlib import Path

import numpy as np
import pytest
from pyproj import Geod

from pipeline.errors import RawDataError
from pipeline.readers.gsf_places import gsf_points
from tests.support.files.sonar_files import gsf, gsf_header, gsf_placed

PLACES = [(2.0, -5.0, 3.0), (0.0, 0.0, 4.0), (-1.5, 12.0, 2.5), (0.5, 20.0, 6.0)]  # along, across, depth


def at(longitude_deg: float, latitude_deg: float, heading_deg: float) -> bytes:
    """A ping at a place: longitude and latitude stand in its record as 1e-7 degrees, heading as 0.01 degrees."""
    content = bytearray(gsf_placed(0, PLACES, (0.0, 0.0)))
    struct.pack_into(">2i", content, 8 + 8, round(longitude_deg * 1e7), round(latitude_deg * 1e7))
    struct.pack_into(">H", content, 8 + 30, round(heading_deg * 100))
    return bytes(content)


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, 163.0, 300.0])
@pytest.mark.parametrize(("longitude_deg", "latitude_deg"), [(120.1, 36.0), (-71.5, -53.2)])
def test_along_and_across(tmp_path: Path, heading_deg: float, longitude_deg: float, latitude_deg: float) -> None:
    path = tmp_path / "a.gsf"
    path.write_bytes(gsf_header() + at(longitude_deg, latitude_deg, heading_deg))
    ((points, lost),) = gsf_points(path)
    assert lost == 0
    geod = Geod(ellps="WGS84")
    for (along, across, depth), (longitude, latitude, height) in zip(PLACES, points, strict=True):
        azimuth = heading_deg + np.degrees(np.arctan2(across, along))
        expected = geod.fwd(longitude_deg, latitude_deg, azimuth, np.hypot(along, across))[:2]
        assert geod.inv(longitude, latitude, *expected)[2] < 0.001
        assert height == pytest.approx(-depth, abs=1e-9)


def test_without_places_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.gsf"
    path.write_bytes(gsf())
    with pytest.raises(RawDataError, match="has no ping with across-track distances"):
        list(gsf_points(path))
