"""Kongsberg .all: soundings as the reader places them against the XYZ datagrams of the same pings.

Decoded here with struct from the format description, without the readers. Kongsberg's axes are forward, starboard,
down.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.gps_time import GPS_EPOCH_UNIX_S, NS
from pipeline.maths.sonar.soundings import points_in_mbes
from tests.real.conftest import Read
from tests.support.kongsberg_axes import KONGSBERG_FROM_MBES, turned
from tests.support.real_files import HE, TURBEAMS


class Ranges(NamedTuple):
    """Ranges of one datagram N."""

    second: float  # of the day
    number: int
    serial: int
    tilt_deg: np.ndarray  # of its sectors
    delay_s: np.ndarray
    sector: np.ndarray  # of its beams
    angle_deg: np.ndarray
    time_s: np.ndarray
    good: np.ndarray


def datagrams(content: bytes) -> Iterator[bytes]:
    at = 0
    while at < len(content):
        (size,) = struct.unpack_from("<I", content, at)
        yield content[at + 4 : at + 4 + size]
        at += 4 + size


def ranges_of(content: bytes) -> dict[tuple[int, int], Ranges]:
    """By ping and serial number."""
    found = {}
    for datagram in datagrams(content):
        _, kind, _, _, milliseconds, number, serial = struct.unpack_from("<BBHIIHH", datagram)
        if kind != ord("N"):
            continue
        sectors, beams = struct.unpack_from("<HH", datagram, 18)
        sent = np.array([struct.unpack_from("<hHff", datagram, 32 + 24 * k) for k in range(sectors)])
        start = 32 + 24 * sectors
        heard = np.array([struct.unpack_from("<hBBHBbfhb", datagram, start + 16 * k) for k in range(beams)])
        good = heard[:, 2].astype(int) & 0x80 == 0
        found[number, serial] = Ranges(
            milliseconds / 1000, number, serial, sent[:, 0] / 100, sent[:, 3], heard[:, 1].astype(int),
            heard[:, 0] / 100, heard[:, 6], good & (heard[:, 8] >= 0),
        )  # fmt: skip
    return found


def places_of(content: bytes) -> dict[tuple[int, int], tuple[float, np.ndarray]]:
    """Heading, and x, y, z (n, 3) of each beam, z from the transmitter: datagrams X."""
    found = {}
    for datagram in datagrams(content):
        _, kind, _, _, _, number, serial = struct.unpack_from("<BBHIIHH", datagram)
        if kind == ord("X"):
            heading, _, _, beams = struct.unpack_from("<HHfH", datagram, 16)
            rows = [struct.unpack_from("<3f", datagram, 36 + 20 * k)[::-1] for k in range(beams)]
            found[number, serial] = heading / 100, np.array(rows)
    return found


def attitude_of(content: bytes) -> np.ndarray:
    """Seconds of the day, roll, pitch, heading [degrees], of datagrams A."""
    rows = []
    for datagram in datagrams(content):
        if datagram[1] == ord("A"):
            (milliseconds,) = struct.unpack_from("<I", datagram, 8)
            for k in range(struct.unpack_from("<H", datagram, 16)[0]):
                after, _, roll, pitch, _, heading = struct.unpack_from("<HHhhhH", datagram, 18 + 12 * k)
                rows.append(((milliseconds + after) / 1000, roll / 100, pitch / 100, heading / 100))
    return np.array(sorted(set(rows)))


def installation_of(content: bytes) -> dict[str, str]:
    (text,) = [datagram[18:].decode("latin-1") for datagram in datagrams(content) if datagram[1] == ord("I")]
    return dict(pair.split("=", 1) for pair in text.split(",") if "=" in pair)


def array(told: dict[str, str], number: int) -> tuple[np.ndarray, np.ndarray]:
    """Turned, and its place."""
    x, y, z, roll, pitch, heading = (float(told[f"S{number}{key}"]) for key in "XYZRPH")
    return turned(roll, pitch, heading), np.array([x, y, z])


def test_values(data: Path, read: Read) -> None:
    """An EM 710: every good detection, its time and angle as recorded but for what the distance of its arrays does
    (0.7 m forward, 0.12 m to starboard), and to starboard +."""
    soundings, dropped = read("mbes", "all", HE)
    recorded = ranges_of((data / HE).read_bytes())
    good = sum(int(np.count_nonzero(ping.good)) for ping in recorded.values())
    assert len(recorded) == 10
    assert len(soundings["t_ns"]) == good == 1267
    assert dropped == {"rejected detection": 1280 - 1267}
    for (number, _), ping in recorded.items():
        rows = soundings["ping"] == number
        beams = soundings["beam"][rows]
        assert np.array_equal(beams, np.flatnonzero(ping.good))
        assert np.degrees(soundings["angle_rad"][rows]) == pytest.approx(-ping.angle_deg[beams], abs=0.01)
        assert soundings["two_way_time_s"][rows] == pytest.approx(ping.time_s[beams], abs=0.13 / 1460)
        day_s = 1_345_507_200 - GPS_EPOCH_UNIX_S + 16  # 2012-08-21, sixteen leap seconds since 1980
        sent_s = day_s + ping.second + ping.delay_s[ping.sector[beams]]
        assert soundings["t_ns"][rows] / NS == pytest.approx(sent_s, abs=1e-6)
    assert np.all(soundings["sound_speed_m_s"] == pytest.approx(1465.7, abs=0.11))


def along_track(data: Path, read: Read, tilted: bool) -> tuple[dict[int, np.ndarray], dict[int, np.ndarray]]:
    """Ours less Kongsberg's, along track, and its steps at sectors' borders, by ping.

    Kongsberg's x has a part that is the same for a ping: the way from its reference to the antenna's.
    """
    content = (data / HE).read_bytes()
    soundings, _ = read("mbes", "all", HE)
    told, attitude, places = installation_of(content), attitude_of(content), places_of(content)
    (_, sender_m), (R_receiver, receiver_m) = array(told, 1), array(told, 2)
    forward = R_receiver[:, 0]
    origin = receiver_m + ((sender_m - receiver_m) @ forward) * forward
    off, steps = {}, {}
    for (number, serial), ping in ranges_of(content).items():
        if not attitude[0, 0] < ping.second < attitude[-1, 0] - ping.time_s.max():
            continue
        rows = soundings["ping"] == number
        time, angle, tilt, speed = (
            soundings[name][rows] for name in ("two_way_time_s", "angle_rad", "transmit_tilt_rad", "sound_speed_m_s")
        )
        if not tilted:  # the fan of a transmitter of its own angles, but unsteered
            tilt = tilt - np.radians(ping.tilt_deg[ping.sector])[soundings["beam"][rows]]
        points, _ = points_in_mbes(time, angle, tilt, speed)
        vessel = points @ KONGSBERG_FROM_MBES.T @ R_receiver.T + origin
        beams = soundings["beam"][rows]
        heading, place = places[number, serial]
        sent = ping.second + ping.delay_s[ping.sector[beams]]
        angles = zip(*(np.interp(sent, attitude[:, 0], attitude[:, k]) for k in (1, 2, 3)), strict=True)
        pairs = zip(angles, vessel, strict=True)
        along = np.array([(turned(roll, pitch, yaw - heading) @ at)[0] for (roll, pitch, yaw), at in pairs])
        off[number] = along - place[beams, 0]
        steps[number] = np.diff(off[number])[(np.diff(ping.sector[beams]) != 0) & (np.diff(beams) == 1)]
    return off, steps


def test_along_track_against_kongsberg_s_own_places(data: Path, read: Read) -> None:
    """107 m below the boat: within 4 cm in a ping (0.021 degrees: tilts have steps of 0.01, and the boat yaws between
    ten records of attitude a second), no step at the borders, and the same in both swaths of a dual swath; without
    tilts these lie 0.4 m apart."""
    off, steps = along_track(data, read, tilted=True)
    assert len(off) == 8
    assert max(np.abs(values - np.median(values)).max() for values in off.values()) < 0.04
    assert np.abs(np.concatenate(list(steps.values()))).max() < 0.02
    swaths = sorted(off)[::2]
    assert max(abs(np.median(off[number]) - np.median(off[number + 1])) for number in swaths) < 0.01
    untilted, stepped = along_track(data, read, tilted=False)
    assert min(abs(np.median(untilted[number]) - np.median(untilted[number + 1])) for number in swaths) > 0.3
    assert np.abs(np.concatenate(list(stepped.values()))).max() > 0.2


def test_two_receivers_are_refused_and_one_is_read(data: Path, read: Read) -> None:
    content = (data / TURBEAMS).read_bytes()
    with pytest.raises(RawDataError, match=r"several receivers \(dual head\).*log one head alone") as error:
        read("mbes", "all", TURBEAMS)
    assert "\n" not in str(error.value)
    counts: Counter[tuple[int, int]] = Counter()
    for serial in (2004, 2031):
        kept = [
            struct.pack("<I", len(datagram)) + datagram
            for datagram in datagrams(content)
            if datagram[1] != ord("N") or struct.unpack_from("<H", datagram, 14)[0] == serial
        ]
        soundings, dropped = read("mbes", "all", TURBEAMS, b"".join(kept))
        assert not dropped
        counts[serial, len(soundings["t_ns"])] += 1
        recorded = [ping for ping in ranges_of(content).values() if ping.serial == serial]
        assert np.array_equal(np.unique(soundings["ping"]), [ping.number for ping in recorded])
    assert counts == {(2004, 1024): 1, (2031, 1024): 1}
