"""SBET, the smoothed trajectory of Applanix POSPac and others: 17 little-endian doubles a record, no header.

Time (GPS seconds of week), latitude, longitude [rad], ellipsoidal height [m], velocity x, y, z (wander frame) [m/s],
roll, pitch, platform heading, wander angle [rad], acceleration x, y, z [m/s2], angular rate x, y, z [rad/s]; body axes
forward, right, down. True heading = platform heading - wander. The week is not in the file: ``ins.gps_week``.

A file whose length is no multiple of 136 bytes is used where fewer than 8 bytes (less than one number: a line end or
the like that a program put behind the last whole record) are left over; where more are, the last record was cut off
and the copy is not complete: such a product of postprocessing is refused, not used in part.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS, gps_ns_from_week_seconds
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.row_checks import (
    INS_COLUMNS,
    Order,
    Sieve,
    chunk,
    keep_possible_poses,
    latency_ns,
    no_rows,
    possible_week_time,
)

RECORD = 17 * 8
ROWS = 65_536
WEEK_S = WEEK_NS / NS


@dataclass(frozen=True)
class SbetPart:
    """One file; ``gps_week`` is the week of its first record."""

    path: Path
    name: str
    gps_week: int
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        order, week, last = Order(self.name), self.gps_week, -np.inf
        with opened(self.path, self.name) as file:
            dropped["stray bytes at the end"] += stray_bytes(size_of(file), self.name)
            first = True
            while len(data := file.read(ROWS * RECORD)) >= RECORD:
                records = np.frombuffer(data, "<f8", count=len(data) // RECORD * 17).reshape(-1, 17)
                seconds = records[:, 0]
                if first and through_float32(seconds):
                    raise RawDataError(f"{self.name}: its times went through float32; export it again as double")
                first = False
                weeks, week, last = running_weeks(seconds, week, last)
                yield _chunk(records, weeks, order, self.latency_s, dropped)
            if dropped:
                yield no_rows(INS_COLUMNS, dropped)
        order.check()


def stray_bytes(size: int, name: str) -> int:
    """Bytes behind the last whole record; more than a few are the rest of a record that was cut off."""
    stray = size % RECORD
    if stray >= 8:
        raise RawDataError(
            f"{name}: {size} bytes are {size // RECORD} SBET records of {RECORD} bytes and {stray} bytes of another: "
            "the copy is not complete; copy or export it again"
        )
    return stray


def check_size(path: Path, name: str) -> None:
    """RawDataError where the last record was cut off."""
    with opened(path, name) as file:
        stray_bytes(size_of(file), name)


def first_seconds(path: Path, name: str) -> float:
    """Seconds of week of the first record."""
    with opened(path, name) as file:
        return float(np.frombuffer(file.read(8).ljust(8, b"\0"), "<f8")[0])


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def running_weeks(seconds: NDArray[np.float64], week: int, last: float) -> tuple[NDArray[np.int64], int, float]:
    """The week of each record: one more after each step back by about a week."""
    steps = np.diff(seconds, prepend=last if np.isfinite(last) else seconds[0])
    over = (steps < -0.9 * WEEK_S) & (steps > -1.1 * WEEK_S)
    weeks = week + np.cumsum(over)
    return weeks, int(weeks[-1]), float(seconds[-1])


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(
    records: NDArray[np.float64], weeks: NDArray[np.int64], order: Order, latency_s: float, dropped: Counter[str]
) -> Chunk:
    names = ("seconds", "latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "heading", "wander")
    columns = dict(zip(names, records[:, [0, 1, 2, 3, 7, 8, 9, 10]].T, strict=True))
    sieve = Sieve({**columns, "week": weeks, "azimuth_rad": np.zeros(len(records))}, dropped)
    sieve.keep_finite()
    sieve.keep((np.abs(sieve["heading"]) <= 1e3) & (np.abs(sieve["wander"]) <= 1e3), "impossible attitude")
    sieve.columns["azimuth_rad"] = sieve["heading"] - sieve["wander"]
    keep_possible_poses(sieve)
    sieve.keep(possible_week_time(sieve["week"], sieve["seconds"]), "impossible time")
    sieve.columns["t_ns"] = gps_ns_from_week_seconds(sieve["week"], sieve["seconds"]) - latency_ns(latency_s)
    order.keep(sieve)
    return chunk(sieve.columns, INS_COLUMNS, dropped)
