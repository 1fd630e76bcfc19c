"""Tables, CSV or Parquet, for instruments whose own format is not read.

Columns by name (others are ignored; in CSV the first line that does not begin with # or // names them; separated by
comma, semicolon or tab; numbers with a decimal point):

    every sensor  gps_ns                            nanoseconds since 1980-01-06 00:00:00 GPS, whole number; or
                  gps_week, seconds_of_week         GPS week (not modulo 1024) and seconds of week
    ins           latitude_deg, longitude_deg, height_m (ellipsoidal), roll_deg (starboard down +),
                  pitch_deg (bow up +), heading_deg (clockwise from true north)
    laser         x_m, y_m, z_m                     in the frame that session.yaml names
    mbes          ping, beam, angle_deg (starboard +), sound_speed_m_s, and two_way_time_s or range_m (one way);
                  transmit_tilt_deg (along track, forward +) where the transmit fan is tilted: 0 without the column

A CSV row of the wrong number of columns, and a last line without line end (it may be cut off), are left out and
counted. A word where a number should be is refused, as are times and positions that have been stored as float32.
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
from pipeline.readers.crs import Frame, keep_placed
from pipeline.readers.float32_checks import refuse_float32
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import (
    INS_COLUMNS,
    LASER_COLUMNS,
    MBES_COLUMNS,
    Order,
    Sieve,
    chunk,
    keep_possible_poses,
    keep_possible_soundings,
    latency_ns,
    no_rows,
    possible_ns,
    possible_week_time,
)
from pipeline.readers.table_columns import WHOLE, Sensor, batches

CANONICAL = {"ins": INS_COLUMNS, "laser": LASER_COLUMNS, "mbes": MBES_COLUMNS}


@dataclass(frozen=True)
class TablePart:
    """One table."""

    path: Path
    name: str
    sensor: Sensor
    frame: Frame
    latency_s: float
    max_records: int | None = None

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        order = Order(self.name)
        canonical = CANONICAL[self.sensor]
        first = True
        with opened(self.path, self.name) as file:
            for batch in batches(file, self.name, self.sensor, dropped, self.max_records):
                columns = _numpy(batch, dropped)
                if first:
                    refuse_float32(columns, self.name)
                    first = False
                yield self._chunk(columns, order, dropped)
            if dropped:
                yield no_rows(canonical, dropped)
        order.check()

    @np.errstate(all="ignore")  # damaged numbers are counted, not warned of
    def _chunk(self, columns: dict[str, NDArray[Any]], order: Order, dropped: Counter[str]) -> Chunk:
        sieve = Sieve(columns, dropped)
        _keep_timed(sieve, self.latency_s)
        if self.sensor == "ins":
            _to_poses(sieve)
            order.keep(sieve)
        elif self.sensor == "laser":
            sieve.keep_finite()
            keep_placed(sieve, self.frame, self.name)
        else:
            _to_soundings(sieve)
        return chunk(sieve.columns, CANONICAL[self.sensor], dropped)


def _numpy(batch: pa.RecordBatch, dropped: Counter[str]) -> dict[str, NDArray[Any]]:
    whole = batch.drop_null()
    if whole.num_rows < batch.num_rows:
        dropped["missing value"] += batch.num_rows - whole.num_rows
    columns = {}
    for column in whole.schema.names:
        values = whole[column].to_numpy(zero_copy_only=False)
        columns[column] = values if column in WHOLE else values.astype(np.float64)
    return columns


def _keep_timed(sieve: Sieve, latency_s: float) -> None:
    """Column t_ns, latency taken off, in place of the table's own time."""
    for column in WHOLE:
        if column in sieve.columns and sieve[column].dtype.kind == "f":
            sieve.keep(np.isfinite(sieve[column]) & (np.abs(sieve[column]) < 1e15), "not a whole number")
            sieve.keep(sieve[column] == np.rint(sieve[column]), "not a whole number")
    if "gps_ns" in sieve.columns:
        sieve.keep(possible_ns(sieve["gps_ns"]), "impossible time")
        t_ns = sieve["gps_ns"].astype(np.int64)
    else:
        sieve.keep(possible_week_time(sieve["gps_week"], sieve["seconds_of_week"]), "impossible time")
        t_ns = gps_ns_from_week_seconds(sieve["gps_week"].astype(np.int64), sieve["seconds_of_week"])
    sieve.columns["t_ns"] = t_ns - latency_ns(latency_s)


def _to_poses(sieve: Sieve) -> None:
    for name in ("latitude", "longitude", "roll", "pitch", "heading"):
        sieve.columns[f"{name}_rad"] = np.radians(sieve[f"{name}_deg"])
    sieve.columns["azimuth_rad"] = sieve["heading_rad"]
    keep_possible_poses(sieve)


def _to_soundings(sieve: Sieve) -> None:
    sieve.keep((sieve["beam"] >= 0) & (sieve["beam"] <= np.iinfo(np.int16).max), "impossible beam")
    sieve.columns["angle_rad"] = np.radians(sieve["angle_deg"])
    tilt_deg = sieve.columns.get("transmit_tilt_deg", np.zeros(len(sieve)))
    sieve.columns["transmit_tilt_rad"] = np.radians(tilt_deg)
    if "two_way_time_s" not in sieve.columns:
        sieve.columns["two_way_time_s"] = 2 * sieve["range_m"] / sieve["sound_speed_m_s"]
    keep_possible_soundings(sieve)
