"""R2Sonic in XTF on a real file, against figures that other programs gave for it."""

import struct
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from pipeline.gps_time import GPS_EPOCH_UNIX_S, NS
from tests.real.conftest import Read
from tests.support.real_files import XTF

# ping, Unix seconds, nanoseconds, sound speed, then two-way time and angle of beams 0, 127 and 255
FIRST_VALUES = (
    (
        151989, 1436399535, 920431109, 1514.9620361328125,
        0.030901499383617193, -1.0740883350372314, 0.014173559204209596, -0.07949803337578487,
        0.028454348794184625, 1.0816686945536276,
    ),
    (
        152450, 1436399559, 970821409, 1515.0269775390625,
        0.030415132991038263, -1.0749220848083496, 0.013897823926527053, -0.10201847905159411,
        0.027324600087013096, 1.0808358542777796,
    ),
    (
        152911, 1436399584, 21213199, 1514.9429931640625,
        0.030342369514983147, -1.0790804624557495, 0.013526347232982516, -0.11612870446788293,
        0.026895678543951362, 1.0766772052843407,
    ),
)  # fmt: skip


def test_r2sonic_in_xtf(read: Read) -> None:
    soundings, dropped = read("mbes", "r2sonic", XTF)
    no_detection = dropped.pop("no detection", 0)
    assert not dropped
    assert len(soundings["t_ns"]) + no_detection == 923 * 256 == 236_288
    assert np.array_equal(np.unique(soundings["ping"]), np.arange(151989, 152912))
    assert (soundings["beam"].min(), soundings["beam"].max()) == (0, 255)


def test_r2sonic_first_values(read: Read) -> None:
    soundings, _ = read("mbes", "r2sonic", XTF)
    for ping, seconds, nanoseconds, speed, *beams in FIRST_VALUES:
        for beam, time, angle in zip((0, 127, 255), beams[::2], beams[1::2], strict=True):
            (row,) = np.flatnonzero((soundings["ping"] == ping) & (soundings["beam"] == beam))
            assert soundings["t_ns"][row] == (seconds - GPS_EPOCH_UNIX_S + 17) * NS + nanoseconds
            assert soundings["sound_speed_m_s"][row] == speed
            assert soundings["two_way_time_s"][row] == pytest.approx(time, rel=1e-15)
            assert soundings["angle_rad"][row] == pytest.approx(angle, abs=2e-16, rel=1e-15)


def _attitude(content: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Times (GPS, s) and rolls (starboard down +, rad) of the file's own attitude records (XTF type 3)."""
    times, rolls, start = [], [], 1024
    while start + 14 <= len(content):
        if content[start + 2] == 3:
            (roll,) = struct.unpack_from("<f", content, start + 34)
            *moment, milliseconds = struct.unpack_from("<H5BH", content, start + 54)
            times.append(datetime(*moment, tzinfo=UTC).timestamp() - GPS_EPOCH_UNIX_S + 17 + milliseconds / 1000)
            rolls.append(np.radians(roll))
        start += int.from_bytes(content[start + 10 : start + 14], "little")
    return np.array(times), np.array(rolls)


def test_r2sonic_angles_are_not_roll_corrected_and_starboard_is_positive(read: Read, data: Path) -> None:
    """Seen from the rolling array a flat seabed slopes against the roll: slope = -0.993 roll, correlation -0.992."""
    soundings, _ = read("mbes", "r2sonic", XTF)
    times, rolls = _attitude((data / XTF).read_bytes())
    assert len(times) == 1203
    slopes, ping_times = [], []
    for ping in range(151989, 152912):
        rows = soundings["ping"] == ping
        ranges = soundings["two_way_time_s"][rows] * soundings["sound_speed_m_s"][rows] / 2
        angles = soundings["angle_rad"][rows]
        slopes.append(np.polyfit(ranges * np.sin(angles), ranges * np.cos(angles), 1)[0])
        ping_times.append(soundings["t_ns"][rows][0] / NS)
    roll = np.interp(ping_times, times, rolls)
    assert np.corrcoef(roll, slopes)[0, 1] < -0.991
    assert np.polyfit(roll, np.arctan(slopes), 1) == pytest.approx([-0.993, -0.031], abs=0.02)
