"""Where the boat was: against tracks drawn on a sphere's tangent by hand."""

import numpy as np
import pytest

from pipeline.checking.file_survey import SurveyedFile
from pipeline.gps_time import NS
from pipeline.starting.boat_track import boat_track

LATITUDE, RADIUS_M = 36.0, 6_371_000.0


def _log(east_m: np.ndarray, north_m: np.ndarray, longitude_deg: float = 120.0, rate_hz: float = 10.0) -> SurveyedFile:
    """An INS's file; the sphere is wrong by 0.3 % of the way, and an azimuth by 0.2 degrees at most."""
    number = len(east_m)
    longitude = np.radians(longitude_deg) + east_m / RADIUS_M / np.cos(np.radians(LATITUDE))
    zeros = np.zeros(number)
    columns = {
        "t_ns": np.arange(number, dtype=np.int64) * round(NS / rate_hz),
        "latitude_rad": np.radians(LATITUDE) + north_m / RADIUS_M,
        "longitude_rad": (longitude + np.pi) % (2 * np.pi) - np.pi,
        "height_m": np.full(number, 12.5),
        "roll_rad": zeros,
        "pitch_rad": zeros,
        "azimuth_rad": zeros,
    }
    return SurveyedFile("ins", "a.gps", 1, records=number, columns=columns, epochs_ns=columns["t_ns"])


def _way(azimuth_deg: float, from_m: float, to_m: float) -> tuple[np.ndarray, np.ndarray]:
    along = np.arange(from_m, to_m, np.sign(to_m - from_m) * 0.05)
    return along * np.sin(np.radians(azimuth_deg)), along * np.cos(np.radians(azimuth_deg))


@pytest.mark.parametrize("azimuth_deg", [0.5, 45.0, 163.0, 250.0, 340.0])
def test_passes_out_and_back_have_one_direction(azimuth_deg: float) -> None:
    pieces = [_way(azimuth_deg, -30, 30), _way(azimuth_deg, 30, 10), _way(azimuth_deg, 10, 20)]
    track = boat_track([_log(*(np.concatenate(axis) for axis in zip(*pieces, strict=True)))])
    assert track.azimuth_deg == pytest.approx(azimuth_deg, abs=0.3)
    assert track.along_m == pytest.approx(70.0, abs=2.0)
    assert track.against_m == pytest.approx(20.0, abs=2.0)


def test_a_boat_that_lies_still_has_no_direction() -> None:
    rng = np.random.default_rng(0)
    track = boat_track([_log(*(0.01 * rng.normal(size=(2, 600))))])
    assert (track.azimuth_deg, track.along_m, track.against_m) == (None, 0.0, 0.0)
    assert track.height_m == pytest.approx(12.5)


def test_a_hole_in_the_log_is_no_way() -> None:
    east, north = (np.concatenate(axis) for axis in zip(_way(90, 0, 10), _way(0, 500, 510), strict=True))
    log = _log(east, north)
    log.columns["t_ns"][200:] += 3600 * NS
    track = boat_track([log])
    assert track.along_m == pytest.approx(10.0, abs=1.0)


def test_the_mean_at_the_date_line() -> None:
    track = boat_track([_log(np.linspace(-50, 50, 1001), np.zeros(1001), longitude_deg=180.0)])
    assert abs(track.longitude_deg) == pytest.approx(180.0, abs=1e-5)
    assert track.latitude_deg == pytest.approx(LATITUDE, abs=1e-6)
