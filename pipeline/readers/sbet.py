"""SBET, the smoothed trajectory of Applanix POSPac and others: 17 little-endian doubles a record, no header.

Time (GPS seconds of week), latitude, longitude [rad], ellipsoidal height [m], velocity x, y, z (wander frame) [m/s],
roll, pitch, platform heading, wander angle [rad], acceleration x, y, z [m/s2], angular rate x, y, z [rad/s]; body axes
forward, right, down. True heading = platform heading - wander. The week is not in the file: ``ins.gps_week``.

A file whose length is no multiple of 136 bytes is used where fewer than 8 bytes are left over (less than one number: a
line end or the like that a program put behind the last whole record). Where more are left over, the last record was cut
off and the copy is not complete: such a file is refused, not used in part.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import WEEK_S, gps_ns_from_week_seconds
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.row_checks import keep_possible_poses, latency_ns, possible_week_time
from pipeline.readers.row_filter import INS_COLUMNS, RowFilter, TimeOrder, chunk, no_rows

SBET_RECORD = 17 * 8  # bytes
_ROWS = 65_536  # read at a time


@dataclass(frozen=True)
class SbetPart:
    """One file; ``gps_week`` is the week of its first record."""

    path: Path
    name: str
    gps_week: int
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the INS records in canonical columns, batch by batch."""
        dropped: Counter[str] = Counter()
        order, week, last = TimeOrder(self.name), self.gps_week, -np.inf
        with opened(self.path, self.name) as file:
            dropped["stray bytes at the end"] += stray_bytes(size_of(file), self.name)
            first = True
            while len(data := file.read(_ROWS * SBET_RECORD)) >= SBET_RECORD:
                records = np.frombuffer(data, "<f8", count=len(data) // SBET_RECORD * 17).reshape(-1, 17)
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
    """Return the number of bytes behind the last whole record of a file of ``size`` bytes.

    Raises
    ------
    RawDataError
        There are 8 or more, the beginning of a record that was cut off.
    """
    stray = size % SBET_RECORD
    if stray >= 8:
        raise RawDataError(
            f"{name}: {size} bytes are {size // SBET_RECORD} SBET records of {SBET_RECORD} bytes and {stray} bytes of "
            "another: the copy is not complete; copy or export it again"
        )
    return stray


def check_size(path: Path, name: str) -> None:
    """Refuse a file whose last record was cut off, by a RawDataError."""
    with opened(path, name) as file:
        stray_bytes(size_of(file), name)


def first_seconds(path: Path, name: str) -> float:
    """Return the first record's seconds of week; 0 for an empty file."""
    with opened(path, name) as file:
        return float(np.frombuffer(file.read(8).ljust(8, b"\0"), "<f8")[0])


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def running_weeks(seconds: NDArray[np.float64], week: int, last: float) -> tuple[NDArray[np.int64], int, float]:
    """Return the week of each record, which grows by one where the seconds step back by about a week.

    Parameters
    ----------
    seconds : (n,) array
        Seconds of week, n > 0.
    week : int
        Week of the record before.
    last : float
        Its seconds of week; not finite: there is none.

    Returns
    -------
    weeks : (n,) array of int64
    week : int
        Week of the last record.
    last : float
        Its seconds of week.
    """
    steps = np.diff(seconds, prepend=last if np.isfinite(last) else seconds[0])
    rollover = (steps < -0.9 * WEEK_S) & (steps > -1.1 * WEEK_S)
    weeks = week + np.cumsum(rollover)
    return weeks, int(weeks[-1]), float(seconds[-1])


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(
    records: NDArray[np.float64], weeks: NDArray[np.int64], order: TimeOrder, latency_s: float, dropped: Counter[str]
) -> Chunk:
    names = ("seconds", "latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "heading", "wander")
    columns = dict(zip(names, records[:, [0, 1, 2, 3, 7, 8, 9, 10]].T, strict=True))
    rows = RowFilter({**columns, "week": weeks, "azimuth_rad": np.zeros(len(records))}, dropped)
    rows.keep_finite()
    rows.keep((np.abs(rows["heading"]) <= 1e3) & (np.abs(rows["wander"]) <= 1e3), "impossible attitude")
    rows.columns["azimuth_rad"] = rows["heading"] - rows["wander"]
    keep_possible_poses(rows)
    rows.keep(possible_week_time(rows["week"], rows["seconds"]), "impossible time")
    rows.columns["t_ns"] = gps_ns_from_week_seconds(rows["week"], rows["seconds"]) - latency_ns(latency_s)
    order.keep(rows)
    return chunk(rows.columns, INS_COLUMNS, dropped)
