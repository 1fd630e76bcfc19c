"""Points in coordinate reference systems: the same place by each, whatever its axes; what is refused, and why."""

from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS

from pipeline.config.session import Laser
from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.crs import LaserFrame, frame_transform
from tests.support.files.build import MOUNT, read, rows
from tests.support.files.crs_files import las, placed, table
from tests.support.files.e57_files import Scan, write

A, F = 6_378_137.0, 1 / 298.257223563  # WGS 84
PLACES = [(120.1, 36.0, 12.0), (123.0, 0.5, -30.0), (125.9, 59.3, 480.0), (121.4737, 31.2304, 4.5)]  # zone 51
FOOT_M = 1200 / 3937  # of the US survey


def ecef_of(longitude_deg: float, latitude_deg: float, height_m: float) -> list[float]:
    """The closed formula of geodesy's textbooks."""
    longitude, latitude = np.radians(longitude_deg), np.radians(latitude_deg)
    squared = F * (2 - F)
    across = A / np.sqrt(1 - squared * np.sin(latitude) ** 2)
    level = (across + height_m) * np.cos(latitude)
    up = (across * (1 - squared) + height_m) * np.sin(latitude)
    return [float(level * np.cos(longitude)), float(level * np.sin(longitude)), float(up)]


def utm_of(longitude_deg: float, latitude_deg: float, zone: int) -> tuple[float, float]:
    """Krueger's series to n^4 (Karney 2011, eq. 35): easting and northing on the northern half, to 0.1 micrometre."""
    n = F / (2 - F)
    radius = A / (1 + n) * (1 + n**2 / 4 + n**4 / 64)
    series = [
        n / 2 - 2 / 3 * n**2 + 5 / 16 * n**3 + 41 / 180 * n**4,
        13 / 48 * n**2 - 3 / 5 * n**3 + 557 / 1440 * n**4,
        61 / 240 * n**3 - 103 / 140 * n**4,
        49561 / 161280 * n**4,
    ]
    latitude, away = np.radians(latitude_deg), np.radians(longitude_deg - (6 * zone - 183))
    e = np.sqrt(F * (2 - F))
    tangent, sine = np.tan(latitude), np.sin(latitude)
    sigma = np.sinh(e * np.arctanh(e * sine))
    conformal = tangent * np.hypot(1, sigma) - sigma * np.hypot(1, tangent)
    xi, eta = np.arctan2(conformal, np.cos(away)), np.arcsinh(np.sin(away) / np.hypot(conformal, np.cos(away)))
    north = xi + sum(a * np.sin(2 * k * xi) * np.cosh(2 * k * eta) for k, a in enumerate(series, 1))
    east = eta + sum(a * np.cos(2 * k * xi) * np.sinh(2 * k * eta) for k, a in enumerate(series, 1))
    return float(500_000 + 0.9996 * radius * east), float(0.9996 * radius * north)


UTM = [(*utm_of(longitude, latitude, 51), height) for longitude, latitude, height in PLACES]
ECEF = [tuple(ecef_of(*place)) for place in PLACES]


# --- the same place --------------------------------------------------------------------------------------------------
def test_the_formulas_of_this_test_are_right() -> None:
    """UTM of the CN Tower as published, to the metre; ECEF on the equator and at the pole."""
    longitude, latitude = -(79 + 23 / 60 + 13.7 / 3600), 43 + 38 / 60 + 33.24 / 3600
    assert utm_of(longitude, latitude, 17) == pytest.approx((630_084, 4_833_438), abs=1.0)
    assert ecef_of(90.0, 0.0, 10.0) == pytest.approx([0, 6_378_147, 0], abs=1e-6)
    assert ecef_of(0.0, 90.0, 0.0) == pytest.approx([0, 0, 6_356_752.314245], abs=1e-6)


@pytest.mark.parametrize(
    ("frame", "heights", "points"),
    [
        ("EPSG:4978", None, ECEF),
        ("EPSG:4978", "ellipsoidal", ECEF),
        ("EPSG:4979", None, PLACES),
        ("EPSG:4979", "ellipsoidal", PLACES),
        ("EPSG:4326", "ellipsoidal", PLACES),
        ("EPSG:32651", "ellipsoidal", UTM),
    ],
)
def test_one_place_by_every_way(
    frame: str, heights: str | None, points: list[tuple[float, ...]], tmp_path: Path
) -> None:
    columns, dropped = read("laser", table(tmp_path, points), "table", frame=frame, heights=heights)
    assert not dropped
    assert np.abs(placed(columns) - np.array(ECEF)).max() < 1e-6


def test_las_and_e57_the_same_way(tmp_path: Path) -> None:
    more = {"frame": "EPSG:32651", "heights": "ellipsoidal"}
    columns, _ = read("laser", las(tmp_path, UTM[:1], "EPSG:32651"), "las", **more)
    assert np.abs(placed(columns) - np.array(ECEF[:1])).max() < 0.001
    names = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), zip(*UTM, strict=True), strict=True))
    write(tmp_path / "a.e57", Scan(names | {"timeStamp": (0.0, 1.0, 2.0, 3.0)}, 1.4e9), crs=CRS(32651).to_wkt())
    columns, _ = read("laser", tmp_path / "a.e57", "e57", **more)
    assert np.abs(placed(columns) - np.array(ECEF)).max() < 1e-6


def test_feet_with_feet() -> None:
    """Heights have the unit of the CRS's axes; Texas, central zone, in both units."""
    placing = frame_transform(LaserFrame("EPSG:2277", "ellipsoidal"))
    metres = frame_transform(LaserFrame("EPSG:32139", "ellipsoidal"))  # the same zone in metres
    assert placing is not None
    assert metres is not None
    place = np.array([[700_000.0], [3_100_000.0], [120.0]])
    expected = np.array(metres.to_ecef(*place))
    assert np.abs(np.array(placing.to_ecef(*(place / FOOT_M))) - expected).max() < 2e-4  # origin rounded to 0.1 mm


# --- heights ---------------------------------------------------------------------------------------------------------
def refused(frame: str, heights: str | None, words: str, folder: Path) -> None:
    with pytest.raises(ConfigError, match=words) as error:
        read("laser", table(folder, UTM), "table", frame=frame, heights=heights)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("frame", ["EPSG:32651", "EPSG:4326", "EPSG:25832"])
def test_heights_must_be_said(frame: str, tmp_path: Path) -> None:
    refused(frame, None, r"laser\.frame = .*no heights of its own.*Write laser\.heights: ellipsoidal", tmp_path)


def test_heights_above_a_geoid(tmp_path: Path) -> None:
    words = r"EGM96 height, above a geoid.*export ellipsoidal heights.*laser\.heights: ellipsoidal"
    for heights in ("ellipsoidal", None):
        refused("EPSG:32651+5773", heights, words, tmp_path)
        refused("EPSG:4490+5773", heights, words, tmp_path)
    refused("EPSG:5773", "ellipsoidal", "no CRS of points", tmp_path)


def test_heights_of_the_scanner_s_own_frame_are_no_heights() -> None:
    with pytest.raises(ValueError, match="heights is for points in a CRS"):
        Laser(files=["a"], format="las", mount=MOUNT, heights="ellipsoidal")


# --- what the file says of itself ------------------------------------------------------------------------------------
@pytest.mark.parametrize("declared", ["EPSG:32652", "EPSG:4326", "EPSG:4978", "EPSG:25832"])
def test_a_file_that_says_otherwise(declared: str, tmp_path: Path) -> None:
    path = las(tmp_path, UTM[:1], declared)
    with pytest.raises(RawDataError, match=r"a\.las: says itself that.*laser\.frame is 'EPSG:32651'") as error:
        read("laser", path, "las", frame="EPSG:32651", heights="ellipsoidal")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("declared", [None, "EPSG:32651", "+proj=utm +zone=51 +ellps=GRS80"])
def test_a_file_that_says_nothing_or_nearly_the_same(declared: str | None, tmp_path: Path) -> None:
    """Another datum on nearly the same ellipsoid is no reason to refuse a file."""
    columns, _ = read("laser", las(tmp_path, UTM[:1], declared), "las", frame="EPSG:32651", heights="ellipsoidal")
    assert np.abs(placed(columns) - np.array(ECEF[:1])).max() < 0.001


def test_a_file_whose_heights_are_above_a_geoid(tmp_path: Path) -> None:
    path = las(tmp_path, UTM[:1], "EPSG:32651+5773")
    with pytest.raises(RawDataError, match=r"a\.las: .*heights are EGM96 height.*export ellipsoidal heights"):
        read("laser", path, "las", frame="EPSG:32651", heights="ellipsoidal")


def test_a_file_read_in_the_scanner_s_frame_may_say_what_it_likes(tmp_path: Path) -> None:
    assert rows(read("laser", las(tmp_path, UTM[:1], "EPSG:32652"), "las")[0]) == 1


def test_e57_that_says_otherwise(tmp_path: Path) -> None:
    names = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), zip(*UTM, strict=True), strict=True))
    write(tmp_path / "a.e57", Scan(names | {"timeStamp": (0.0, 1.0, 2.0, 3.0)}, 1.4e9), crs=CRS(32652).to_wkt())
    with pytest.raises(RawDataError, match=r"a\.e57: says itself"):
        read("laser", tmp_path / "a.e57", "e57", frame="EPSG:32651", heights="ellipsoidal")


def test_a_wrong_zone_that_no_file_denies_is_half_a_thousand_kilometres_off(tmp_path: Path) -> None:
    """It cannot be known here; georeferencing leaves such points out, for they lie far off the target."""
    columns, dropped = read("laser", table(tmp_path, UTM[:1]), "table", frame="EPSG:32652", heights="ellipsoidal")
    assert not dropped
    assert 500_000 < np.linalg.norm(placed(columns)[0] - np.array(ECEF[0])) < 560_000


# --- places and steps that cannot be ---------------------------------------------------------------------------------
def test_points_outside_the_area_of_use_are_left_out(tmp_path: Path) -> None:
    swapped = (UTM[0][1], UTM[0][0], 12.0)
    columns, dropped = read(
        "laser", table(tmp_path, [UTM[0], swapped, (0.5, 0.5, 0.5)]), "table", frame="EPSG:32651", heights="ellipsoidal"
    )
    assert rows(columns) == 1
    assert dropped == {"outside the area of laser.frame": 2}


@pytest.mark.parametrize(
    ("frame", "scale", "z", "axis"),
    [
        ("laser", 0.02, 0.001, "x"),
        ("laser", 0.001, 0.02, "z"),
        ("EPSG:32651", 0.02, 0.001, "x"),
        ("EPSG:4979", 1e-6, 0.001, "x"),
        ("EPSG:4979", 1e-7, 0.02, "z"),
    ],
)
def test_coarse_steps_are_refused(frame: str, scale: float, z: float, axis: str, tmp_path: Path) -> None:
    points = PLACES[:1] if frame == "EPSG:4979" else UTM[:1]
    heights = "ellipsoidal" if frame == "EPSG:32651" else None
    with pytest.raises(RawDataError, match=rf"a\.las: its {axis} are whole numbers.*export it again with a scale"):
        read("laser", las(tmp_path, points, None, scale, z), "las", frame=frame, heights=heights)


@pytest.mark.parametrize("frame", ["EPSG:32651", "EPSG:4978", "EPSG:4979"])
@pytest.mark.parametrize("form", ["table", "las"])
def test_coordinates_through_float32(form: str, frame: str, tmp_path: Path) -> None:
    """In single precision UTM has steps of 16 mm and more; the same points in double precision are read."""
    start = {"EPSG:32651": UTM[0], "EPSG:4978": ECEF[0], "EPSG:4979": PLACES[0]}[frame]
    step = 1e-6 if frame == "EPSG:4979" else 0.1
    along = np.arange(200)[:, None] * np.array([step * 1.01, step * 1.07, 0.01])
    points = [tuple(float(value) for value in row) for row in np.array(start) + along]
    truncated = [(*map(float, np.array(point[:2], np.float32)), point[2]) for point in points]
    more = {"frame": frame, "heights": "ellipsoidal"}

    def file(rows_: list[tuple[float, ...]]) -> Path:
        return table(tmp_path, rows_) if form == "table" else las(tmp_path, rows_, None, min(step / 10, 0.001))

    assert rows(read("laser", file(points), form, **more)[0]) == 200
    with pytest.raises(RawDataError, match=r"its coordinates went through float32; export it again in double"):
        read("laser", file(truncated), form, **more)


@pytest.mark.parametrize(("frame", "scale"), [("laser", 0.01), ("EPSG:32651", 0.01), ("EPSG:4979", 1e-7)])
def test_a_centimetre_is_fine_enough(frame: str, scale: float, tmp_path: Path) -> None:
    points = PLACES[:1] if frame == "EPSG:4979" else UTM[:1]
    heights = "ellipsoidal" if frame == "EPSG:32651" else None
    path = las(tmp_path, points, None, scale, 0.01)
    assert rows(read("laser", path, "las", frame=frame, heights=heights)[0]) == 1


def test_an_old_way_of_writing_a_crs_warns_of_nothing(recwarn: pytest.WarningsRecorder) -> None:
    """The user sees one line at most, and none of the library's."""
    assert frame_transform(LaserFrame("+init=epsg:32651", "ellipsoidal")) is not None
    assert not recwarn
