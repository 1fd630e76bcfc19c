"""Rows of all readers: canonical columns, a filter that counts the rows left out, a filter for the order of times."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError

Columns = dict[str, NDArray[Any]]
Mask = NDArray[np.bool_]
INS_COLUMNS = ("t_ns", "latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")
LASER_COLUMNS = ("t_ns", "x_m", "y_m", "z_m")
MBES_COLUMNS = ("t_ns", "ping", "beam", "two_way_time_s", "angle_rad", "transmit_tilt_rad", "sound_speed_m_s")
SIGMA_COLUMNS = ("t_ns", "north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
TYPES = {"t_ns": np.int64, "ping": np.int64, "beam": np.int16}
MAX_BACKWARDS_SHARE = 0.01


def chunk(
    columns: Mapping[str, NDArray[Any]],
    names: tuple[str, ...],
    dropped: Counter[str],
    sigmas: Mapping[str, NDArray[Any]] | None = None,
) -> Chunk:
    """Return a chunk with exactly the canonical columns and types, and move the counts of ``dropped`` into it.

    Parameters
    ----------
    columns
        Arrays (n,) by name; names that are not canonical are ignored.
    names
        The canonical columns: INS_COLUMNS, LASER_COLUMNS or MBES_COLUMNS.
    dropped
        Counts of rows left out, by reason; empty afterwards.
    sigmas
        The INS's own sigmas: SIGMA_COLUMNS, with times of their own.
    """
    typed = {name: np.ascontiguousarray(columns[name], dtype=TYPES.get(name, np.float64)) for name in names}
    counts = {reason: number for reason, number in dropped.items() if number}
    dropped.clear()
    return Chunk(typed, counts, sigmas or {})


def no_rows(names: tuple[str, ...], dropped: Counter[str]) -> Chunk:
    """Return a chunk without rows, with only the counts of rows left out."""
    return chunk({name: np.empty(0) for name in names}, names, dropped)


@dataclass
class RowFilter:
    """Columns of equal length. Each test removes rows from them, and counts these rows under its reason."""

    columns: Columns
    dropped: Counter[str]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def keep(self, good: Mask, reason: str) -> None:
        """Keep the rows that are ``good`` (n,), and count the others under ``reason``."""
        lost = len(good) - int(np.count_nonzero(good))
        if lost:
            self.dropped[reason] += lost
            self.columns = {name: values[good] for name, values in self.columns.items()}

    def keep_finite(self) -> None:
        """Keep the rows whose floating-point numbers are all finite."""
        good = np.ones(len(self), dtype=bool)
        for values in self.columns.values():
            if values.dtype.kind == "f":
                good &= np.isfinite(values)
        self.keep(good, "not a finite number")


@dataclass
class TimeOrder:
    """A filter for the INS records of one file; records that do not ascend in time are left out and counted."""

    name: str
    last_ns: int = field(default=np.iinfo(np.int64).min)
    records: int = 0
    backwards: int = 0

    def keep(self, rows: RowFilter) -> None:
        """Keep the rows with a later time than all preceding rows of the file (in this batch and earlier batches)."""
        t_ns = rows["t_ns"]
        latest = np.maximum.accumulate(np.concatenate([[self.last_ns], t_ns]))
        earlier = t_ns < latest[:-1]
        self.records += len(t_ns)
        self.backwards += int(np.count_nonzero(earlier))
        self.last_ns = int(latest[-1])
        later = t_ns > latest[:-1]
        rows.keep(later | earlier, "repeated time")
        rows.keep(later[later | earlier], "time running backwards")

    def check(self) -> None:
        """Raise RawDataError if the time runs backwards in more than MAX_BACKWARDS_SHARE of the records."""
        if self.backwards > MAX_BACKWARDS_SHARE * self.records:
            raise RawDataError(
                f"{self.name}: time runs backwards in {self.backwards} of {self.records} records; "
                "export the file again in order of time, one log a file"
            )
