"""Kongsberg .all: the soundings of raw range and angle datagrams N (78; "EM series datagram formats", 160692).

Offsets in bytes from the datagram's start byte STX: 16 u16 sound speed at the transducer [0.1 m/s], 18 u16 number of
sectors, 20 u16 number of beams. From 32 on each sector has 24 bytes: 0 i16 tilt [0.01 degrees, in the transmitter's
frame, forward +], 8 f32 delay [s], 19 u8 part of the transmitter. Then each beam has 16 bytes: 0 i16 angle to the
receiving array [0.01 degrees, port +], 2 u8 number of the sector in the order above, 3 u8 detection info (bit 7 set: no
valid detection), 8 f32 two-way time [s], 14 i8 cleaning (negative: flagged out). Times are UTC, in whole milliseconds.

The tilt is the steering with which the sector was sent. It includes pitch and yaw stabilisation: in files of stabilised
sonars, soundings computed with it agree with Kongsberg's XYZ datagrams. The frame and the installation (datagram I) are
treated as in :mod:`pipeline.readers.kmall`. Datagrams F (70) and f (102) of older sonars lack these sectors, and are
not read.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import BinaryIO

import numpy as np

from pipeline.errors import RawDataError
from pipeline.gps_time import gps_ns_from_unix_utc
from pipeline.readers.kongsberg import KongsbergPart, KongsbergPing, PingSectors, are_possible
from pipeline.readers.kongsberg_all_datagrams import HEAD_WITHOUT_LENGTH, TAIL, kongsberg_all_datagrams
from pipeline.readers.kongsberg_installation import transmitter_of_all
from pipeline.readers.repeated_pings import RepeatedPings
from pipeline.readers.sounding_chunks import MAX_BEAMS

RAW_RANGES, INSTALLATION, OLDER_RAW_RANGES = b"N", b"Ii", b"Ff"
RAW_RANGES_HEAD = struct.Struct("<4HfI")
SECTOR = np.dtype(
    {"names": ["tilt", "delay", "part"], "formats": ["<i2", "<f4", "u1"], "offsets": [0, 8, 19], "itemsize": 24}
)
BEAM = np.dtype(
    {
        "names": ["angle", "sector", "info", "time", "cleaning"],
        "formats": ["<i2", "u1", "u1", "<f4", "i1"],
        "offsets": [0, 2, 3, 8, 14],
        "itemsize": 16,
    }
)
INVALID = 0x80


@dataclass(frozen=True)
class AllPart(KongsbergPart):
    """One .all file."""

    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[KongsbergPing]:
        installation, has_pings, older, repeated = "", False, 0, RepeatedPings()
        for datagram in kongsberg_all_datagrams(file, RAW_RANGES + INSTALLATION + OLDER_RAW_RANGES, dropped):
            kind = datagram[1]
            if kind in INSTALLATION:
                installation = datagram[HEAD_WITHOUT_LENGTH.size + 2 : -TAIL].decode("latin-1")
            elif kind in OLDER_RAW_RANGES:
                older += 1
            elif (ping := decode_raw_ranges(datagram, installation)) is not None:
                has_pings = True
                if repeated.is_new(datagram, dropped):
                    yield ping
            else:
                dropped["damaged datagram"] += 1
        if older and not has_pings:
            raise RawDataError(
                f"{self.name}: has raw ranges of older sonars alone ({older} datagrams F or f, none N); export it to "
                "GSF with travel times and beam angles, from a sonar without pitch and yaw stabilisation"
            )


def decode_raw_ranges(datagram: bytes, installation: str) -> KongsbergPing | None:
    """Return the ping of one datagram N; None if the datagram is damaged."""
    start = HEAD_WITHOUT_LENGTH.size
    if len(datagram) < start + RAW_RANGES_HEAD.size + TAIL:
        return None
    _, _, model, date, milliseconds, number, serial = HEAD_WITHOUT_LENGTH.unpack_from(datagram)
    speed, n_sectors, n_beams, _, _, _ = RAW_RANGES_HEAD.unpack_from(datagram, start)
    t_ns = _gps_ns(date, milliseconds)
    start += RAW_RANGES_HEAD.size
    if t_ns is None or start + n_sectors * SECTOR.itemsize + n_beams * BEAM.itemsize + TAIL > len(datagram):
        return None
    sector_rows = np.frombuffer(datagram, SECTOR, n_sectors, start)
    beam_rows = np.frombuffer(datagram, BEAM, n_beams, start + sector_rows.nbytes)
    sectors = PingSectors(
        delay_s=sector_rows["delay"].astype(float),
        tilt_deg=sector_rows["tilt"] / 100,
        array_part=sector_rows["part"].astype(int),
        transmitters=[transmitter_of_all(installation, serial, model)] * n_sectors,
    )
    if n_beams > MAX_BEAMS or not are_possible(sectors, beam_rows["sector"]):
        return None
    return KongsbergPing(
        t_ns=t_ns,
        number=number,
        receiver=f"{model} {serial}",
        sound_speed_m_s=speed / 10,
        sectors=sectors,
        sector=beam_rows["sector"],
        extra=np.zeros(n_beams, dtype=bool),
        rejected=(beam_rows["info"] & INVALID != 0) | (beam_rows["cleaning"] < 0),
        angle_deg=beam_rows["angle"] / 100,
        two_way_time_s=beam_rows["time"].astype(np.float64),
    )


def _gps_ns(date: int, milliseconds: int) -> int | None:
    """Return GPS time [ns] of a date (year month day in digits) and the milliseconds of its day; None if impossible."""
    try:
        day = datetime(date // 10_000, date // 100 % 100, date % 100, tzinfo=UTC)
    except ValueError:
        return None
    seconds, rest = divmod(milliseconds, 1000)
    unix_s = int((day + timedelta(seconds=seconds)).timestamp())
    return int(gps_ns_from_unix_utc(np.array([unix_s]), np.array([rest * 1_000_000]))[0])
