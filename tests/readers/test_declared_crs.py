"""The CRS that a file of points says itself, and what its numbers say of it: digits of a zone, x and y interchanged."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import RawDataError
from tests.support.ellipsoids import GRS80, SHANGHAI, WGS84, ecef_of, gauss_krueger
from tests.support.files.build import read, rows
from tests.support.files.crs_files import las, placed, table

GK = (5e5 + gauss_krueger(SHANGHAI, GRS80, 120)[0], gauss_krueger(SHANGHAI, GRS80, 120)[1], SHANGHAI[2])
UTM = (5e5 + 0.9996 * gauss_krueger(SHANGHAI, GRS80, 123)[0], 0.9996 * gauss_krueger(SHANGHAI, GRS80, 123)[1], 4.5)


def test_a_file_of_cgcs2000(tmp_path: Path) -> None:
    columns, dropped = read(
        "laser", las(tmp_path, [GK], "EPSG:4549"), "las", frame="EPSG:4549", heights="ellipsoidal"
    )
    assert not dropped
    assert np.linalg.norm(placed(columns)[0] - ecef_of(*SHANGHAI, GRS80)) < 0.001  # LAS is in mm


@pytest.mark.parametrize("declared", ["EPSG:32651", "EPSG:4528", "EPSG:4548", "EPSG:4490"])
def test_a_file_that_contradicts(declared: str, tmp_path: Path) -> None:
    """Another projection, digits of a zone, another meridian, degrees."""
    with pytest.raises(RawDataError, match=r"a\.las: says itself .*laser\.frame is 'EPSG:4549'.*correct laser\.frame"):
        read("laser", las(tmp_path, [GK], declared), "las", frame="EPSG:4549", heights="ellipsoidal")


@pytest.mark.parametrize("declared", ["EPSG:32651", "+proj=utm +zone=51 +ellps=GRS80"])
@pytest.mark.parametrize("frame", ["EPSG:32651", "+proj=utm +zone=51 +ellps=GRS80"])
def test_two_datums_of_one_ellipsoid_are_one_place(declared: str, frame: str, tmp_path: Path) -> None:
    """Whichever the session names: the INS's datum is the points' datum."""
    columns, _ = read("laser", las(tmp_path, [UTM], declared), "las", frame=frame, heights="ellipsoidal")
    assert np.linalg.norm(placed(columns)[0] - ecef_of(*SHANGHAI, GRS80)) < 0.001


def test_a_file_on_another_ellipsoid(tmp_path: Path) -> None:
    with pytest.raises(RawDataError, match=r"a\.las: says itself .*on the ellipsoid WGS 72.*export"):
        read("laser", las(tmp_path, [UTM], "EPSG:32251"), "las", frame="EPSG:32651", heights="ellipsoidal")


def test_a_file_whose_heights_are_of_another_kind(tmp_path: Path) -> None:
    path = las(tmp_path, [SHANGHAI], "EPSG:4326+5773", scale=1e-8)
    with pytest.raises(RawDataError, match=r"a\.las: .*heights are EGM96 height; export ellipsoidal heights"):
        read("laser", path, "las", frame="EPSG:4979")
    path = las(tmp_path, [UTM], "+proj=utm +zone=51 +datum=WGS84 +vunits=us-ft")
    with pytest.raises(RawDataError, match=r"a\.las: .*unit of its heights is the US survey foot.*export the heights"):
        read("laser", path, "las", frame="EPSG:32651", heights="ellipsoidal")


def test_heights_of_a_unit_of_their_own(tmp_path: Path) -> None:
    frame = "+proj=utm +zone=51 +datum=WGS84 +vunits=us-ft"
    columns, _ = read("laser", table(tmp_path, [(UTM[0], UTM[1], 4.5 * 3937 / 1200)]), "table", frame=frame)
    assert np.linalg.norm(placed(columns)[0] - ecef_of(*SHANGHAI, WGS84)) < 1e-3  # UTM is of the other ellipsoid


def test_x_and_y_interchanged(tmp_path: Path) -> None:
    """China's surveyors call north x: a file with x north is named, not left out point by point."""
    swapped = (GK[1], GK[0], GK[2])
    with pytest.raises(RawDataError, match=r"a\.csv: its x and y are interchanged.*x must be east"):
        read("laser", table(tmp_path, [swapped] * 3), "table", frame="EPSG:4549", heights="ellipsoidal")
    with pytest.raises(RawDataError, match=r"a\.csv: its x and y are interchanged"):
        read("laser", table(tmp_path, [(31.2, 121.5, 4.5)] * 3), "table", frame="EPSG:4490", heights="ellipsoidal")
    columns, dropped = read(
        "laser", table(tmp_path, [GK, swapped]), "table", frame="EPSG:4549", heights="ellipsoidal"
    )
    assert rows(columns) == 1
    assert dropped == {"outside the area of laser.frame": 1}


@pytest.mark.parametrize(("frame", "east_m"), [("EPSG:4549", 4e7), ("EPSG:4528", -4e7), ("EPSG:4527", 1e6)])
def test_digits_of_a_zone(frame: str, east_m: float, tmp_path: Path) -> None:
    """40 500 000 for a CRS of 500 000, and the other way round, and zone 40 for zone 39."""
    false = {"EPSG:4549": 0.0, "EPSG:4528": 4e7, "EPSG:4527": 39e6}[frame]
    point = (GK[0] + false + east_m, GK[1], GK[2])
    with pytest.raises(RawDataError, match=r"a\.csv: its x, such as .*digits of a zone.*name the CRS"):
        read("laser", table(tmp_path, [point] * 3), "table", frame=frame, heights="ellipsoidal")
