"""Tables (CSV or Parquet) of instruments whose own format is not read: their columns become canonical columns.

:mod:`pipeline.readers.table_files` reads the columns that :mod:`pipeline.readers.table_columns` chooses.

In CSV the first line that is not empty, and does not begin with # or //, names the columns. Comma, semicolon or tab
separates them. Numbers have a decimal point. The columns are these; others are ignored:

    every sensor  gps_ns                            nanoseconds since 1980-01-06 00:00:00 GPS, whole number; or
                  gps_week, seconds_of_week         GPS week (not modulo 1024) and seconds of week
    ins           latitude_deg, longitude_deg, height_m (ellipsoidal), roll_deg (starboard down +),
                  pitch_deg (bow up +), heading_deg (clockwise from true north)
    laser         x_m, y_m, z_m                     in the frame that session.yaml names
    mbes          ping, beam, angle_deg (starboard +), sound_speed_m_s, and two_way_time_s or range_m (one way);
                  transmit_tilt_deg (along track, forward +) where the transmit fan is tilted: 0 without the column

A CSV row with another number of columns, and a last line without line end (it may be cut off), are left out and
counted. A file is refused if it has a word in place of a number, or times or positions that were stored as float32.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.gps_time import gps_ns_from_week_seconds
from pipeline.readers.crs import LaserFrame, transform_to_ecef
from pipeline.readers.float32_checks import refuse_float32
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import (
    keep_possible_poses,
    keep_possible_soundings,
    latency_ns,
    possible_ns,
    possible_week_time,
)
from pipeline.readers.row_filter import INS_COLUMNS, LASER_COLUMNS, MBES_COLUMNS, RowFilter, TimeOrder, chunk, no_rows
from pipeline.readers.table_columns import WHOLE_NUMBERS, TableSensor
from pipeline.readers.table_files import record_batches

_CANONICAL = {"ins": INS_COLUMNS, "laser": LASER_COLUMNS, "mbes": MBES_COLUMNS}


@dataclass(frozen=True)
class TablePart:
    """One CSV or Parquet file."""

    path: Path
    name: str
    sensor: TableSensor
    frame: LaserFrame
    latency_s: float
    max_records: int | None = None

    def chunks(self) -> Iterator[Chunk]:
        """Yield the rows in canonical columns, batch by batch."""
        dropped: Counter[str] = Counter()
        order = TimeOrder(self.name)
        canonical = _CANONICAL[self.sensor]
        first = True
        with opened(self.path, self.name) as file:
            for batch in record_batches(file, self.name, self.sensor, dropped, self.max_records):
                columns = _numpy(batch, dropped)
                if first:
                    refuse_float32(columns, self.name)
                    first = False
                yield self._chunk(columns, order, dropped)
            if dropped:
                yield no_rows(canonical, dropped)
        order.check()

    @np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
    def _chunk(self, columns: dict[str, NDArray[Any]], order: TimeOrder, dropped: Counter[str]) -> Chunk:
        rows = RowFilter(columns, dropped)
        _keep_possible_times(rows, self.latency_s)
        if self.sensor == "ins":
            _to_poses(rows)
            order.keep(rows)
        elif self.sensor == "laser":
            rows.keep_finite()
            transform_to_ecef(rows, self.frame, self.name)
        else:
            _to_soundings(rows)
        return chunk(rows.columns, _CANONICAL[self.sensor], dropped)


def _numpy(batch: pa.RecordBatch, dropped: Counter[str]) -> dict[str, NDArray[Any]]:
    """Return the columns as arrays, without rows in which a value is missing."""
    complete = batch.drop_null()
    if complete.num_rows < batch.num_rows:
        dropped["missing value"] += batch.num_rows - complete.num_rows
    columns = {}
    for column in complete.schema.names:
        values = complete[column].to_numpy(zero_copy_only=False)
        columns[column] = values if column in WHOLE_NUMBERS else values.astype(np.float64)
    return columns


def _keep_possible_times(rows: RowFilter, latency_s: float) -> None:
    """Add column t_ns with the latency subtracted, and leave out rows with impossible times."""
    for column in WHOLE_NUMBERS:
        if column in rows.columns and rows[column].dtype.kind == "f":
            rows.keep(np.isfinite(rows[column]) & (np.abs(rows[column]) < 1e15), "not a whole number")
            rows.keep(rows[column] == np.rint(rows[column]), "not a whole number")
    if "gps_ns" in rows.columns:
        rows.keep(possible_ns(rows["gps_ns"]), "impossible time")
        t_ns = rows["gps_ns"].astype(np.int64)
    else:
        rows.keep(possible_week_time(rows["gps_week"], rows["seconds_of_week"]), "impossible time")
        t_ns = gps_ns_from_week_seconds(rows["gps_week"].astype(np.int64), rows["seconds_of_week"])
    rows.columns["t_ns"] = t_ns - latency_ns(latency_s)


def _to_poses(rows: RowFilter) -> None:
    """Add the canonical columns of the INS, radians, and leave out impossible rows."""
    for name in ("latitude", "longitude", "roll", "pitch", "heading"):
        rows.columns[f"{name}_rad"] = np.radians(rows[f"{name}_deg"])
    rows.columns["azimuth_rad"] = rows["heading_rad"]
    keep_possible_poses(rows)


def _to_soundings(rows: RowFilter) -> None:
    """Add the canonical columns of the sonar, radians and seconds, and leave out impossible rows."""
    rows.keep((rows["beam"] >= 0) & (rows["beam"] <= np.iinfo(np.int16).max), "impossible beam")
    rows.columns["angle_rad"] = np.radians(rows["angle_deg"])
    tilt_deg = rows.columns.get("transmit_tilt_deg", np.zeros(len(rows)))
    rows.columns["transmit_tilt_rad"] = np.radians(tilt_deg)
    if "two_way_time_s" not in rows.columns:
        rows.columns["two_way_time_s"] = 2 * rows["range_m"] / rows["sound_speed_m_s"]
    keep_possible_soundings(rows)
