"""GSF: signs, scale factors, sound speeds, what is left out and damage; files made byte by byte."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.config.session import Mbes
from pipeline.errors import RawDataError
from pipeline.readers import gsf_pings, sounding_chunks
from pipeline.readers.dispatch import raw_parts
from tests.support.files.build import GPS_2024, MOUNT, read, rows
from tests.support.files.sonar_files import (
    SCALES,
    gsf_header,
    gsf_ping,
    profile,
    record,
    scale_factors,
    seabat,
)
from tests.support.files.sonar_files import gsf as made

NS = 10**9
SOUND = SCALES + seabat(1480.0)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.gsf"


def test_values_signs_and_times(file: Path) -> None:
    """Port + becomes starboard +; UTC becomes GPS; the scale factors of the first ping hold for the second."""
    file.write_bytes(made(2))
    columns, dropped = read("mbes", file, "gsf", latency_s=0.25)
    assert not dropped
    assert columns["t_ns"].tolist() == [(GPS_2024 + k) * NS for k in (0, 1) for _ in range(5)]
    assert columns["ping"].tolist() == [0] * 5 + [1] * 5
    assert columns["beam"].tolist() == [0, 1, 2, 3, 4] * 2
    assert np.degrees(columns["angle_rad"][5:]) == pytest.approx([-60.0, -30.0, 0.0, 30.0, 60.0])
    assert columns["two_way_time_s"][5:] == pytest.approx([0.009, 0.008, 0.007, 0.008, 0.009])
    assert np.all(columns["sound_speed_m_s"] == 1480.0)


def test_scale_factors_have_an_offset_and_change(file: Path) -> None:
    """value = stored / multiplier - offset, from the ping on that says so."""
    other = scale_factors(time=(2_000_000, 0), angle=(200, 10))
    pings = (gsf_ping(0, extra=SOUND), gsf_ping(1, extra=other + seabat(1480.0)), gsf_ping(2, extra=seabat(1480.0)))
    file.write_bytes(gsf_header() + b"".join(pings))
    columns, _ = read("mbes", file, "gsf")
    assert np.degrees(columns["angle_rad"]).reshape(3, 5)[:, 0] == pytest.approx([-60.0, -20.0, -20.0])
    assert columns["two_way_time_s"].reshape(3, 5)[:, 0] == pytest.approx([0.009, 0.0045, 0.0045])


# --- sound speed -----------------------------------------------------------------------------------------------------
def test_sound_speed_of_the_sensor_comes_first(file: Path) -> None:
    file.write_bytes(gsf_header() + profile((0.5, 1450.0)) + gsf_ping(extra=SOUND))
    assert np.all(read("mbes", file, "gsf", sound_speed_m_s=1500.0)[0]["sound_speed_m_s"] == 1480.0)


def test_then_the_top_of_the_last_profile(file: Path) -> None:
    first = profile((0.5, 1450.0)) + gsf_ping(0, extra=SCALES + seabat(0.0))
    file.write_bytes(gsf_header() + first + profile((3.0, 1460.0), (0.2, 1462.5)) + gsf_ping(1))
    speeds = read("mbes", file, "gsf", sound_speed_m_s=1500.0)[0]["sound_speed_m_s"]
    assert speeds.tolist() == [1450.0] * 5 + [1462.5] * 5


def test_then_that_of_the_session(file: Path) -> None:
    file.write_bytes(gsf_header() + gsf_ping(extra=SCALES))
    assert np.all(read("mbes", file, "gsf", sound_speed_m_s=1500.0)[0]["sound_speed_m_s"] == 1500.0)
    with pytest.raises(RawDataError, match=r"a\.gsf: has no sound speed.*give mbes\.sound_speed_m_s") as error:
        read("mbes", file, "gsf")
    assert "\n" not in str(error.value)


# --- left out --------------------------------------------------------------------------------------------------------
def test_flagged_pings_and_beams(file: Path) -> None:
    """The lowest bit is what counts."""
    pings = gsf_ping(0, extra=SOUND, flags=(1, 0, 2, 5, 4)), gsf_ping(1, extra=seabat(1480.0), ping_flags=3)
    file.write_bytes(gsf_header() + b"".join(pings) + gsf_ping(2, extra=seabat(1480.0), ping_flags=2))
    columns, dropped = read("mbes", file, "gsf")
    assert list(zip(columns["ping"].tolist(), columns["beam"].tolist(), strict=True)) == [
        (0, 1), (0, 2), (0, 4), *((2, beam) for beam in range(5))
    ]  # fmt: skip
    assert dropped == {"flagged as not usable": 7}


def test_angles_that_overflowed(file: Path) -> None:
    """-45.0 degrees at 800 steps a degree are -36000, beyond 16 bits: +36.92 comes back."""
    degrees = np.linspace(40.0, -45.0, 86)
    stored = (np.rint(degrees * 800).astype(np.int64) + 2**15) % 2**16 - 2**15
    assert stored[-1] / 800 == pytest.approx(36.92)
    factors = scale_factors(time=(1_000_000, 0), angle=(800, 0)) + seabat(1480.0)
    fine = (np.linspace(40.0, -40.0, 86) * 800).astype(int)
    pings = [gsf_ping(k, [9000] * 86, list(one), factors, beams=86) for k, one in enumerate((stored, fine))]
    file.write_bytes(gsf_header() + b"".join(pings))
    columns, dropped = read("mbes", file, "gsf")
    assert set(columns["ping"].tolist()) == {1}
    assert dropped == {"angles of the ping jump": 86}


def test_impossible_times_and_no_detections(file: Path) -> None:
    pings = gsf_ping(0, times=(0, 8000, 7000, 8000, 0), extra=SOUND), gsf_ping(1, extra=seabat(1480.0), seconds=100)
    file.write_bytes(gsf_header() + b"".join(pings))
    columns, dropped = read("mbes", file, "gsf")
    assert columns["beam"].tolist() == [1, 2, 3]
    assert dropped == {"no detection": 2, "impossible time (clock not set)": 5}


# --- refused ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("more", "what"), [({"times": None}, "travel times"), ({"angles": None}, "beam angles")])
def test_soundings_without_times_or_angles(more: dict[str, None], what: str, file: Path) -> None:
    file.write_bytes(gsf_header() + gsf_ping(extra=SOUND, **more))
    with pytest.raises(RawDataError, match=rf"a\.gsf: its pings have no {what}, only positions of soundings") as error:
        read("mbes", file, "gsf")
    assert "\n" not in str(error.value)
    file.write_bytes(gsf_header() + gsf_ping(extra=SOUND) + gsf_ping(1, **more))
    columns, dropped = read("mbes", file, "gsf")
    assert rows(columns) == 5
    assert dropped == {"ping without times or angles": 1}


# --- damage ----------------------------------------------------------------------------------------------------------
def test_damaged_records_are_counted_and_the_rest_is_read(file: Path) -> None:
    good = [gsf_ping(k, extra=SOUND, checked=True) for k in range(4)]
    wrong = bytearray(good[1])
    wrong[60] ^= 4
    short = gsf_ping(2, angles=(1, 2, 3), extra=SOUND)
    file.write_bytes(gsf_header() + good[0] + bytes(wrong) + short + good[3])
    columns, dropped = read("mbes", file, "gsf")
    assert columns["t_ns"].tolist() == [(GPS_2024 + k) * NS + 250_000_000 for k in (0, 3) for _ in range(5)]
    assert dropped == {"damaged record": 2}


def test_pings_whose_scale_factors_are_lost(file: Path) -> None:
    file.write_bytes(gsf_header() + gsf_ping(0) + gsf_ping(1, extra=SOUND))
    columns, dropped = read("mbes", file, "gsf")
    assert rows(columns) == 5
    assert dropped == {"damaged record": 1}


def test_lost_bytes_lose_one_ping(file: Path) -> None:
    pings = [gsf_ping(k, extra=SOUND) for k in range(5)]
    file.write_bytes(gsf_header() + pings[0] + pings[1] + pings[2][:-20] + pings[3] + pings[4])
    columns, dropped = read("mbes", file, "gsf")
    seconds = columns["t_ns"] // NS - GPS_2024
    assert {0, 1, 4} <= set(seconds.tolist())
    assert rows(columns) >= 15
    assert dropped


def test_cut_anywhere(file: Path) -> None:
    content = made(4)
    for length in range(30, len(content), 31):
        file.write_bytes(content[:length])
        columns, dropped = read("mbes", file, "gsf")
        assert rows(columns) == 5 * min(4, _whole_pings(content, length))
        assert set(dropped) <= {"truncated record", "stray bytes"}


def _whole_pings(content: bytes, length: int) -> int:
    ends, at = [], len(gsf_header())
    while at < len(content):
        at += 8 + int.from_bytes(content[at : at + 4], "big")
        ends.append(at)
    return sum(end <= length for end in ends)


def test_other_records_are_passed_over(file: Path) -> None:
    others = record(6, b"comment" * 4) + record(12, bytes(40)) + record(4, bytes(60))
    file.write_bytes(gsf_header() + others + gsf_ping(extra=SOUND) + others)
    columns, dropped = read("mbes", file, "gsf")
    assert rows(columns) == 5
    assert not dropped


def test_chunks_stay_small(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sounding_chunks, "CHUNK_SOUNDINGS", 10)
    file.write_bytes(made(7))
    (part,) = raw_parts("mbes", Mbes(files=[file.name], format="gsf", mount=MOUNT), file.parent)
    assert [len(chunk.columns["beam"]) for chunk in part.chunks()] == [10, 10, 10, 5]


def test_a_ping_that_is_there_twice_counts_once(file: Path) -> None:
    pings = gsf_ping(0, extra=SOUND) + gsf_ping(1, extra=seabat(1480.0))
    file.write_bytes(gsf_header() + pings + pings)
    columns, dropped = read("mbes", file, "gsf")
    assert columns["ping"].tolist() == [0] * 5 + [1] * 5
    assert dropped == {"repeated ping": 2}


def test_angles_that_are_infinite_are_counted_without_a_warning(recwarn: pytest.WarningsRecorder) -> None:
    assert not gsf_pings.angles_are_smooth(np.array([60.0, np.inf, np.inf, -60.0]))
    assert not recwarn
