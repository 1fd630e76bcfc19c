"""NovAtel INSPVA, INSPVAS and INSPVAX records, byte by byte."""

import struct
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PoolcalError, RawDataError
from pipeline.readers.novatel import NovatelPart
from tests.support.files.build import (
    ALIGNING,
    FREE,
    HIGH_VARIANCE,
    WEEK,
    bestpos,
    inspva,
    inspvas,
    inspvasa,
    inspvax,
    read,
    rows,
)

NS = 1_000_000_000
WEEK_NS = 604_800 * NS
MAKERS = {"inspva": inspva, "inspvas": inspvas, "inspvax": inspvax, "inspvasa": inspvasa}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.gps"


@pytest.mark.parametrize("form", MAKERS)
def test_values(form: str, file: Path) -> None:
    file.write_bytes(b"".join(MAKERS[form](1000 + k / 8) for k in range(9)))
    columns, dropped = read("ins", file, "novatel")
    assert not dropped
    assert columns["t_ns"].tolist() == [WEEK * WEEK_NS + 1000 * NS + k * NS // 8 for k in range(9)]
    expected = {
        "latitude_rad": np.radians(36), "longitude_rad": np.radians(120), "height_m": 50.0,
        "roll_rad": np.radians(1), "pitch_rad": np.radians(2), "azimuth_rad": np.radians(3),
    }  # fmt: skip
    for name, value in expected.items():
        assert columns[name] == pytest.approx(np.full(9, value), abs=1e-14), name


def test_time_keeps_its_nanoseconds(file: Path) -> None:
    """INSPVA(S) carry seconds as a double; the header's milliseconds would be too coarse."""
    file.write_bytes(inspvas(345_600.123456789) + inspvas(345_600.128456789))
    columns, _ = read("ins", file, "novatel")
    assert (columns["t_ns"] - WEEK * WEEK_NS).tolist() == [345_600_123_456_789, 345_600_128_456_789]


@pytest.mark.parametrize("latency_s", [0.01, -0.2])
def test_latency_is_taken_off(latency_s: float, file: Path) -> None:
    file.write_bytes(inspvas(10.0) + inspvas(10.1))
    columns, _ = read("ins", file, "novatel", latency_s=latency_s)
    assert columns["t_ns"][0] == WEEK * WEEK_NS + 10 * NS - round(latency_s * NS)


def test_azimuth_is_brought_into_one_turn(file: Path) -> None:
    file.write_bytes(inspvas(10.0, azimuth=-90.0) + inspvas(10.1, azimuth=359.9))
    columns, _ = read("ins", file, "novatel")
    assert np.degrees(columns["azimuth_rad"]) == pytest.approx([270.0, 359.9])


def test_status(file: Path) -> None:
    """Only solutions are used; every other state is counted by its name."""
    states = [ALIGNING, ALIGNING, HIGH_VARIANCE, 3, FREE, 7, 9, 10, 11, 12, 99]
    file.write_bytes(b"".join(inspvas(10.0 + k, status=state) for k, state in enumerate(states)))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 3
    assert dropped["ins status INS_ALIGNING"] == 2
    assert dropped["ins status INS_HIGH_VARIANCE"] == 1
    assert sum(dropped.values()) == 8


def test_only_aligning(file: Path) -> None:
    records = (inspvas(10.0 + k, status=ALIGNING, latitude=-90.0, longitude=0.0, height=-6e6) for k in range(5))
    file.write_bytes(b"".join(records))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 0
    assert dropped == {"ins status INS_ALIGNING": 5}


BAD = {
    "latitude": (float("nan"), 91.0, -90.0, 1e300),
    "longitude": (float("inf"), 400.0),
    "height": (float("nan"), 1e6),
    "roll": (float("nan"), 181.0),
    "pitch": (91.0,),
    "azimuth": (float("-inf"), 1e9),
    "week": (0, 12, 90_000),
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in BAD.items() for value in values])
def test_impossible_values(name: str, value: float, file: Path) -> None:
    bad = inspvas(11.0, **{name: value}) if name != "week" else inspvas(11.0).replace(b"", b"")
    if name == "week":
        from tests.support.files.build import pva, short

        bad = short(508, WEEK, 11.0, pva(11.0, week=int(value)))
    file.write_bytes(inspvas(10.0) + bad + inspvas(12.0))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 2
    assert sum(dropped.values()) == 1


@pytest.mark.parametrize("seconds", [float("nan"), -1.0, 2e6, 1e300])
def test_impossible_seconds(seconds: float, file: Path) -> None:
    from tests.support.files.build import pva, short

    file.write_bytes(inspvas(10.0) + short(508, WEEK, 11.0, pva(seconds)) + inspvas(12.0))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 2
    assert sum(dropped.values()) == 1


# --- several kinds in one file ---------------------------------------------------------------------------------------
def test_ellipsoidal_heights_go_before_heights_above_sea_level(file: Path) -> None:
    file.write_bytes(b"".join(inspvas(10.0 + k) + inspvax(10.0 + k, height=41.0) for k in range(10)) + bestpos(20.0))
    columns, dropped = read("ins", file, "novatel")
    assert columns["height_m"].tolist() == [50.0] * 10
    assert dropped == {"INSPVAX beside INSPVAS": 10}


def test_few_inspva_do_not_displace_many_inspvax(file: Path) -> None:
    """INSPVA logged once a second beside INSPVAX at the full rate."""
    records = [inspvax(10.0 + k / 50, height=41.0, undulation=9.5) for k in range(100)]
    records[50:50] = [inspva(11.0)]
    file.write_bytes(b"".join(records))
    columns, dropped = read("ins", file, "novatel")
    assert columns["height_m"].tolist() == [50.5] * 100
    assert dropped == {"INSPVA beside INSPVAX": 1}


def test_unusable_records_do_not_decide(file: Path) -> None:
    aligning = b"".join(inspvas(10.0 + k, status=ALIGNING) for k in range(9))
    file.write_bytes(aligning + b"".join(inspvax(20.0 + k) for k in range(3)))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 3
    assert dropped == {"INSPVAS beside INSPVAX": 9}


def test_without_any_of_them(file: Path) -> None:
    file.write_bytes(bestpos(1.0) * 3)
    try:
        columns, dropped = read("ins", file, "novatel")
    except RawDataError as error:
        assert "INSPVA" in str(error)
    else:
        assert rows(columns) == 0
        assert sum(dropped.values()) == 3


# --- damage ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("form", MAKERS)
def test_wrong_checksum(form: str, file: Path) -> None:
    make = MAKERS[form]
    spoilt = bytearray(make(11.0))
    place = 40 if form != "inspvasa" else bytes(spoilt).index(b"36.0")
    spoilt[place] ^= 1
    file.write_bytes(make(10.0) + bytes(spoilt) + make(12.0) + make(13.0))
    columns, dropped = read("ins", file, "novatel")
    assert (columns["t_ns"] // NS % 604_800).tolist() == [10, 12, 13]
    assert sum(dropped.values()) >= 1


@pytest.mark.parametrize("form", MAKERS)
def test_noise_between_records(form: str, file: Path) -> None:
    make = MAKERS[form]
    noise = b"\x00\xffnoise\xaa\x44\x12" if form != "inspvasa" else b"noise # % \r\n"
    file.write_bytes(make(10.0) + noise + make(11.0) + noise * 3 + make(12.0) + make(13.0))
    columns, dropped = read("ins", file, "novatel")
    assert (columns["t_ns"] // NS % 604_800).tolist()[-1] == 13
    assert rows(columns) >= 3
    assert sum(dropped.values()) >= 1


def test_record_that_claims_to_be_long(file: Path) -> None:
    """A length of 65535 in a header must not swallow the rest of the file."""
    lying = bytearray(inspva(11.0))
    lying[8:10] = struct.pack("<H", 65_535)
    file.write_bytes(inspva(10.0) + bytes(lying) + b"".join(inspva(12.0 + k) for k in range(2000)))
    columns, _ = read("ins", file, "novatel")
    assert rows(columns) >= 1995


@pytest.mark.parametrize("line_end", [b"\r\n", b"\n", b"\r\n\r\n"])
def test_line_ends(line_end: bytes, file: Path) -> None:
    text = b"".join(inspvasa(10.0 + k / 100) for k in range(1000))  # more than the reader takes at a time
    file.write_bytes(text.replace(b"\r\n", line_end))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 1000
    assert not dropped


def test_mixed_ascii_and_binary(file: Path) -> None:
    file.write_bytes(inspvasa(10.0) + inspvas(11.0) + inspvasa(12.0) + inspvas(13.0))
    columns, _ = read("ins", file, "novatel")
    assert (columns["t_ns"] // NS % 604_800).tolist() == [10, 11, 12, 13]


@pytest.mark.parametrize("form", MAKERS)
@pytest.mark.parametrize("tenth", range(1, 10))
def test_cut_at_each_tenth(form: str, tenth: int, file: Path) -> None:
    records = [MAKERS[form](10.0 + k) for k in range(20)]
    whole = b"".join(records)
    cut = len(whole) * tenth // 10 + 5
    file.write_bytes(whole[:cut])
    before = sum(end <= cut for end in np.cumsum([len(record) for record in records]))
    try:
        columns, dropped = read("ins", file, "novatel")
    except PoolcalError as error:
        assert before == 0
        assert "\n" not in str(error)
        return
    assert rows(columns) == before
    assert sum(dropped.values()) >= 1


# --- order of time ---------------------------------------------------------------------------------------------------
def test_a_few_steps_back_are_left_out(file: Path) -> None:
    seconds = [10.0 + k / 100 for k in range(1000)]
    seconds[500:500] = seconds[495:500]
    file.write_bytes(b"".join(map(inspvas, seconds)))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 1000
    assert np.all(np.diff(columns["t_ns"]) > 0)
    assert sum(dropped.values()) == 5


def test_time_that_runs_backwards(file: Path) -> None:
    file.write_bytes(b"".join(inspvas(100.0 - k / 10) for k in range(100)))
    with pytest.raises(RawDataError, match="backwards in 99 of 100 records"):
        read("ins", file, "novatel")


def test_week_boundary(file: Path) -> None:
    file.write_bytes(inspvas(604_799.9) + inspvas(0.1, week=WEEK + 1))
    columns, _ = read("ins", file, "novatel")
    assert np.diff(columns["t_ns"]).tolist() == [200_000_000]


def test_file_that_vanishes(tmp_path: Path) -> None:
    with pytest.raises(RawDataError, match=r"gone\.gps: cannot be read"):
        list(NovatelPart(tmp_path / "gone.gps", "gone.gps", 0.0).chunks())


STAMPS = (b"2001,97200,1526266800,2018/05/14 03:00:00.323 ", b"2018/05/14 03:00:00.323,", b"03:00:00\t", b"[12] ")


@pytest.mark.parametrize("stamp", STAMPS)
def test_lines_behind_a_loggers_stamp(stamp: bytes, file: Path) -> None:
    """All are read; of three that are damaged, cut or without a checksum each is counted, apart from the stamps."""
    lines = [inspvasa(1000 + k / 10) for k in range(50)]
    file.write_bytes(b"".join(stamp + line for line in lines))
    columns, dropped = read("ins", file, "novatel")
    assert columns["t_ns"].tolist() == [WEEK * WEEK_NS + 1000 * NS + k * NS // 10 for k in range(50)]
    assert set(dropped) <= {"text between records"}
    lines[10] = lines[10].replace(b"36.", b"37.", 1)
    lines[20] = lines[20].split(b"*")[0] + b"\r\n"
    lines[30] = lines[30][:60] + b"\r\n"
    file.write_bytes(b"".join(stamp + line for line in lines))
    columns, dropped = read("ins", file, "novatel")
    assert rows(columns) == 47
    assert dropped["undecodable bytes"] == 3
