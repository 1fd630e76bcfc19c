"""SBET, record by record."""

import struct
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ConfigError, RawDataError
from tests.support.files.build import WEEK, read, rows, sbet, sbet_row

NS = 1_000_000_000
WEEK_NS = 604_800 * NS


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.out"


def test_values(file: Path) -> None:
    file.write_bytes(sbet(1000.0, 1000.005, 1000.01))
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert not dropped
    assert (columns["t_ns"] - WEEK * WEEK_NS).tolist() == [1_000_000_000_000, 1_000_005_000_000, 1_000_010_000_000]
    expected = {"latitude_rad": 0.6, "longitude_rad": 2.0, "height_m": 50.0, "roll_rad": 0.01, "pitch_rad": 0.02}
    for name, value in expected.items():
        assert columns[name].tolist() == [value] * 3, name
    assert columns["azimuth_rad"].tolist() == [0.75] * 3  # platform heading - wander


def test_heading_minus_wander_stays_in_one_turn(file: Path) -> None:
    headings = [(0.1, 0.3), (6.2, -0.3), (-3.0, 0.0)]
    file.write_bytes(b"".join(struct.pack("<17d", *sbet_row(10.0 + k, *pair)) for k, pair in enumerate(headings)))
    columns, _ = read("ins", file, "sbet", gps_week=WEEK)
    assert columns["azimuth_rad"] == pytest.approx([2 * np.pi - 0.2, 6.5 - 2 * np.pi, 2 * np.pi - 3.0])


def test_seconds_that_start_again_with_the_week(file: Path) -> None:
    file.write_bytes(sbet(604_799.0, 604_799.5, 0.0, 0.5))
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert not dropped
    since_ns = columns["t_ns"] - (WEEK + 1) * WEEK_NS
    assert since_ns.tolist() == [-NS, -NS // 2, 0, NS // 2]


def test_seconds_that_run_on_beyond_the_week(file: Path) -> None:
    file.write_bytes(sbet(604_799.5, 604_800.0, 604_800.5))
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert not dropped
    assert np.diff(columns["t_ns"]).tolist() == [NS // 2, NS // 2]


@pytest.mark.parametrize("latency_s", [0.02, -0.1])
def test_latency_is_taken_off(latency_s: float, file: Path) -> None:
    file.write_bytes(sbet(10.0, 10.1))
    columns, _ = read("ins", file, "sbet", gps_week=WEEK, latency_s=latency_s)
    assert columns["t_ns"][0] == WEEK * WEEK_NS + 10 * NS - round(latency_s * NS)


@pytest.mark.parametrize("stray", range(8))
def test_up_to_seven_stray_bytes_are_counted(stray: int, file: Path) -> None:
    file.write_bytes(sbet(10.0, 10.1) + b"\n" * stray)
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert rows(columns) == 2
    assert dropped == ({"stray bytes at the end": stray} if stray else {})


@pytest.mark.parametrize("stray", [8, 68, 135])
def test_cut_off(stray: int, file: Path) -> None:
    file.write_bytes(sbet(10.0, 10.1) + sbet(10.2)[:stray])
    with pytest.raises(RawDataError, match=rf"a\.out: .*{stray} bytes.*copy") as error:
        read("ins", file, "sbet", gps_week=WEEK)
    assert "\n" not in str(error.value)


def test_without_week(file: Path) -> None:
    file.write_bytes(sbet(10.0))
    with pytest.raises(ConfigError, match=r"ins\.gps_week.*a\.out.*GPS week"):
        read("ins", file, "sbet")


NAN, INF = float("nan"), float("inf")
BAD = [(0, NAN), (0, -5.0), (0, 1e12), (1, NAN), (1, 2.0), (1, -np.pi / 2), (2, INF), (3, NAN), (3, 1e9), (7, NAN),
       (7, 4.0), (8, 1.6), (9, NAN), (9, 1e300), (10, INF)]  # fmt: skip


@pytest.mark.parametrize(("field", "value"), BAD)
def test_impossible_values(field: int, value: float, file: Path) -> None:
    bad = sbet_row(10.1)
    bad[field] = value
    file.write_bytes(sbet(10.0) + struct.pack("<17d", *bad) + sbet(10.2))
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert (columns["t_ns"] - WEEK * WEEK_NS).tolist() == [10 * NS, 10 * NS + NS // 5]
    assert sum(dropped.values()) == 1


def test_a_few_steps_back_are_left_out(file: Path) -> None:
    seconds = [10.0 + k / 100 for k in range(1000)]
    seconds[500:500] = seconds[495:500]
    file.write_bytes(sbet(*seconds))
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert rows(columns) == 1000
    assert np.all(np.diff(columns["t_ns"]) > 0)
    assert sum(dropped.values()) == 5


def test_time_that_runs_backwards(file: Path) -> None:
    file.write_bytes(sbet(*(100.0 - k / 10 for k in range(100))))
    with pytest.raises(RawDataError, match="backwards in 99 of 100 records"):
        read("ins", file, "sbet", gps_week=WEEK)


def test_times_of_single_precision(file: Path) -> None:
    file.write_bytes(sbet(*np.unique((345_600 + np.arange(1000) / 200).astype(np.float32)).astype(float)))
    with pytest.raises(RawDataError, match="float32"):
        read("ins", file, "sbet", gps_week=WEEK)


@pytest.mark.parametrize("rate_hz", [1, 2, 4, 8])
def test_round_times_are_no_single_precision(rate_hz: int, file: Path) -> None:
    file.write_bytes(sbet(*(345_600 + np.arange(500) / rate_hz)))
    columns, dropped = read("ins", file, "sbet", gps_week=WEEK)
    assert rows(columns) == 500
    assert not dropped


def test_accuracies_are_no_trajectory(file: Path) -> None:
    records = [struct.pack("<10d", 345_600 + k / 2, *[0.02] * 6, 0.2, 0.2, 0.5) for k in range(200)]
    file.write_bytes(b"".join(records))
    with pytest.raises(RawDataError, match=r"accuracy.*give the SBET"):
        read("ins", file, "sbet", gps_week=WEEK)
