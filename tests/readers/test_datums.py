"""Each datum's own way to ECEF, against formulas of the tests' own and published points; what is refused, and why.

China's, Australia's, Europe's and North America's systems are not WGS 84, and no step to WGS 84 is made: the INS is in
the same one.
"""

from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ConfigError
from pipeline.maths.geometry.geodesy import ecef_from_geodetic
from pipeline.readers.crs import LaserFrame, frame_transform
from tests.support.ellipsoids import BEIJING, GRS80, MELBOURNE, SHANGHAI, WGS84, A, ecef_of, gauss_krueger
from tests.support.files.build import read
from tests.support.files.crs_files import table


def moved(frame: str, point: tuple[float, float, float]) -> np.ndarray:
    placing = frame_transform(LaserFrame(frame, "ellipsoidal"))
    assert placing is not None
    return np.array(placing.to_ecef(*(np.array([value]) for value in point)))[:, 0]


def away_m(frame: str, point: tuple[float, float, float], place: tuple[float, float, float], f: float) -> float:
    return float(np.linalg.norm(moved(frame, point) - ecef_of(*place, f)))


# --- the same place --------------------------------------------------------------------------------------------------
FLINDERS = (144 + 25 / 60 + 29.52440 / 3600, -(37 + 57 / 60 + 3.72030 / 3600), 104.3)
BUNINYONG = (143 + 55 / 60 + 35.38390 / 3600, -(37 + 39 / 60 + 10.15610 / 3600), 744.9)
MGA55, MGA54 = (273_741.297, 5_796_489.777), (758_173.797, 5_828_674.340)  # GDA2020 Technical Manual, tables 5.1, C-1


def test_the_formulas_of_this_test_are_right() -> None:
    """Two hills of the GDA technical manual, to the millimetre as printed."""
    for place, meridian_deg, printed in ((FLINDERS, 147.0, MGA55), (BUNINYONG, 141.0, MGA54)):
        east, north = gauss_krueger(place, GRS80, meridian_deg)
        assert (5e5 + 0.9996 * east, 1e7 + 0.9996 * north) == pytest.approx(printed, abs=6e-4)
    assert ecef_of(90.0, 0.0, 10.0, WGS84) == pytest.approx([0, A + 10, 0], abs=1e-6)
    assert ecef_of(0.0, 90.0, 0.0, WGS84) == pytest.approx([0, 0, 6_356_752.314245], abs=1e-6)


@pytest.mark.parametrize(("frame", "place", "printed"), [
    ("EPSG:28355", FLINDERS, MGA55), ("EPSG:7855", FLINDERS, MGA55), ("EPSG:7854", BUNINYONG, MGA54)
])  # fmt: skip
def test_australia_as_published(
    frame: str, place: tuple[float, float, float], printed: tuple[float, float]
) -> None:
    """GDA94 and GDA2020 are 1.8 m apart: neither is moved, for the INS is in the same."""
    assert away_m(frame, (*printed, place[2]), place, GRS80) < 8e-4  # printed to the millimetre


@pytest.mark.parametrize(
    ("frame", "meridian_deg", "false_east_m", "place"),
    [
        ("EPSG:4547", 114, 500_000, (114.05, 22.54, -3.0)),
        ("EPSG:4548", 117, 500_000, BEIJING),
        ("EPSG:4549", 120, 500_000, SHANGHAI),
        ("EPSG:4549", 120, 500_000, (120.1, 36.0, 12.0)),
        ("EPSG:4527", 117, 39_500_000, BEIJING),
        ("EPSG:4528", 120, 40_500_000, SHANGHAI),
        ("EPSG:4509", 117, 500_000, (119.9, 39.9, 43.5)),  # the wider zones of 6 degrees
    ],
)
def test_china_s_gauss_krueger(
    frame: str, meridian_deg: float, false_east_m: float, place: tuple[float, float, float]
) -> None:
    """x east with the digits of the zone before it where the CRS has them, y north, scale 1."""
    east, north = gauss_krueger(place, GRS80, meridian_deg)
    assert away_m(frame, (false_east_m + east, north, place[2]), place, GRS80) < 1e-6


@pytest.mark.parametrize(
    ("frame", "meridian_deg", "scale", "south_m", "place", "flattening"),
    [
        ("EPSG:25832", 9, 0.9996, 0, (9.99, 53.55, 45.0), GRS80),  # ETRS89
        ("EPSG:26910", -123, 0.9996, 0, (-122.4, 37.8, -28.0), GRS80),  # NAD83
        ("EPSG:31983", -45, 0.9996, 1e7, (-43.2, -22.9, 5.0), GRS80),  # SIRGAS 2000, south
        ("EPSG:32651", 123, 0.9996, 0, SHANGHAI, WGS84),
        ("EPSG:32755", 147, 0.9996, 1e7, MELBOURNE, WGS84),
        ("+proj=utm +zone=51 +ellps=GRS80", 123, 0.9996, 0, SHANGHAI, GRS80),
        ("+proj=utm +zone=51 +ellps=GRS80 +towgs84=100,200,300", 123, 0.9996, 0, SHANGHAI, GRS80),  # bound to a shift
        ("+proj=tmerc +lat_0=0 +lon_0=120 +k=1 +x_0=500000 +y_0=0 +datum=WGS84", 120, 1.0, 0, SHANGHAI, WGS84),
    ],
)
def test_transverse_mercator_of_every_datum(
    frame: str, meridian_deg: float, scale: float, south_m: float, place: tuple[float, float, float], flattening: float
) -> None:
    east, north = gauss_krueger(place, flattening, meridian_deg)
    assert away_m(frame, (5e5 + scale * east, south_m + scale * north, place[2]), place, flattening) < 1e-6


def test_a_state_plane_whose_origin_is_not_on_the_equator() -> None:
    """EPSG:26995, Mississippi West: origin 29.5 north, 90 degrees 20 minutes west, scale 0.99995, NAD83."""
    place, meridian_deg = (-89.1, 30.4, -20.0), -(90 + 20 / 60)
    east, north = gauss_krueger(place, GRS80, meridian_deg)
    _, origin = gauss_krueger((meridian_deg, 29.5, 0.0), GRS80, meridian_deg)
    assert away_m("EPSG:26995", (7e5 + 0.99995 * east, 0.99995 * (north - origin), -20.0), place, GRS80) < 1e-6


def test_a_lambert_conic() -> None:
    """EPSG:2991, Oregon: parallels 43 and 45.5 north (Snyder 1987, eq. 15-1 to 15-10)."""
    e = np.sqrt(GRS80 * (2 - GRS80))

    def m(degrees: float) -> float:
        return float(np.cos(np.radians(degrees)) / np.sqrt(1 - (e * np.sin(np.radians(degrees))) ** 2))

    def t(degrees: float) -> float:
        sine = np.sin(np.radians(degrees))
        return float(np.tan(np.pi / 4 - np.radians(degrees) / 2) / ((1 - e * sine) / (1 + e * sine)) ** (e / 2))

    n = np.log(m(43) / m(45.5)) / np.log(t(43) / t(45.5))
    factor = m(43) / (n * t(43) ** n)
    place = (-123.8, 46.2, -15.0)
    radius, at_origin, turn = A * factor * t(46.2) ** n, A * factor * t(41.75) ** n, n * np.radians(-123.8 + 120.5)
    point = (4e5 + radius * np.sin(turn), at_origin - radius * np.cos(turn), -15.0)
    assert away_m("EPSG:2991", point, place, GRS80) < 1e-6


@pytest.mark.parametrize(
    ("frame", "flattening"),
    [
        ("EPSG:4490", GRS80),  # CGCS2000, latitude first in the register: here x is longitude all the same
        ("EPSG:4480", GRS80),
        ("EPSG:4258", GRS80),
        ("EPSG:4937", GRS80),
        ("EPSG:7844", GRS80),  # GDA2020
        ("EPSG:7912", GRS80),  # ITRF2014, a dynamic datum: no epoch is asked for, and nothing moved
        ("EPSG:4326", WGS84),  # an ensemble of datums
        ("EPSG:4979", WGS84),
        ("EPSG:9057", WGS84),  # WGS 84 (G1762)
    ],
)
@pytest.mark.parametrize("place", [BEIJING, SHANGHAI, MELBOURNE, (-122.4, 37.8, -28.0)])
def test_longitude_and_latitude(frame: str, flattening: float, place: tuple[float, float, float]) -> None:
    assert away_m(frame, place, place, flattening) < 1e-6


@pytest.mark.parametrize("frame", ["EPSG:4479", "EPSG:7789", "EPSG:7842", "EPSG:4936"])
def test_geocentric_points_stay(frame: str) -> None:
    point = (-2_694_000.123, 4_293_000.456, 3_857_000.789)
    assert moved(frame, point).tolist() == list(point)


def test_the_ellipsoids_differ_by_a_tenth_of_a_millimetre() -> None:
    """The INS's latitudes go through WGS 84's ellipsoid, points of CGCS2000 through their own."""
    latitudes = np.linspace(-89.0, 89.0, 179)
    placing = frame_transform(LaserFrame("EPSG:4490", "ellipsoidal"))
    assert placing is not None
    longitudes, heights = np.full(179, 120.1), np.full(179, 12.0)
    own = np.stack(placing.to_ecef(longitudes, latitudes, heights), axis=1)
    ins = ecef_from_geodetic(np.radians(latitudes), np.radians(longitudes), heights)
    away = np.linalg.norm(own - ins, axis=1)
    assert 1.1e-4 < away.max() < 1.3e-4


# --- refused ---------------------------------------------------------------------------------------------------------
def refused(frame: str, words: str, folder: Path, heights: str | None = "ellipsoidal") -> str:
    with pytest.raises(ConfigError, match=words) as error:
        read("laser", table(folder, [(1.0, 2.0, 3.0)]), "table", frame=frame, heights=heights)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("frame", "ellipsoid"),
    [
        ("EPSG:28992", "Bessel 1841"),
        ("EPSG:5514", "Bessel 1841"),
        ("EPSG:2056", "Bessel 1841"),
        ("EPSG:31370", "International 1924"),
        ("EPSG:2326", "International 1924"),
        ("EPSG:27700", "Airy 1830"),
        ("EPSG:2437", "Krassowsky 1940"),  # Beijing 1954
        ("EPSG:2385", "IAG 1975"),  # Xian 1980
        ("EPSG:26710", "Clarke 1866"),  # NAD27
        ("EPSG:32251", "WGS 72"),
        ("EPSG:4807", "Clarke 1880"),
        ("+proj=utm +zone=51 +ellps=bessel +towgs84=0,0,0", "Bessel 1841"),
    ],
)
def test_other_ellipsoids(frame: str, ellipsoid: str, tmp_path: Path) -> None:
    """Heights above them are tens of metres from those above the INS's."""
    refused(frame, rf"laser\.frame = .*ellipsoid {ellipsoid}.*EPSG:4978", tmp_path)


@pytest.mark.parametrize("frame", ["EPSG:2053", "EPSG:5041"])
def test_axes_that_do_not_run_east_and_north(frame: str, tmp_path: Path) -> None:
    """Hartebeesthoek94's run west and south, those of the poles both south: x, y would be mirrored."""
    refused(frame, "axes that run .*south.*export the points in a CRS of east, north and up", tmp_path)


def test_depths() -> None:
    degree, axes = 'ANGLEUNIT["degree",0.0174532925199433]', 'AXIS["lat",north,{0}],AXIS["lon",east,{0}]'
    datum = 'DATUM["d",ELLIPSOID["WGS 84",6378137,298.257223563]]'
    third = 'AXIS["depth",down,LENGTHUNIT["metre",1]]'
    wkt = f'GEOGCRS["x",{datum},CS[ellipsoidal,3],{axes.format(degree)},{third}]'
    with pytest.raises(ConfigError, match=r"axes that run north, east, down.*east, north and up"):
        frame_transform(LaserFrame(wkt))
    assert frame_transform(LaserFrame(wkt.replace("down", "up"))) is not None


def test_other_meridians_and_no_meridians(tmp_path: Path) -> None:
    refused("+proj=longlat +ellps=GRS80 +pm=paris", "longitudes from .*export the points with .*Greenwich", tmp_path)
    axes = 'CS[Cartesian,3],AXIS["x",east],AXIS["y",north],AXIS["z",up],LENGTHUNIT["metre",1]'
    refused(f'ENGCRS["site",EDATUM["peg"],{axes}]', "is no CRS of points on the earth", tmp_path)


@pytest.mark.parametrize("frame", ["UTM51N", "CGCS2000 zone 40", "EPSG:999999", "4979,"])
def test_no_crs_in_plain_words(frame: str, tmp_path: Path) -> None:
    told = refused(frame, r"session\.yaml: laser\.frame = .*no coordinate reference system.*EPSG:32651", tmp_path)
    assert "proj" not in told.lower()
