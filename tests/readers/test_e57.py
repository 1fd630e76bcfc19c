"""E57: times, poses, marks of invalid points; what is refused; damage. Files by libE57Format's writer."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.config.session import Laser
from pipeline.errors import RawDataError
from pipeline.readers import e57_scans
from pipeline.readers.dispatch import raw_parts
from tests.support.files.build import MOUNT, read, rows
from tests.support.files.e57_files import POINTS, START_S, TIMES, Scan, edited, write

NS = 10**9
XYZ = ("x_m", "y_m", "z_m")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.e57"


def points(columns: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack([columns[name] for name in XYZ], axis=1)


def test_times_and_points(file: Path) -> None:
    """Time is acquisitionStart, GPS without leap seconds, and the point's own seconds."""
    write(file, Scan(POINTS | TIMES, START_S))
    columns, dropped = read("laser", file, "e57", latency_s=0.25)
    assert not dropped
    assert (columns["t_ns"] - 1_398_556_818 * NS).tolist() == [0, 500_001_000, 10 * NS]
    assert points(columns).tolist() == [[1.0, 4.0, 7.0], [2.0, 5.0, 8.0], [3.0, 6.0, 9.5]]


def test_pose_is_applied_and_scans_follow_each_other(file: Path) -> None:
    """A quarter turn about z, counter-clockwise, takes x to y; quaternions are w, x, y, z, by name."""
    half = float(np.sqrt(0.5))
    turned = Scan(POINTS | TIMES, START_S, rotation=(half, 0.0, 0.0, half), translation=(100.0, 200.0, 300.0))
    write(file, turned, Scan(POINTS | TIMES, START_S + 100, translation=(1.0, 0.0, 0.0)))
    columns, _ = read("laser", file, "e57")
    expected = [[96.0, 201.0, 307.0], [95.0, 202.0, 308.0], [94.0, 203.0, 309.5]]
    expected += [[2.0, 4.0, 7.0], [3.0, 5.0, 8.0], [4.0, 6.0, 9.5]]
    assert points(columns) == pytest.approx(np.array(expected), abs=1e-12)
    assert np.all(np.diff(columns["t_ns"]) > 0)
    parts = raw_parts("laser", Laser(files=[file.name], format="e57", mount=MOUNT), file.parent)
    assert [part.name for part in parts] == ["a.e57#0", "a.e57#1"]


def test_spherical_points(file: Path) -> None:
    """Range, azimuth from x toward y, elevation from the xy plane."""
    columns = {"sphericalRange": (2.0, 2.0, 4.0), "sphericalAzimuth": (0.0, np.pi / 2, np.pi)}
    columns |= {"sphericalElevation": (0.0, 0.0, np.pi / 6), "sphericalInvalidState": (0, 0, 0)}
    write(file, Scan(columns | TIMES, START_S))
    expected = np.array([[2, 0, 0], [0, 2, 0], [-4 * np.cos(np.pi / 6), 0, 2]])
    assert points(read("laser", file, "e57")[0]) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("state", [1, 2])
def test_invalid_points_and_times_are_left_out(state: int, file: Path) -> None:
    marks = {"cartesianInvalidState": (0, state, 0), "isTimeStampInvalid": (0, 0, 1)}
    write(file, Scan(POINTS | TIMES | marks, START_S))
    columns, dropped = read("laser", file, "e57")
    assert columns["x_m"].tolist() == [1.0]
    assert dropped == {"point marked as invalid": 1, "no time": 1}


def test_numbers_that_cannot_be(file: Path) -> None:
    odd = {"cartesianX": (1.0, np.nan, 3.0), "timeStamp": (0.0, 0.1, 1e12)}
    write(file, Scan(POINTS | odd, START_S))
    columns, dropped = read("laser", file, "e57")
    assert columns["x_m"].tolist() == [1.0]
    assert dropped == {"not a finite number": 1, "impossible time": 1}


def test_points_in_a_crs(file: Path) -> None:
    """On the equator ECEF is known without a program."""
    lonlat = {"cartesianX": (90.0,), "cartesianY": (0.0,), "cartesianZ": (10.0,), "timeStamp": (0.1,)}
    write(file, Scan(lonlat, START_S))
    columns, _ = read("laser", file, "e57", frame="EPSG:4979")
    assert points(columns)[0] == pytest.approx([0.0, 6_378_147.0, 0.0], abs=1e-6)


def test_many_points_come_in_batches(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = 2500
    columns = {name: np.arange(count) * 0.001 for name in POINTS} | {"timeStamp": np.arange(count) * 1e-4}
    write(file, Scan(columns, START_S))
    monkeypatch.setattr(e57_scans, "BATCH_ROWS", 1000)
    (part,) = raw_parts("laser", Laser(files=[file.name], format="e57", mount=MOUNT), file.parent)
    chunks = list(part.chunks())
    assert [len(chunk.columns["t_ns"]) for chunk in chunks] == [1000, 1000, 500]
    assert np.concatenate([chunk.columns["x_m"] for chunk in chunks]) == pytest.approx(np.arange(count) * 0.001)


# --- refused ---------------------------------------------------------------------------------------------------------
def _refused(file: Path, words: str, **more: Any) -> None:
    with pytest.raises(RawDataError, match=rf"a\.e57.*{words}") as error:
        read("laser", file, "e57", **more)
    assert "\n" not in str(error.value)
    assert "****" not in str(error.value)  # the library's source lines


def test_without_times(file: Path) -> None:
    write(file, Scan(POINTS, START_S))
    _refused(file, "no times of points.*export it again")


def test_without_start(file: Path) -> None:
    write(file, Scan(POINTS | TIMES))
    _refused(file, "not set by GPS")


def test_clock_not_set_by_gps(file: Path) -> None:
    write(file, Scan(POINTS | TIMES, START_S), Scan(POINTS | TIMES, START_S, atomic=0))
    _refused(file, "scan 1: .*not set by GPS")


def test_impossible_start_and_pose(file: Path) -> None:
    for start_s in (1e200, 5000 * 604_800.0, -1.0):  # week 5000, 2075, is the last everywhere
        write(file, Scan(POINTS | TIMES, start_s))
        _refused(file, "damaged")
    write(file, Scan(POINTS | TIMES, 5000 * 604_800 - 100.0))
    assert rows(read("laser", file, "e57")[0]) == 3
    write(file, Scan(POINTS | TIMES, START_S, rotation=(0.0, 0.0, 0.0, 0.0)))
    _refused(file, "damaged")


def test_coordinates_through_float32(file: Path) -> None:
    """Small ones may be; ECEF in float32 has steps of half a metre."""
    single = frozenset(POINTS)
    write(file, Scan(POINTS | TIMES, START_S, single=single))
    assert rows(read("laser", file, "e57")[0]) == 3
    write(file, Scan(POINTS | TIMES | {"cartesianX": (3e6, 3e6, 3e6)}, START_S, single=single))
    _refused(file, "float32.*double precision")


def test_times_through_float32(file: Path) -> None:
    times = tuple(float(np.float32(5000 + 0.1 * k)) for k in range(3))
    write(file, Scan(POINTS | {"timeStamp": times}, START_S, single=frozenset({"timeStamp"})))
    _refused(file, "float32.*double precision")


def test_empty_file_of_no_scans(file: Path) -> None:
    write(file)
    _refused(file, "no scans")


# --- damage ----------------------------------------------------------------------------------------------------------
@pytest.fixture
def content(file: Path) -> bytes:
    count = 300
    columns = {name: np.arange(count) * 0.001 for name in POINTS} | {"timeStamp": np.arange(count) * 1e-4}
    write(file, Scan(columns, START_S))
    return file.read_bytes()


@pytest.mark.parametrize("tenth", [1, 5, 9])
def test_cut_off(tenth: int, content: bytes, file: Path) -> None:
    file.write_bytes(content[: len(content) * tenth // 10])
    _refused(file, "cut off|damaged")


@pytest.mark.parametrize("page", [0, 3, 7])
def test_every_page_is_checked(page: int, content: bytes, file: Path) -> None:
    """A bit anywhere, and the checksum of its page is wrong."""
    damaged = bytearray(content)
    damaged[page * 1024 + 500] ^= 1
    file.write_bytes(damaged)
    _refused(file, "is damaged")


def test_points_that_are_claimed_without_bytes(content: bytes, file: Path) -> None:
    """A count of points is compared with the size of the file; all checksums fit."""
    file.write_bytes(edited(content, b'recordCount="300"', b'recordCount="9999999999999999"'))
    _refused(file, r"claims 9999999999999999 records in .*laser\.max_records")
    file.write_bytes(edited(content, b'recordCount="300"', b'recordCount="310"'))
    columns, dropped = read("laser", file, "e57")
    assert rows(columns) == 300
    assert dropped == {"truncated": 10}


def test_header_that_claims_a_huge_xml(content: bytes, file: Path) -> None:
    file.write_bytes(content[:32] + struct.pack("<Q", 2**60) + content[40:])
    _refused(file, "header is damaged")


@pytest.mark.parametrize(
    "program", ["import os; os.abort()", "raise SystemExit", "import sys; sys.stdout.write('x' * 5000)"]
)
def test_end_of_the_worker_is_an_error_of_the_file(
    program: str, content: bytes, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker = tmp_path / "worker.py"
    worker.write_text(program)
    monkeypatch.setattr(e57_scans, "E57_WORKER", worker)
    _refused(file, "is damaged")
