"""R2Sonic packets, alone and in XTF, byte by byte."""

import struct
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PoolcalError, RawDataError
from tests.support.files import build
from tests.support.files.build import (
    GPS_2024,
    a0,
    a2,
    bth0,
    h0,
    ping,
    read,
    rows,
    scaled,
    section,
    xtf,
    xtf_header,
    xtf_record,
)

NS = 1_000_000_000


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.r2s"


def times(file: Path) -> list[int]:
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    return np.unique(columns["t_ns"]).tolist()


def test_a2_packet(file: Path) -> None:
    file.write_bytes(
        bth0(
            h0(77, 3, nanoseconds=123_456_789, sound_speed=1480.5),
            scaled(b"R0", 0.25, [4, 8, 12]),
            a2(-1.0, 2.0**-17, [0, 65535, 65535]),  # the sum needs more than 16 bits
        )
    )
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    assert columns["t_ns"].tolist() == [GPS_2024 * NS + 123_456_789] * 3
    assert columns["ping"].tolist() == [77, 77, 77]
    assert columns["beam"].tolist() == [0, 1, 2]
    assert columns["two_way_time_s"].tolist() == [1.0, 2.0, 3.0]
    assert columns["angle_rad"].tolist() == [-1.0, -1.0 + 65535 * 2.0**-17, -1.0 + 131070 * 2.0**-17]
    assert columns["sound_speed_m_s"].tolist() == [1480.5] * 3


@pytest.mark.parametrize(("steering", "words"), [(-0.01, r"-0\.57°"), (0.0002, r"\+0\.01°")])
def test_a_fan_steered_along_track_is_refused(file: Path, steering: float, words: str) -> None:
    file.write_bytes(ping(8) + ping(9, steering=steering))
    with pytest.raises(RawDataError, match=rf"ping 9 .* by {words} along track; switch pitch stabilisation off"):
        read("mbes", file, "r2sonic")


@pytest.mark.parametrize("steering", [0.00005, 0.7, np.nan])
def test_no_steering_and_an_impossible_one(file: Path, steering: float) -> None:
    """What rounding leaves is no steering; what no head can do is damage, and is counted."""
    file.write_bytes(ping(8) + ping(9, steering=steering))
    columns, dropped = read("mbes", file, "r2sonic")
    assert (len(np.unique(columns["ping"])), sum(dropped.values())) == ((2, 0) if steering < 0.1 else (1, 1))


def test_a2_values(file: Path) -> None:
    file.write_bytes(ping(9, points=5, nanoseconds=500, sound_speed=1481.5))
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    assert columns["t_ns"].tolist() == [GPS_2024 * NS + 500] * 5
    assert columns["sound_speed_m_s"].tolist() == [1481.5] * 5
    scale = struct.unpack(">f", struct.pack(">f", 1e-4))[0]
    assert columns["angle_rad"] == pytest.approx(-0.5 + scale * np.array([0, 2000, 4000, 6000, 8000]), abs=1e-15)
    tick = struct.unpack(">f", struct.pack(">f", 4e-6))[0]
    assert columns["two_way_time_s"] == pytest.approx(tick * np.array([1000, 1010, 1020, 1030, 1040]), rel=1e-15)


@pytest.mark.parametrize("points", [1, 2, 5, 256])
def test_a0_is_linear_with_both_ends(points: int, file: Path) -> None:
    file.write_bytes(bth0(h0(1, points), scaled(b"R0", 1e-5, [500] * points), a0(-1.0, 0.5)))
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    step = 1.5 / (points - 1) if points > 1 else 0.0
    assert columns["angle_rad"] == pytest.approx(-1.0 + step * np.arange(points), abs=1e-15)


@pytest.mark.parametrize("points", range(1, 10))
def test_odd_numbers_of_points_are_padded(points: int, file: Path) -> None:
    file.write_bytes(ping(1, points) + ping(2, points, seconds=build.UTC_2024 + 1))
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    assert columns["ping"].tolist() == [1] * points + [2] * points
    assert columns["beam"].tolist() == 2 * list(range(points))


def test_sections_in_any_order_and_unknown_ones(file: Path) -> None:
    unknown = section(b"Z9", b"A2R0H0BTH0\xff\xff\xff\xff")
    file.write_bytes(bth0(unknown, a0(-0.1, 0.1), section(b"V0", b""), h0(5, 1), unknown, scaled(b"R0", 1.0, [1])))
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    assert columns["ping"].tolist() == [5]


BROKEN = {
    "section of size 0": bth0(h0(1, 2), struct.pack(">2sH", b"X0", 0), scaled(b"R0", 1e-5, [9, 9]), a0(-1, 1)),
    "section of size 3": bth0(h0(1, 2), struct.pack(">2sH", b"X0", 3), scaled(b"R0", 1e-5, [9, 9]), a0(-1, 1)),
    "section beyond the packet": bth0(h0(1, 2), scaled(b"R0", 1e-5, [9, 9]), struct.pack(">2sH8x", b"A0", 4000)),
    "more points than ranges": bth0(h0(1, 9), scaled(b"R0", 1e-5, [9, 9]), a0(-1, 1)),
    "more points than steps": bth0(h0(1, 4), scaled(b"R0", 1e-5, [9] * 4), a2(-1, 1e-4, [0, 1])),
    "no H0": bth0(scaled(b"R0", 1e-5, [9, 9]), a0(-1, 1)),
    "no R0": bth0(h0(1, 2), a0(-1, 1)),
    "no angles": bth0(h0(1, 2), scaled(b"R0", 1e-5, [9, 9])),
    "short H0": bth0(section(b"H0", b"2024"), scaled(b"R0", 1e-5, [9, 9]), a0(-1, 1)),
    "a billion nanoseconds": bth0(h0(1, 2, nanoseconds=10**9), scaled(b"R0", 1e-5, [9, 9]), a0(-1, 1)),
}


@pytest.mark.parametrize("what", BROKEN)
@pytest.mark.parametrize("shell", [b"".join, lambda packets: xtf(*packets)], ids=["bare", "xtf"])
def test_damaged_packet_between_good_ones(what: str, shell, file: Path) -> None:
    file.write_bytes(shell([ping(1), BROKEN[what], ping(3)]))
    columns, dropped = read("mbes", file, "r2sonic")
    assert np.unique(columns["ping"]).tolist() == [1, 3]
    assert rows(columns) == 10
    assert sum(dropped.values()) == 1


def test_hypack_length_prefix(file: Path) -> None:
    packets = [ping(1), ping(2, points=7), ping(3)]
    file.write_bytes(b"".join(struct.pack("<I", len(packet)) + packet for packet in packets))
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    assert np.unique(columns["ping"]).tolist() == [1, 2, 3]


def test_stray_bytes_and_resync(file: Path) -> None:
    file.write_bytes(ping(1) + b"noise BTH0 and more" + ping(2) + bytes(1000) + ping(3) + b"BTH0")
    columns, dropped = read("mbes", file, "r2sonic")
    assert np.unique(columns["ping"]).tolist() == [1, 2, 3]
    assert sum(dropped.values()) >= 2


def test_other_packets_of_the_sonar_are_skipped(file: Path) -> None:
    water_column = struct.pack(">4sII", b"WCD0", 12 + len(ping(8)), 0) + ping(8)
    file.write_bytes(ping(1) + water_column + ping(2))
    columns, _ = read("mbes", file, "r2sonic")
    assert np.unique(columns["ping"]).tolist() == [1, 2]


@pytest.mark.parametrize(
    ("unix_s", "leap_s"),
    [(1_435_708_799, 16), (1_435_708_800, 17), (1_483_228_799, 17), (1_483_228_800, 18), (1_714_521_600, 18)],
)
def test_leap_seconds(unix_s: int, leap_s: int, file: Path) -> None:
    file.write_bytes(ping(1, seconds=unix_s, nanoseconds=999_999_999))
    assert times(file) == [(unix_s - 315_964_800 + leap_s) * NS + 999_999_999]


@pytest.mark.parametrize("latency_s", [0.015, -0.25])
def test_latency_is_taken_off(latency_s: float, file: Path) -> None:
    """True time = recorded time - latency."""
    file.write_bytes(ping(1))
    columns, _ = read("mbes", file, "r2sonic", latency_s=latency_s)
    assert set(columns["t_ns"].tolist()) == {GPS_2024 * NS - round(latency_s * NS)}


def test_beams_that_detected_nothing(file: Path) -> None:
    file.write_bytes(bth0(h0(1, 4), scaled(b"R0", 1e-5, [900, 0, 0, 950]), a0(-1.0, 1.0)))
    columns, dropped = read("mbes", file, "r2sonic")
    assert columns["beam"].tolist() == [0, 3]
    assert dropped == {"no detection": 2}


NOT_USABLE = {
    "clock not set": h0(1, 2, seconds=0),
    "no sound speed": h0(1, 2, sound_speed=0.0),
    "sound speed NaN": h0(1, 2, sound_speed=float("nan")),
    "sound speed in air": h0(1, 2, sound_speed=340.0),
}


@pytest.mark.parametrize("what", NOT_USABLE)
def test_impossible_heads(what: str, file: Path) -> None:
    file.write_bytes(bth0(NOT_USABLE[what], scaled(b"R0", 1e-5, [9, 9]), a0(-1.0, 1.0)) + ping(2))
    columns, dropped = read("mbes", file, "r2sonic")
    assert set(columns["ping"].tolist()) == {2}
    assert sum(dropped.values()) == 2


@pytest.mark.parametrize("scale", [float("nan"), float("inf"), -1e-5, 3e38])
def test_impossible_scales(scale: float, file: Path) -> None:
    file.write_bytes(bth0(h0(1, 2), scaled(b"R0", scale, [9, 9]), a0(-1.0, 1.0)))
    columns, dropped = read("mbes", file, "r2sonic")
    assert rows(columns) == 0
    assert sum(dropped.values()) == 2


@pytest.mark.parametrize("angle", [float("nan"), float("inf"), 30.0])
def test_impossible_angles(angle: float, file: Path) -> None:
    file.write_bytes(bth0(h0(1, 2), scaled(b"R0", 1e-5, [9, 9]), a0(0.0, angle)))
    columns, dropped = read("mbes", file, "r2sonic")
    assert rows(columns) + sum(dropped.values()) == 2
    assert np.all(np.abs(columns["angle_rad"]) < 2)


@pytest.mark.parametrize("kind", [65, 68])
def test_xtf(kind: int, file: Path) -> None:
    attitude = xtf_record(3, bytes(50))
    file.write_bytes(xtf(ping(1), kind=kind) + attitude + xtf(ping(2, points=300), kind=kind)[1024:] + attitude)
    columns, dropped = read("mbes", file, "r2sonic")
    assert not dropped
    assert rows(columns) == 305


def test_xtf_file_header_of_two_kilobytes(file: Path) -> None:
    file.write_bytes(xtf_header() + bytes(1024) + xtf(ping(1))[1024:])
    columns, _ = read("mbes", file, "r2sonic")
    assert rows(columns) == 5


@pytest.mark.parametrize("length", [0, 13, 2**31, 2**32 - 1])
def test_xtf_record_of_impossible_length(length: int, file: Path) -> None:
    records = bytearray(xtf_record(65, bytes(242) + ping(1)))
    records[10:14] = struct.pack("<I", length)
    file.write_bytes(xtf(ping(0)) + bytes(records) + xtf(ping(2))[1024:])
    columns, dropped = read("mbes", file, "r2sonic")
    assert {0, 2} <= set(columns["ping"].tolist())
    assert sum(dropped.values()) >= 1


def test_xtf_without_bathymetry(file: Path) -> None:
    file.write_bytes(xtf_header() + xtf_record(3, bytes(50)) * 4)
    columns, dropped = read("mbes", file, "r2sonic")
    assert rows(columns) == 0
    assert sum(dropped.values()) == 4


@pytest.mark.parametrize("tenth", range(1, 10))
@pytest.mark.parametrize("shell", ["bare", "prefixed", "xtf"])
def test_cut_at_each_tenth(shell: str, tenth: int, file: Path) -> None:
    packets = [ping(k) for k in range(20)]
    whole = {
        "bare": b"".join(packets),
        "prefixed": b"".join(struct.pack("<I", len(packet)) + packet for packet in packets),
        "xtf": xtf(*packets),
    }[shell]
    record = {"bare": len(packets[0]), "prefixed": len(packets[0]) + 4, "xtf": len(xtf(packets[0])) - 1024}[shell]
    head = 1024 if shell == "xtf" else 0
    cut = len(whole) * tenth // 10 + 3
    file.write_bytes(whole[:cut])
    before = max(cut - head, 0) // record
    try:
        columns, dropped = read("mbes", file, "r2sonic")
    except PoolcalError as error:
        assert before == 0
        assert "\n" not in str(error)
        return
    pings = np.unique(columns["ping"]).tolist()
    assert pings[:before] == list(range(before))
    assert len(pings) <= before + 1  # an XTF record may be cut behind its packet
    assert sum(dropped.values()) >= 1


def test_a_packet_that_was_heard_twice_counts_once(file: Path) -> None:
    """As of a logger that hears the network on two ways."""
    file.write_bytes(ping(0) + ping(0) + ping(1) + ping(0))
    columns, dropped = read("mbes", file, "r2sonic")
    assert columns["ping"].tolist() == [0] * 5 + [1] * 5
    assert dropped == {"repeated ping": 2}
