"""Decode R2Sonic bathymetry packets (BTH0) into soundings. :mod:`pipeline.readers.r2sonic_framing` finds the packets.

Layout: R2Sonic Sonic 2026/2024/2022 Operation Manual, appendix "Uplink Data Formats", Bathy Data Format 0 (V5.0 and
V6.3 agree). All numbers are big-endian. The header has 12 bytes: 'BTH0', u32 packet size, u32 stream. Then come the
sections: u16 name (two letters), u16 size of the whole section, contents padded to 4 bytes. Unknown sections are
skipped. Offsets and fields in the known sections:

    H0   28 u32 Unix seconds (UTC), 32 u32 nanoseconds, 36 u32 ping number, 44 f32 sound speed [m/s],
         68 f32 steering of the transmit fan along track [rad], 114 u16 points N
    R0   4 f32 scale, 8 u16 range[N]                     two-way time [s] = range * scale; 0: no detection
    A0   4 f32 first, 8 f32 last                         angles evenly from first (port) to last (starboard) inclusive
    A2   4 f32 first, 8 f32 scale, 36 u16 step[N]        angle[n] = first + (step[0] + ... + step[n]) * scale

Angles [rad] are measured from the array's normal, starboard +. They are not roll corrected: roll stabilisation only
moves the sector of the beams. Pitch stabilisation (models 2020, 2026) steers the transmit fan by up to 10° along track.
No document states the sign of this steering, and no available file has it. A file with a steered ping is refused.
"""

import math
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.readers.r2sonic_framing import Sections, bare_packets, xtf_packets
from pipeline.readers.raw_file import opened
from pipeline.readers.repeated_pings import RepeatedPings
from pipeline.readers.row_filter import RowFilter
from pipeline.readers.sounding_chunks import MAX_BEAMS, beam_numbers, checked_chunk, chunks_of_pings, per_sounding

H0 = struct.Struct(">28xIII4xf20xf42xH")
MIN_STEERING, MAX_STEERING = 1e-4, 0.6  # rad: 0.006° and 34°; 20° is possible at 200 kHz
TWO_FLOATS = struct.Struct(">4xff")
SCALE = struct.Struct(">4xf")
A2_STEPS_OFFSET = 36


@dataclass(frozen=True)
class R2sonicPing:
    """One packet's contents.

    If ``steps`` is None, the angles are evenly spaced from ``first_rad`` to ``last_rad_or_scale``. Otherwise
    ``last_rad_or_scale`` is the scale of ``steps``.
    """

    seconds: int
    nanoseconds: int
    number: int
    sound_speed_m_s: float
    steering_rad: float
    range_scale_s: float
    ranges: NDArray[np.uint16]
    first_rad: float
    last_rad_or_scale: float
    steps: NDArray[np.uint16] | None

    @property
    def angles_rad(self) -> NDArray[np.float64]:
        """Angles of the beams (n,), starboard +."""
        if self.steps is None:
            return np.linspace(self.first_rad, self.last_rad_or_scale, len(self.ranges), dtype=np.float64)
        sums: NDArray[np.int64] = np.cumsum(self.steps, dtype=np.int64)
        return np.asarray(self.first_rad + sums * self.last_rad_or_scale, dtype=np.float64)


@dataclass(frozen=True)
class R2sonicPart:
    """One file: XTF, bare packets, or HYPACK .R2S."""

    path: Path
    name: str
    xtf: bool
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the soundings, chunk by chunk."""
        dropped: Counter[str] = Counter()
        with opened(self.path, self.name) as file:
            yield from chunks_of_pings(
                pings=self._usable_pings(file, dropped),
                n_soundings=lambda ping: len(ping.ranges),
                chunk_of=lambda pings: _chunk(pings, self.latency_s, dropped),
                dropped=dropped,
            )

    def _usable_pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[R2sonicPing]:
        """Yield each ping once; count repeated pings and damaged packets."""
        repeated = RepeatedPings()
        for sections in xtf_packets(file, dropped) if self.xtf else bare_packets(file, dropped):
            ping = decode_bth0(sections)
            if ping is None:
                dropped["damaged packet"] += 1
                continue
            if not repeated.is_new(b"".join(sections.values()), dropped):
                continue
            self._refuse_steered(ping)
            yield ping

    def _refuse_steered(self, ping: R2sonicPing) -> None:
        if abs(ping.steering_rad) > MIN_STEERING:
            raise RawDataError(
                f"{self.name}: ping {ping.number} was sent with its fan steered by "
                f"{math.degrees(ping.steering_rad):+.2f}° along track; switch pitch stabilisation off and sail again"
            )


def decode_bth0(sections: Sections) -> R2sonicPing | None:
    """Return the ping of one packet; None if the packet is damaged."""
    h0, r0, a0, a2 = (sections.get(name, b"") for name in (b"H0", b"R0", b"A0", b"A2"))
    if len(h0) < H0.size or len(r0) < SCALE.size:
        return None
    seconds, nanoseconds, number, speed, steering, points = H0.unpack_from(h0)
    if points > MAX_BEAMS or nanoseconds >= NS or len(r0) < SCALE.size + 2 * points:
        return None
    if not abs(steering) < MAX_STEERING:
        return None
    steps = None
    if len(a2) >= A2_STEPS_OFFSET + 2 * points:
        steps = np.frombuffer(a2, ">u2", points, A2_STEPS_OFFSET)
    elif a2 or len(a0) < TWO_FLOATS.size:
        return None
    first_rad, last_rad_or_scale = TWO_FLOATS.unpack_from(a2 or a0)
    (range_scale_s,) = SCALE.unpack_from(r0)
    return R2sonicPing(
        seconds=seconds,
        nanoseconds=nanoseconds,
        number=number,
        sound_speed_m_s=speed,
        steering_rad=steering,
        range_scale_s=range_scale_s,
        ranges=np.frombuffer(r0, ">u2", points, SCALE.size),
        first_rad=first_rad,
        last_rad_or_scale=last_rad_or_scale,
        steps=steps,
    )


@np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
def _chunk(pings: list[R2sonicPing], latency_s: float, dropped: Counter[str]) -> Chunk:
    counts = np.array([len(ping.ranges) for ping in pings])
    seconds = np.array([ping.seconds for ping in pings], dtype=np.int64)
    nanoseconds = np.array([ping.nanoseconds for ping in pings], dtype=np.int64)
    t_ns = gps_ns_from_unix_utc(seconds, nanoseconds)
    scale_s = per_sounding([ping.range_scale_s for ping in pings], counts, np.float64)
    angle_rad = np.concatenate([ping.angles_rad for ping in pings])
    rows = RowFilter(
        {
            "t_ns": per_sounding(t_ns, counts, np.int64),
            "ping": per_sounding([ping.number for ping in pings], counts, np.int64),
            "beam": beam_numbers(counts),
            "two_way_time_s": np.concatenate([ping.ranges for ping in pings]).astype(np.float64) * scale_s,
            "angle_rad": angle_rad,
            "transmit_tilt_rad": np.zeros_like(angle_rad),
            "sound_speed_m_s": per_sounding([ping.sound_speed_m_s for ping in pings], counts, np.float64),
        },
        dropped,
    )
    return checked_chunk(rows, latency_s)
