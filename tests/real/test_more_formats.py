"""GSF, .kmall and E57 on real files, against figures that other programs gave for them."""

import importlib
import io
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.gps_time import NS, unix_ns_from_gps
from pipeline.readers import e57_scans, kmall
from pipeline.readers.gsf_pings import GsfScales, decode_gsf_ping
from pipeline.readers.gsf_records import PING, gsf_records
from pipeline.readers.kmall_datagrams import kmall_datagrams
from tests.real.conftest import Read
from tests.support.real_files import BUNNY, GSF, KMALL, MOVED


# --- Kongsberg -------------------------------------------------------------------------------------------------------
def test_kmall(read: Read) -> None:
    soundings, dropped = read("mbes", "kmall", KMALL)
    assert not dropped
    pings, counts = np.unique(soundings["ping"], return_counts=True)
    assert pings.tolist() == [37330, 37332, 37333, 37334, 37336]
    assert counts.tolist() == [400, 512, 512, 512, 512]
    assert soundings["sound_speed_m_s"][0] == pytest.approx(1444.909, abs=5e-4)
    assert unix_ns_from_gps(soundings["t_ns"])[0] == 1_764_246_725 * NS + 769_667_505


def test_kmall_sectors_follow_each_other(read: Read) -> None:
    """The fourth ping sends its three sectors 0.22 ms apart."""
    soundings, _ = read("mbes", "kmall", KMALL)
    sent, counts = np.unique(soundings["t_ns"][soundings["ping"] == 37334], return_counts=True)
    assert np.diff(sent) == pytest.approx([220_000, 220_000], abs=2)
    assert counts.tolist() == [137, 238, 137]


def test_kmall_against_its_library(data: Path, read: Read) -> None:
    """Soundings to starboard lie where Kongsberg has its positive y; a straight ray ends near Kongsberg's point."""
    soundings, _ = read("mbes", "kmall", KMALL)
    reader = importlib.import_module("KMALL").kmall()
    dropped: Counter[str] = Counter()
    with (data / KMALL).open("rb") as file:
        found = [datagram for datagram in kmall_datagrams(file, dropped) if datagram[4:8] == b"#MRZ"]
    assert len(found) == 5
    columns: dict[str, list[float]] = {"y": [], "angle": [], "time": []}
    for datagram in found:
        reader.FID = io.BytesIO(datagram)
        their: Any = reader.read_EMdgmMRZ()["sounding"]
        columns["y"] += list(their["y_reRefPoint_m"])
        columns["angle"] += list(their["beamAngleReRx_deg"])
        columns["time"] += list(their["twoWayTravelTime_sec"])
    with (data / KMALL).open("rb") as file:  # as recorded; read() turns them into those of one head in one place
        mrz = (datagram for datagram in kmall_datagrams(file, dropped) if datagram[4:8] == b"#MRZ")
        recorded = [kmall.decode_mrz(datagram, {}) for datagram in mrz]
    pings = [ping for ping in recorded if ping is not None]
    assert np.concatenate([ping.two_way_time_s for ping in pings]).tolist() == columns["time"]
    assert np.concatenate([ping.angle_deg for ping in pings]).tolist() == columns["angle"]
    assert columns["time"][0] == pytest.approx(0.005223785, abs=5e-10)
    assert columns["angle"][0] == pytest.approx(14.8277, abs=5e-5)
    assert soundings["two_way_time_s"] == pytest.approx(columns["time"], abs=0.16 / 1444)  # arrays 0.27 m apart
    assert np.degrees(soundings["angle_rad"]) == pytest.approx(-np.array(columns["angle"]), abs=0.3)
    across = soundings["two_way_time_s"] / 2 * soundings["sound_speed_m_s"] * np.sin(soundings["angle_rad"])
    slope = np.polyfit(across, columns["y"], 1)[0]
    assert slope == pytest.approx(1.0, abs=0.05)


def test_kmall_cut_in_the_middle(data: Path, read: Read) -> None:
    content = (data / KMALL).read_bytes()
    soundings, dropped = read("mbes", "kmall", KMALL, content[:200_000])
    assert len(soundings["t_ns"]) == 400 + 2 * 512
    assert set(dropped) <= {"truncated datagram", "stray bytes"}


# --- GSF -------------------------------------------------------------------------------------------------------------
def pings_of(path: Path) -> list[Any]:
    scales: GsfScales = {}
    with path.open("rb") as file:
        bodies = [body for kind, body in gsf_records(file, Counter()) if kind == PING]
    return [decode_gsf_ping(body, 3, scales) for body in bodies]


def test_gsf(data: Path) -> None:
    first, *others = pings = pings_of(data / GSF)
    assert len(others) == 7
    assert all(len(ping.angle_deg) == 432 for ping in pings)
    assert first.two_way_time_s[0] == pytest.approx(7.5676, abs=1e-9)
    assert first.angle_deg[[0, -1]] == pytest.approx([43.47, -43.2014], abs=1e-4)
    assert unix_ns_from_gps(np.array([first.t_ns]))[0] == pytest.approx(1_458_759_353.856 * NS, abs=200)
    assert np.count_nonzero(first.usable) == 204
    assert sum(np.count_nonzero(~ping.usable) for ping in pings) == 1087


def test_gsf_of_a_stabilised_sonar_is_refused(data: Path, read: Read) -> None:
    """Its fans are turned by ten degrees, each sector otherwise, and lean aft by 1.75 degrees whatever the pitch."""
    turns, leans = [], []
    for record in _records(data):
        beams = record["Beams"]
        good = np.asarray(beams["BeamFlags"]) & 1 == 0
        slope, at_nadir = np.polyfit(beams["AcrossTrack_m"][good], beams["AlongTrack_m"][good], 1)
        turns.append(np.degrees(np.arctan(slope)))
        leans.append(np.degrees(np.arctan(at_nadir / np.median(beams["Depth_m"][good]))))
    assert turns == pytest.approx([10.0] * 8, abs=0.5)
    assert np.std(leans) < 0.1
    with pytest.raises(RawDataError, match=r"fans are not fixed to the boat.*leave one plane by 0\.8") as error:
        read("mbes", "gsf", GSF)
    assert "\n" not in str(error.value)


def test_gsf_key_figures_and_sides(data: Path) -> None:
    """Beams with an angle to port have an across-track distance to port; three pings have angles that overflowed."""
    records = _records(data)
    first = records[0]
    assert (first["Latitude_deg"], first["Longitude_deg"]) == (8.7115166, 167.475991)
    assert first["Beams"]["Depth_m"][0] == pytest.approx(3993.51)
    sound = [record for record in records if np.all(np.abs(np.diff(record["Beams"]["BeamAngle_deg"])) < 20)]
    assert len(sound) == 5
    for record in sound:
        angle, across = record["Beams"]["BeamAngle_deg"], record["Beams"]["AcrossTrack_m"]
        wide = np.abs(angle) > 10
        assert np.array_equal(angle[wide] > 0, across[wide] < 0)


def test_gsf_angles_are_to_the_array_and_not_to_the_vertical(data: Path) -> None:
    """Against the soundings' places the angles of a ping are off by the boat's roll when it heard them, negated.

    The file's parameters say ROLL_COMPENSATED = YES all the same: that is about depths.
    """
    offsets, rolls = [], []
    attitude = _attitude(data)
    for record in _records(data):
        beams = record["Beams"]
        angle, across = beams["BeamAngle_deg"], beams["AcrossTrack_m"]
        place = -np.degrees(np.arctan2(across, beams["Depth_m"]))
        good = (np.abs(place) > 20) & ((angle > 0) == (place > 0))
        design = np.stack([np.tan(np.radians(place)), np.ones(len(place))], axis=1)  # rays bend with the tangent
        offsets.append(float(np.linalg.lstsq(design[good], (angle - place)[good], rcond=None)[0][1]))
        heard = np.datetime64(record["PingTime"][:-6], "ns").astype(np.int64) + int(beams["TravelTime_s"].mean() * NS)
        rolls.append(float(np.interp(heard, *attitude)))
    assert np.corrcoef(offsets, rolls)[0, 1] < -0.85
    assert np.polyfit(rolls, offsets, 1)[0] == pytest.approx(-0.75, abs=0.3)


@contextmanager
def _library(data: Path) -> Iterator[Any]:
    reader = importlib.import_module("GSFU").gsf(str(data / GSF))
    try:
        yield reader
    finally:
        reader.closeFile()


def _records(data: Path) -> list[Any]:
    with _library(data) as reader:
        return [record for _, _, record in reader.iter_records("SWATH_BATHYMETRY_PING")]


def _attitude(data: Path) -> tuple[np.ndarray, np.ndarray]:
    with _library(data) as reader:
        found = reader.read_attitude()
    return np.asarray(found["Time"], dtype="datetime64[ns]").astype(np.int64), np.asarray(found["Roll_deg"])


# --- E57 -------------------------------------------------------------------------------------------------------------
def test_e57_coordinates(data: Path) -> None:
    ((scan,), _) = e57_scans.read_scans(data / BUNNY, BUNNY)
    (numbers,) = e57_scans.stored_points(data / BUNNY, BUNNY, 0)
    assert scan.points == len(numbers[0]) == 30_571
    x, y, z = e57_scans.file_coordinates(numbers, scan)
    assert (x[0], y[0], z[0]) == pytest.approx((-0.07063, 0.04015, 0.001226), abs=1e-12)
    assert not numbers[4].any()


def test_e57_pose(data: Path) -> None:
    ((scan,), _) = e57_scans.read_scans(data / MOVED, MOVED)
    (numbers,) = e57_scans.stored_points(data / MOVED, MOVED, 0)
    places = np.stack(e57_scans.file_coordinates(numbers, scan), axis=1)
    assert places.tolist() == [[4, 5, 6], [5, 5, 6], [4, 6, 6], [5, 6, 6]]


@pytest.mark.parametrize("name", [BUNNY, MOVED])
def test_e57_without_times_is_refused(name: str, read: Read) -> None:
    with pytest.raises(RawDataError, match=rf"{Path(name).name}: has no times of points.*export it again") as error:
        read("laser", "e57", name)
    assert "\n" not in str(error.value)
