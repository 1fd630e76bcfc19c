"""R2Sonic BTH0 packets (Bathy Data Format 0): in XTF records, or one after another.

Layout: R2Sonic Sonic 2026/2024/2022 Operation Manual, appendix "Uplink Data Formats". All numbers big-endian. A packet
is {"BTH0", u32 size, u32 stream} and sections {2 letters, u16 size}; H0: time, ping, sound speed; R0: two-way times;
A0 (equi-angle: first and last) or A2 (equidistant: first and steps): angles from the array's normal, starboard +.
"""

import struct
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.records import sounding_columns
from pipeline.streams import Chunk
from pipeline.times import gps_ns_from_unix_utc

MAGIC = b"BTH0"
MAX_PACKET = 1 << 20
READ_BYTES = 1 << 20
CHUNK_PINGS = 512


@dataclass(frozen=True)
class Ping:
    """One packet: UTC time, ping number, sound speed, two-way times (n,), angles (n,)."""

    seconds: int
    nanoseconds: int
    number: int
    sound_speed_m_s: float
    two_way_time_s: NDArray[np.float64]
    angle_rad: NDArray[np.float64]


def parse_packet(packet: bytes) -> Ping | None:
    """A packet's ping; None if it is damaged or lacks H0, R0 or an angle section."""
    sections: dict[bytes, bytes] = {}
    at = 12
    while at + 4 <= len(packet):
        size = int.from_bytes(packet[at + 2 : at + 4], "big")
        if size < 4 or at + size > len(packet):
            return None
        sections[packet[at : at + 2]] = packet[at : at + size]
        at += size
    head, ranges = sections.get(b"H0", b""), sections.get(b"R0", b"")
    if len(head) < 116:
        return None
    seconds, nanoseconds, number, _, speed = struct.unpack_from(">IIIff", head, 28)
    points = int.from_bytes(head[114:116], "big")
    if points == 0 or nanoseconds >= 1_000_000_000 or len(ranges) < 8 + 2 * points:
        return None
    scale = struct.unpack_from(">f", ranges, 4)[0]
    times = np.frombuffer(ranges, ">u2", points, 8).astype(np.float64) * scale
    angles = _angles(sections, points)
    return None if angles is None else Ping(seconds, nanoseconds, number, speed, times, angles)


def _angles(sections: dict[bytes, bytes], points: int) -> NDArray[np.float64] | None:
    even, steps = sections.get(b"A0", b""), sections.get(b"A2", b"")
    if len(even) >= 12:
        first, last = struct.unpack_from(">ff", even, 4)
        return np.linspace(first, last, points) if points > 1 else np.array([float(first)])
    if len(steps) >= 36 + 2 * points:
        first, scale = struct.unpack_from(">ff", steps, 4)
        total = np.cumsum(np.frombuffer(steps, ">u2", points, 36), dtype=np.uint32)
        return first + total.astype(np.float64) * scale
    return None


@dataclass(frozen=True)
class R2SonicPart:
    """One file of packets, ``container``: "xtf" or "r2sonic" (bare, or each preceded by its length as HYPACK does)."""

    path: Path
    name: str
    container: str
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        pings: list[Ping] = []
        packets = _xtf_packets(self.path, dropped) if self.container == "xtf" else _bare_packets(self.path, dropped)
        for packet in packets:
            ping = parse_packet(packet)
            if ping is None:
                dropped["damaged packet"] += 1
                continue
            pings.append(ping)
            if len(pings) == CHUNK_PINGS:
                yield self._chunk(pings, dropped)
                pings = []
                dropped.clear()  # the generator of packets counts into this very one
        yield self._chunk(pings, dropped)

    def _chunk(self, pings: list[Ping], dropped: Counter[str]) -> Chunk:
        counts = np.array([len(ping.two_way_time_s) for ping in pings], dtype=np.int64)
        t_ns = gps_ns_from_unix_utc(
            np.array([ping.seconds for ping in pings], dtype=np.int64),
            np.array([ping.nanoseconds for ping in pings], dtype=np.int64),
        )
        none = np.empty(0)
        return sounding_columns(
            np.repeat(t_ns, counts),
            self.latency_s,
            np.repeat(np.array([ping.number for ping in pings], dtype=np.int64), counts),
            np.concatenate([np.arange(n, dtype=np.int16) for n in counts] or [none]),
            np.concatenate([ping.two_way_time_s for ping in pings] or [none]),
            np.concatenate([ping.angle_rad for ping in pings] or [none]),
            np.repeat(np.array([ping.sound_speed_m_s for ping in pings], dtype=np.float64), counts),
            dict(dropped),
        )


def _packet_at(data: bytes, at: int) -> bytes | None:
    size = int.from_bytes(data[at + 4 : at + 8], "big")
    return data[at : at + size] if 12 <= size <= min(MAX_PACKET, len(data) - at) else None


def _xtf_packets(path: Path, dropped: Counter[str]) -> Iterator[bytes]:
    """Packets in the records that pyxtf does not know; found by their magic, not by an offset."""
    import pyxtf

    # For good: "catch_warnings" is not safe where two files are read side by side.
    warnings.filterwarnings("ignore", category=UserWarning, module=r"pyxtf\..*")
    try:
        for record in pyxtf.xtf_read_gen(str(path)):
            data = bytes(getattr(record, "data", b"") or b"") if type(record).__name__ == "XTFUnknownPacket" else b""
            at = data.find(MAGIC)
            if at < 0:
                continue
            packet = _packet_at(data, at)
            if packet is None:
                dropped["damaged packet"] += 1
            else:
                yield packet
    except (RuntimeError, ValueError, EOFError, struct.error, IndexError, KeyError, TypeError, AttributeError):
        dropped["truncated or damaged XTF record"] += 1
    except OSError as error:
        raise RawDataError(f"{path}: cannot be read ({error.strerror}); copy it again") from error


def _bare_packets(path: Path, dropped: Counter[str]) -> Iterator[bytes]:
    """Packets one after another; what lies between them (HYPACK's four bytes of length apart) is counted."""
    data = b""
    try:
        with path.open("rb") as file:
            while True:
                block = file.read(READ_BYTES)
                data += block
                at = data.find(MAGIC)
                used = 0
                while at >= 0:
                    size = int.from_bytes(data[at + 4 : at + 8], "big") if at + 8 <= len(data) else 0
                    if at + 8 > len(data) or (12 <= size <= MAX_PACKET and at + size > len(data) and block):
                        break  # the rest comes with the next block
                    if at - used not in (0, 4):
                        dropped["stray bytes between packets"] += 1
                    packet = _packet_at(data, at)
                    if packet is None:
                        dropped["truncated packet" if 12 <= size <= MAX_PACKET else "damaged packet"] += 1
                        used = at + 4
                    else:
                        yield packet
                        used = at + size
                    at = data.find(MAGIC, used)
                data = data[max(used, len(data) - MAX_PACKET - 8 if at < 0 else at) :]
                if not block:
                    return
    except OSError as error:
        raise RawDataError(f"{path}: cannot be read ({error.strerror}); copy it again") from error
