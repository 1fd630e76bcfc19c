"""SBET, the smoothed trajectory of Applanix POSPac and others: 17 little-endian doubles per record, no header.

A record has time (GPS seconds of week), latitude, longitude [rad], ellipsoidal height [m], velocity x, y, z (wander
frame) [m/s], roll, pitch, platform heading, wander angle [rad], acceleration x, y, z [m/s2], angular rate x, y, z
[rad/s]. The body axes are forward, right, down. True heading = platform heading - wander angle. The file does not hold
the week; ``ins.gps_week`` does.

If fewer than 8 bytes follow the last whole record of 136 bytes, the file is used: they are less than one number, such
as a line end that a program added. If more bytes follow, the last record was cut off and the copy is not complete. The
whole file is then refused.
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
    """Return the number of bytes after the last whole record of a file of ``size`` bytes.

    Raises
    ------
    RawDataError
        There are 8 bytes or more: the last record was cut off.
    """
    stray = size % SBET_RECORD
    if stray >= 8:
        raise RawDataError(
            f"{name}: {size} bytes are {size // SBET_RECORD} SBET records of {SBET_RECORD} bytes and {stray} bytes of "
            "another: the copy is not complete; copy or export it again"
        )
    return stray


def check_size(path: Path, name: str) -> None:
    """Raise RawDataError if the file's last record was cut off."""
    with opened(path, name) as file:
        stray_bytes(size_of(file), name)


def first_seconds(path: Path, name: str) -> float:
    """Return the first record's seconds of week; 0 for an empty file."""
    with opened(path, name) as file:
        return float(np.frombuffer(file.read(8).ljust(8, b"\0"), "<f8")[0])


@np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
def running_weeks(seconds: NDArray[np.float64], week: int, last: float) -> tuple[NDArray[np.int64], int, float]:
    """Return the weeks of records; the week grows by one where the seconds of week step back by about a week.

    Parameters
    ----------
    seconds : (n,) array
        Seconds of week, n > 0.
    week : int
        Week of the preceding record, or of the first record if there is no preceding one.
    last : float
        Seconds of week of the preceding record; not finite: there is none.

    Returns
    -------
    weeks : (n,) array of int64
    week : int
        Week of the last record.
    last : float
        Seconds of week of the last record.
    """
    steps = np.diff(seconds, prepend=last if np.isfinite(last) else seconds[0])
    rollover = (steps < -0.9 * WEEK_S) & (steps > -1.1 * WEEK_S)
    weeks = week + np.cumsum(rollover)
    return weeks, int(weeks[-1]), float(seconds[-1])


@np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
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
