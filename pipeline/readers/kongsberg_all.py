"""Kongsberg .all: the soundings of raw range and angle datagrams N (78; "EM series datagram formats", 160692).

Offsets in bytes from the datagram's 2: 16 u16 sound speed at the transducer [0.1 m/s], 18 u16 sectors, 20 u16 beams;
from 32 on 24 a sector: 0 i16 tilt [0.01 degrees, in the transmitter's frame, forward +], 8 f32 delay [s], 19 u8 part of
the transmitter; then 16 a beam: 0 i16 angle to the receiving array [0.01 degrees, port +], 2 u8 sector, by the order of
sectors, 3 u8 detection info (bit 7: none is valid), 8 f32 two-way time [s], 14 i8 cleaning (negative: flagged out).
Times are UTC, in whole milliseconds.

The tilt is what the sector was sent with, steering of pitch and yaw stabilisation in it: in files of stabilised sonars
the soundings so placed lie where Kongsberg's XYZ datagrams have them. Frame and installation (datagram I) are as in
:mod:`pipeline.readers.kmall`. Datagrams F (70) and f (102) of older sonars, which have no such sectors, are not read.
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
from pipeline.readers.kongsberg import MAX_BEAMS, KongsbergPart, Ping, Sectors, possible
from pipeline.readers.kongsberg_all_datagrams import INNER, TAIL, datagrams
from pipeline.readers.kongsberg_arrays import of_all
from pipeline.readers.repeated_pings import Repeats

RANGES, INSTALLATION, OLDER = ord("N"), b"Ii", b"Ff"
RAW = struct.Struct("<4HfI")
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
    """One file."""

    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[Ping]:
        installation, found, older, repeats = "", False, 0, Repeats()
        for datagram in datagrams(file, bytes([RANGES]) + INSTALLATION + OLDER, dropped):
            kind = datagram[1]
            if kind in INSTALLATION:
                installation = datagram[INNER.size + 2 : -TAIL].decode("latin-1")
            elif kind in OLDER:
                older += 1
            elif (ping := decode(datagram, installation)) is not None:
                found = True
                if repeats.is_new(datagram, dropped):
                    yield ping
            else:
                dropped["damaged datagram"] += 1
        if older and not found:
            raise RawDataError(
                f"{self.name}: has raw ranges of older sonars alone ({older} datagrams F or f, none N); export it to "
                "GSF with travel times and beam angles, from a sonar without pitch and yaw stabilisation"
            )


def decode(datagram: bytes, installation: str) -> Ping | None:
    """The contents of one datagram N; None where they contradict themselves."""
    start = INNER.size
    if len(datagram) < start + RAW.size + TAIL:
        return None
    _, _, model, date, milliseconds, number, serial = INNER.unpack_from(datagram)
    speed, sectors, beams, _, _, _ = RAW.unpack_from(datagram, start)
    t_ns = _gps_ns(date, milliseconds)
    start += RAW.size
    if t_ns is None or start + sectors * SECTOR.itemsize + beams * BEAM.itemsize + TAIL > len(datagram):
        return None
    sent = np.frombuffer(datagram, SECTOR, sectors, start)
    heard = np.frombuffer(datagram, BEAM, beams, start + sent.nbytes)
    arrays = of_all(installation, serial, model)
    told = Sectors(sent["delay"].astype(float), sent["tilt"] / 100, sent["part"].astype(int), [arrays] * sectors)
    if beams > MAX_BEAMS or not possible(told, heard["sector"]):
        return None
    return Ping(
        t_ns,
        number,
        f"{model} {serial}",
        speed / 10,
        told,
        heard["sector"],
        np.zeros(beams, dtype=bool),
        (heard["info"] & INVALID != 0) | (heard["cleaning"] < 0),
        heard["angle"] / 100,
        heard["time"].astype(np.float64),
    )


def _gps_ns(date: int, milliseconds: int) -> int | None:
    try:
        day = datetime(date // 10_000, date // 100 % 100, date % 100, tzinfo=UTC)
    except ValueError:
        return None
    seconds, rest = divmod(milliseconds, 1000)
    unix_s = int((day + timedelta(seconds=seconds)).timestamp())
    return int(gps_ns_from_unix_utc(np.array([unix_s]), np.array([rest * 1_000_000]))[0])
