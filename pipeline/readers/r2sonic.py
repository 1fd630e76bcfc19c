"""R2Sonic bathymetry packets (BTH0), each by itself, into soundings.

Layout: R2Sonic Sonic 2026/2024/2022 Operation Manual, appendix "Uplink Data Formats", Bathy Data Format 0 (V5.0 and
V6.3 agree). All big-endian. Header of 12 bytes: 'BTH0', u32 packet size, u32 stream. Then sections, each u16 name (two
letters), u16 size (all of it), padded to 4 bytes; unknown ones are skipped by their size. At offsets in the section:

    H0   28 u32 Unix seconds (UTC), 32 u32 nanoseconds, 36 u32 ping number, 44 f32 sound speed [m/s],
         68 f32 steering of the transmit fan along track [rad], 114 u16 points N
    R0   4 f32 scale, 8 u16 range[N]                     two-way time [s] = range * scale; 0: no detection
    A0   4 f32 first, 8 f32 last                         angles evenly from first (port) to last (starboard) inclusive
    A2   4 f32 first, 8 f32 scale, 36 u16 step[N]        angle[n] = first + (step[0] + ... + step[n]) * scale

Angles [rad] are from the array's normal, starboard +, not roll corrected; roll stabilisation only moves the sector.
Pitch stabilisation (2020, 2026) steers the transmit fan by up to 10°. Which sign forward has is documented nowhere, and
no file at hand has it: such pings are refused. How packets lie in files: ``packets.py``.
"""

import math
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.readers.r2sonic_packets import Sections, bare_packets, xtf_packets
from pipeline.readers.raw_file import opened
from pipeline.readers.repeated_pings import Repeats
from pipeline.readers.row_checks import (
    MBES_COLUMNS,
    RowFilter,
    chunk,
    keep_possible_soundings,
    latency_ns,
    no_rows,
    possible_ns,
)

SOUNDINGS = 131_072  # a chunk has at least so many, and at most one ping more
PINGS = 8_192
MAX_POINTS = np.iinfo(np.int16).max
HEAD = struct.Struct(">28xIII4xf20xf42xH")
LEAST_STEERING, MAX_STEERING = 1e-4, 0.6  # rad: 0.006°; 20° is possible at 200 kHz
TWO_FLOATS = struct.Struct(">4xff")
SCALE = struct.Struct(">4xf")
STEPS = 36


class Ping(NamedTuple):
    """One packet's contents; ``steps`` is None where angles are evenly spaced from ``first_rad`` to ``second``."""

    seconds: int
    nanoseconds: int
    number: int
    sound_speed_m_s: float
    steering_rad: float
    range_scale_s: float
    ranges: NDArray[np.uint16]
    first_rad: float
    second: float
    steps: NDArray[np.uint16] | None


@dataclass(frozen=True)
class R2sonicPart:
    """One file: XTF, bare packets, or HYPACK .R2S."""

    path: Path
    name: str
    xtf: bool
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        pings: list[Ping] = []
        waiting, repeats = 0, Repeats()
        with opened(self.path, self.name) as file:
            packets = xtf_packets(file, dropped) if self.xtf else bare_packets(file, dropped)
            for sections in packets:
                ping = decode(sections)
                if ping is None:
                    dropped["damaged packet"] += 1
                    continue
                if not repeats.is_new(b"".join(sections.values()), dropped):
                    continue
                self._refuse_steered(ping)
                pings.append(ping)
                waiting += len(ping.ranges)
                if waiting >= SOUNDINGS or len(pings) >= PINGS:
                    yield _chunk(pings, self.latency_s, dropped)
                    pings, waiting = [], 0
            if waiting:
                yield _chunk(pings, self.latency_s, dropped)
            if dropped:
                yield no_rows(MBES_COLUMNS, dropped)

    def _refuse_steered(self, ping: Ping) -> None:
        if abs(ping.steering_rad) > LEAST_STEERING:
            raise RawDataError(
                f"{self.name}: ping {ping.number} was sent with its fan steered by "
                f"{math.degrees(ping.steering_rad):+.2f}° along track; switch pitch stabilisation off and sail again"
            )


def decode(sections: Sections) -> Ping | None:
    """The contents of one packet; None where they contradict themselves."""
    head, ranges, a0, a2 = (sections.get(name, b"") for name in (b"H0", b"R0", b"A0", b"A2"))
    if len(head) < HEAD.size or len(ranges) < SCALE.size:
        return None
    seconds, nanoseconds, number, speed, steering, points = HEAD.unpack_from(head)
    if points > MAX_POINTS or nanoseconds >= NS or len(ranges) < SCALE.size + 2 * points:
        return None
    if not abs(steering) < MAX_STEERING:
        return None
    steps = None
    if len(a2) >= STEPS + 2 * points:
        steps = np.frombuffer(a2, ">u2", points, STEPS)
    elif a2 or len(a0) < TWO_FLOATS.size:
        return None
    first, second = TWO_FLOATS.unpack_from(a2 or a0)
    (scale,) = SCALE.unpack_from(ranges)
    ticks = np.frombuffer(ranges, ">u2", points, SCALE.size)
    return Ping(seconds, nanoseconds, number, speed, steering, scale, ticks, first, second, steps)


def _angles(ping: Ping) -> NDArray[np.float64]:
    if ping.steps is None:
        return np.linspace(ping.first_rad, ping.second, len(ping.ranges), dtype=np.float64)
    sums: NDArray[np.int64] = np.cumsum(ping.steps, dtype=np.int64)
    return np.asarray(ping.first_rad + sums * ping.second, dtype=np.float64)


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(pings: list[Ping], latency_s: float, dropped: Counter[str]) -> Chunk:
    counts = np.array([len(ping.ranges) for ping in pings])
    seconds = np.array([ping.seconds for ping in pings], dtype=np.int64)
    nanoseconds = np.array([ping.nanoseconds for ping in pings], dtype=np.int64)
    t_ns = gps_ns_from_unix_utc(seconds, nanoseconds)

    def spread(values: Any, dtype: Any) -> NDArray[Any]:
        return np.repeat(np.asarray(values, dtype=dtype), counts)

    scale_s = spread([ping.range_scale_s for ping in pings], np.float64)
    two_way_time_s = np.concatenate([ping.ranges for ping in pings]).astype(np.float64) * scale_s
    angle_rad = np.concatenate([_angles(ping) for ping in pings])
    sieve = RowFilter(
        {
            "t_ns": spread(t_ns, np.int64),
            "ping": spread([ping.number for ping in pings], np.int64),
            "beam": np.concatenate([np.arange(count, dtype=np.int16) for count in counts]),
            "two_way_time_s": two_way_time_s,
            "angle_rad": angle_rad,
            "transmit_tilt_rad": np.zeros_like(angle_rad),
            "sound_speed_m_s": spread([ping.sound_speed_m_s for ping in pings], np.float64),
        },
        dropped,
    )
    sieve.keep(possible_ns(sieve["t_ns"]), "impossible time (clock not set)")
    keep_possible_soundings(sieve)
    sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(latency_s)
    return chunk(sieve.columns, MBES_COLUMNS, dropped)
