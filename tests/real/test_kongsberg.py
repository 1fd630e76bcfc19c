"""Kongsberg's soundings as the readers place them against Kongsberg's own places in the same files.

Decoded here with struct from the format descriptions, without the readers: installation, attitude, places. Kongsberg's
axes are forward, starboard, down, its x and y level, along and across the heading at the ping.
"""

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pipeline.maths.sonar.soundings import points_in_mbes
from tests.real.conftest import Columns, Read
from tests.support.kongsberg_axes import KONGSBERG_FROM_MBES, turned

OS03 = "mbes/kongsberg_OS03_4033476991022010987.kmall"
OS01 = "mbes/kongsberg/kmall_OS01_-1927233285749584930.kmall"


class Array(NamedTuple):
    """Turned, and where it is."""

    R: np.ndarray
    place_m: np.ndarray
    values: dict[str, float]

    def part_m(self, key: str) -> np.ndarray:
        return self.R @ [self.values.get(f"I{key}{axis}", 0.0) for axis in "XYZ"]


class Ping(NamedTuple):
    unix_s: float
    number: int
    heading_deg: float
    beam: np.ndarray
    sector: np.ndarray
    tilt_deg: np.ndarray  # of its sectors, as their delays and parts
    delay_s: np.ndarray
    part: np.ndarray
    sound_speed_m_s: float
    time_s: np.ndarray
    place_m: np.ndarray  # (n, 3), from the vessel's reference point


def datagrams(content: bytes, kind: bytes) -> Iterator[bytes]:
    at = 0
    while at < len(content):
        (size,) = struct.unpack_from("<I", content, at)
        if content[at + 4 : at + 8] == kind:
            yield content[at : at + size]
        at += size


def arrays_of(content: bytes) -> dict[str, Array]:
    (text,) = [datagram.decode("latin-1") for datagram in datagrams(content, b"#IIP")]
    found = {}
    for name, pairs in re.findall(r"TRAI_(\w+):([^,]+),", text):
        values = dict(pair.split("=") for pair in pairs.split(";"))
        numbers = {key: float(value) for key, value in values.items() if key not in ("N", "V", "W")}
        R = turned(*(numbers[axis] for axis in "RPH"))
        found[name] = Array(R, np.array([numbers[axis] for axis in "XYZ"]), numbers)
    return found


def attitude_of(content: bytes) -> np.ndarray:
    """Unix seconds, roll, pitch, heading [degrees], of #SKM (KM binary)."""
    rows = []
    for datagram in datagrams(content, b"#SKM"):
        head, _, _, _, count, size, _ = struct.unpack_from("<HBB4H", datagram, 20)
        for k in range(count):
            at = 20 + head + k * size
            seconds, nanoseconds = struct.unpack_from("<II", datagram, at + 8)
            rows.append((seconds + nanoseconds * 1e-9, *struct.unpack_from("<3f", datagram, at + 40)))
    return np.array(rows)


def pings_of(content: bytes) -> Iterator[Ping]:
    """Normal detections of #MRZ."""
    for datagram in datagrams(content, b"#MRZ"):
        seconds, nanoseconds = struct.unpack_from("<II", datagram, 12)
        common, number = struct.unpack_from("<HH", datagram, 24)
        info = 24 + common
        (length,) = struct.unpack_from("<H", datagram, info)
        sectors, each = struct.unpack_from("<HH", datagram, info + 92)
        heading, speed = struct.unpack_from("<ff", datagram, info + 96)
        first = [struct.unpack_from("<4Bff", datagram, info + length + k * each) for k in range(sectors)]
        receive = info + length + sectors * each
        receive_size, main_beams, _, step = struct.unpack_from("<4H", datagram, receive)
        extra, classes, of_class = struct.unpack_from("<3H", datagram, receive + 26)
        start = receive + receive_size + classes * of_class
        rows = [struct.unpack_from("<HBB", datagram, start + k * step) for k in range(main_beams + extra)]
        good = [k for k, row in enumerate(rows) if row[2] == 0]
        places = [struct.unpack_from("<3f", datagram, start + k * step + 96)[::-1] for k in good]  # z, y, x
        times = [struct.unpack_from("<f", datagram, start + k * step + 80)[0] for k in good]
        columns = np.array(first)
        yield Ping(
            seconds + nanoseconds * 1e-9, number, heading,
            np.array(good), np.array([rows[k][1] for k in good], dtype=int),
            columns[:, 5], columns[:, 4], columns[:, 2].astype(int), speed, np.array(times),
            np.array(places).reshape(-1, 3),
        )  # fmt: skip


def level(ping: Ping, attitude: np.ndarray, after_s: np.ndarray) -> np.ndarray:
    """R_level_from_vessel (n, 3, 3), level along the ping's heading."""
    angles = [np.interp(ping.unix_s + after_s, attitude[:, 0], attitude[:, k]) for k in (1, 2, 3)]
    return np.array([turned(roll, pitch, yaw - ping.heading_deg) for roll, pitch, yaw in zip(*angles, strict=True)])


def covered(ping: Ping, attitude: np.ndarray) -> bool:
    return bool(len(ping.time_s) and attitude[0, 0] < ping.unix_s < attitude[-1, 0] - ping.time_s.max())


def placed(soundings: Columns, ping: Ping, arrays: dict[str, Array], attitude: np.ndarray, tilted: bool) -> np.ndarray:
    """The reader's soundings as our geometry has them, in Kongsberg's level frame (n, 3)."""
    rows = soundings["ping"] == ping.number
    names = ("two_way_time_s", "angle_rad", "transmit_tilt_rad", "sound_speed_m_s")
    time, angle, tilt, speed = (soundings[name][rows] for name in names)
    points, _ = points_in_mbes(time, angle, tilt * tilted, speed)
    sender, receiver = arrays["TX1"], arrays["RX1"]
    centre_m = receiver.place_m + receiver.part_m("")
    forward = receiver.R[:, 0]
    origin = centre_m + ((sender.place_m - centre_m) @ forward) * forward  # forward the fan begins at the transmitter
    vessel = points @ KONGSBERG_FROM_MBES.T @ receiver.R.T + origin
    return np.einsum("nij,nj->ni", level(ping, attitude, ping.delay_s[ping.sector]), vessel)


def residuals(data: Path, read: Read, name: str, tilted: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Ours less Kongsberg's (n, 3), of pings for which there is attitude; and their steps at sectors' borders."""
    content = (data / name).read_bytes()
    soundings, _ = read("mbes", "kmall", name)
    attitude, arrays = attitude_of(content), arrays_of(content)
    assert arrays["TX1"].values["H"] == pytest.approx(177.92)  # it looks aft: the sign of tilts is turned round
    off, steps = [], []
    for ping in pings_of(content):
        if covered(ping, attitude):
            off.append(placed(soundings, ping, arrays, attitude, tilted) - ping.place_m)
            steps.append(np.diff(off[-1], axis=0)[(np.diff(ping.sector) != 0) & (np.diff(ping.beam) == 1)])
    assert len(off) >= 3
    return np.concatenate(off), np.concatenate(steps)


@pytest.mark.parametrize("name", [OS03, OS01])
def test_kmall_along_track(name: str, data: Path, read: Read) -> None:
    """Where Kongsberg has it to 1 mm along track, without a step where the tilt steps (by 0.08 to 0.30 degrees).

    The fan lies where it was sent: attitude at transmit, and the transmitter's place, are what counts.
    """
    off, steps = residuals(data, read, name)
    assert np.abs(off[:, 0]).max() < 0.001
    assert np.abs(steps[:, 0]).max() < 0.0002
    untilted, stepped = residuals(data, read, name, tilted=False)
    assert np.abs(untilted[:, 0]).min() > 0.03
    assert np.abs(stepped[:, 0]).max() > 0.02


def test_kmall_across_and_down(data: Path, read: Read) -> None:
    """Each sector sends from its own part of the transmitter, up to 5 cm from the next: no step at the borders, where
    the ranges as recorded step by up to 19 mm. (In the other file the boat rolls by 3 degrees/s, and here alone the
    attitude of transmission stands for that of reception.)"""
    off, steps = residuals(data, read, OS03)
    assert np.abs(off[:, 1:]).max() < 0.003
    assert np.abs(steps[:, 1:]).max() < 0.0002
