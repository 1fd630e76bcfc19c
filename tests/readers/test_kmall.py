"""Kongsberg .kmall: signs, times, what is left out, what is refused, and damage; files made byte by byte."""

import io
import struct
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.config.session import Mbes
from pipeline.errors import RawDataError
from pipeline.readers import kmall, sounding_chunks
from pipeline.readers.dispatch import raw_parts
from pipeline.readers.kmall_datagrams import kmall_datagrams
from tests.support.files.build import GPS_2024, MOUNT, UTC_2024, read, rows
from tests.support.files.sonar_files import ANGLES_DEG, datagram, mrz, sounding
from tests.support.files.sonar_files import kmall as made

NS = 10**9
FAN = [sounding(n, angle, 0.008) for n, angle in enumerate(ANGLES_DEG)]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.kmall"


def test_values_signs_and_times(file: Path) -> None:
    """Kongsberg's port + becomes starboard +; UTC becomes GPS."""
    file.write_bytes(made(2))
    columns, dropped = read("mbes", file, "kmall")
    assert not dropped
    assert columns["t_ns"].tolist() == [(GPS_2024 + k) * NS + 250_000_000 for k in (0, 1) for _ in range(5)]
    assert columns["ping"].tolist() == [500] * 5 + [501] * 5
    assert columns["beam"].tolist() == [0, 1, 2, 3, 4] * 2
    assert np.degrees(columns["angle_rad"][:5]) == pytest.approx([-60.0, -30.0, 0.0, 30.0, 60.0], abs=1e-6)
    assert columns["two_way_time_s"][:5] == pytest.approx([0.007, 0.0071, 0.0072, 0.0073, 0.0074], rel=1e-6)
    assert np.all(columns["sound_speed_m_s"] == 1480.0)


def test_each_sector_has_its_own_time(file: Path) -> None:
    fan = [sounding(n, angle, 0.008, sector=sector) for n, (angle, sector) in enumerate(((40, 1), (0, 0), (-40, 2)))]
    file.write_bytes(mrz(1, fan, delays_s=(0.0, 0.00022, 0.00044)))
    columns, _ = read("mbes", file, "kmall", latency_s=0.001)
    assert (columns["t_ns"] - GPS_2024 * NS).tolist() == [-780_000, -1_000_000, -560_000]


def test_extra_and_rejected_detections_are_left_out(file: Path) -> None:
    fan = [sounding(0, 10.0, 0.008), sounding(1, 5.0, 0.008, kind=2), sounding(2, 0.0, 0.008, kind=1)]
    file.write_bytes(mrz(1, fan, extra=1))
    columns, dropped = read("mbes", file, "kmall")
    assert columns["beam"].tolist() == [0]
    assert dropped == {"extra detection": 1, "rejected detection": 1}


def test_longer_soundings_of_later_versions(file: Path) -> None:
    """The size that the datagram gives for a sounding is what counts."""
    fan = [sounding(n, angle, 0.008, size=136) for n, angle in enumerate(ANGLES_DEG)]
    file.write_bytes(mrz(1, fan, size=136))
    columns, dropped = read("mbes", file, "kmall")
    assert not dropped
    assert np.degrees(columns["angle_rad"]) == pytest.approx([-60.0, -30.0, 0.0, 30.0, 60.0], abs=1e-6)


def test_soundings_are_the_library_s(file: Path) -> None:
    """Our layout of a sounding against pykmall's, field by field."""
    from KMALL import kmall as library

    content = mrz(9, FAN, delays_s=(0.0, 0.1))
    reader: Any = library()
    reader.FID = io.BytesIO(content)
    theirs = reader.read_EMdgmMRZ()
    ours = kmall.decode_mrz(content, {})
    assert ours is not None
    assert ours.angle_deg.tolist() == list(theirs["sounding"]["beamAngleReRx_deg"])
    assert ours.two_way_time_s.tolist() == list(theirs["sounding"]["twoWayTravelTime_sec"])
    assert ours.number == theirs["cmnPart"]["pingCnt"] == 9


FANS = [sounding(n, angle, 0.008, sector=sector) for n, (angle, sector) in enumerate(((50, 0), (0, 1), (-50, 2)))]


# --- refused ---------------------------------------------------------------------------------------------------------
def test_a_ping_that_is_there_twice_counts_once(file: Path) -> None:
    """Two swaths of one ping have its number as well, and are two."""
    first, second = (mrz(1, FANS, delays_s=(0.0,) * 3, swath=swath) for swath in (0, 1))
    file.write_bytes(first + first + second + first)
    columns, dropped = read("mbes", file, "kmall")
    assert columns["ping"].tolist() == [1] * 6
    assert dropped == {"repeated ping": 2}


def test_several_receivers_are_refused(file: Path) -> None:
    file.write_bytes(mrz(1, FAN) + mrz(2, FAN, receiver=1))
    with pytest.raises(RawDataError, match=r"a\.kmall: .*dual head.*log one head alone") as error:
        read("mbes", file, "kmall")
    assert "\n" not in str(error.value)


def test_a_single_beam_is_refused(file: Path) -> None:
    file.write_bytes(mrz(1, FAN[:1]) + mrz(2, FAN[:1]))
    with pytest.raises(RawDataError, match=r"a\.kmall: .*one beam.*multibeam") as error:
        read("mbes", file, "kmall")
    assert "\n" not in str(error.value)


# --- damage ----------------------------------------------------------------------------------------------------------
def test_damaged_datagrams_are_counted_and_the_rest_is_read(file: Path) -> None:
    one, other = mrz(1, FAN), mrz(2, FAN)
    parted = mrz(3, FAN, parts=2)
    beyond = mrz(4, [sounding(0, 0.0, 0.008, sector=5)])
    file.write_bytes(one + parted + beyond + other)
    columns, dropped = read("mbes", file, "kmall")
    assert sorted(set(columns["ping"].tolist())) == [1, 2]
    assert dropped == {"damaged datagram": 2}


def test_lost_bytes_lose_one_ping(file: Path) -> None:
    pings = [mrz(k, FAN) for k in range(5)]
    file.write_bytes(pings[0] + pings[1] + pings[2][:-30] + pings[3] + pings[4])
    columns, dropped = read("mbes", file, "kmall")
    assert sorted(set(columns["ping"].tolist())) == [0, 1, 3, 4]
    assert dropped == {"stray bytes": 1}


def test_cut_anywhere(file: Path) -> None:
    content = made(3)
    whole = len(mrz(0, FAN))
    for length in range(40, len(content), 97):
        file.write_bytes(content[:length])
        columns, dropped = read("mbes", file, "kmall")
        assert rows(columns) % 5 == 0
        assert rows(columns) >= 5 * ((length - 60) // (whole + 64) - 1)
        assert set(dropped) <= {"truncated datagram", "stray bytes"}


def test_impossible_clock_speed_and_times(file: Path) -> None:
    file.write_bytes(mrz(1, FAN, seconds=100) + mrz(2, FAN, speed_m_s=0.0) + mrz(3, [sounding(0, 0.0, 0.0)]))
    columns, dropped = read("mbes", file, "kmall")
    assert not rows(columns)
    assert dropped == {"impossible time (clock not set)": 5, "impossible sound speed": 5, "no detection": 1}


def test_numbers_that_are_none(file: Path) -> None:
    """Signalling ones too, at which processors warn."""
    content = bytearray(mrz(1, FAN))
    at = content.index(struct.pack("<f", 30.0))
    content[at : at + 4] = b"\1\0\x80\x7f"
    file.write_bytes(content)
    columns, dropped = read("mbes", file, "kmall")
    assert rows(columns) == 4
    assert dropped == {"not a finite number": 1}


def test_lengths_that_claim_more_than_there_is(file: Path) -> None:
    """Neither time nor memory for a million datagrams of no length, or one of 4 GB."""
    claims = (struct.pack("<I4s", 0, b"#MRZ") + bytes(16)) * 5000 + struct.pack("<I4s", 2**32 - 1, b"#MRZ")
    file.write_bytes(datagram(b"#IIP", bytes(20)) + claims + made(1))
    columns, dropped = read("mbes", file, "kmall")
    assert rows(columns) == 5
    assert dropped == {"stray bytes": 1}


def test_chunks_stay_small(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sounding_chunks, "CHUNK_SOUNDINGS", 10)
    file.write_bytes(made(7))
    (part,) = raw_parts("mbes", Mbes(files=[file.name], format="kmall", mount=MOUNT), file.parent)
    assert [len(chunk.columns["beam"]) for chunk in part.chunks()] == [10, 10, 10, 5]


def test_only_mrz_is_looked_into(file: Path) -> None:
    content = datagram(b"#MWC", bytes(500)) + datagram(b"#SVP", bytes(10))
    dropped: Counter[str] = Counter()
    assert list(kmall_datagrams(io.BytesIO(content), dropped)) == []
    assert not dropped


def test_unix_time_is_the_datagram_s() -> None:
    ping = kmall.decode_mrz(mrz(1, FAN, seconds=UTC_2024, nanoseconds=5), {})
    assert ping is not None
    assert ping.t_ns == GPS_2024 * NS + 5
