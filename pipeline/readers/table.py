"""Plain tables, CSV or Parquet, for any sensor; times as gps_ns, or gps_week and seconds_of_week.

* ins: latitude_deg, longitude_deg, height_m (ellipsoidal), roll_deg (starboard down +), pitch_deg (bow up +), heading_deg
  (clockwise from true north)
* laser: x_m, y_m, z_m (frame as in session.yaml)
* mbes: ping, beam, angle_deg (starboard +), sound_speed_m_s, and two_way_time_s or range_m (one way)
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.las import _in_frame
from pipeline.readers.records import count, ins_columns, keep, latency, sounding_columns
from pipeline.streams import Chunk
from pipeline.times import gps_ns_from_week_seconds

NEEDED = {
    "ins": ("latitude_deg", "longitude_deg", "height_m", "roll_deg", "pitch_deg", "heading_deg"),
    "laser": ("x_m", "y_m", "z_m"),
    "mbes": ("ping", "beam", "angle_deg", "sound_speed_m_s"),
}
ROWS = 262_144


@dataclass(frozen=True)
class TablePart:
    """One table of one sensor."""

    path: Path
    name: str
    sensor: str
    kind: str  # csv or parquet
    latency_s: float
    frame: str = "laser"

    def chunks(self) -> Iterator[Chunk]:
        try:
            for batch in self._batches():
                yield self._chunk(batch)
        except (pa.ArrowInvalid, pa.ArrowTypeError, OSError) as error:
            raise RawDataError(f"{self.path}: cannot be read as a table: {error}; export it again") from error

    def _batches(self) -> Iterator[pa.RecordBatch]:
        if self.kind == "parquet":
            with pq.ParquetFile(self.path) as file:
                self._check(file.schema_arrow.names)
                yield from file.iter_batches(ROWS)
            return
        options = pa_csv.ConvertOptions(column_types={"gps_ns": pa.int64(), "gps_week": pa.int64()})
        with pa_csv.open_csv(self.path, convert_options=options) as reader:
            self._check(reader.schema.names)
            yield from reader

    def _check(self, names: list[str]) -> None:
        missing = [name for name in NEEDED[self.sensor] if name not in names]
        if "gps_ns" not in names and not {"gps_week", "seconds_of_week"} <= set(names):
            missing.append("gps_ns (or gps_week and seconds_of_week)")
        if self.sensor == "mbes" and not {"two_way_time_s", "range_m"} & set(names):
            missing.append("two_way_time_s (or range_m)")
        if missing:
            raise RawDataError(f"{self.path}: lacks column {', '.join(missing)}; README.md lists the columns of tables")

    def _chunk(self, batch: pa.RecordBatch) -> Chunk:
        def column(name: str) -> NDArray[np.float64]:
            return np.asarray(batch[name].cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)

        names = set(batch.schema.names)
        dropped: dict[str, int] = {}
        if "gps_ns" in names:
            if not pa.types.is_integer(batch["gps_ns"].type):
                raise RawDataError(f"{self.path}: gps_ns must be whole numbers: a double holds no nanoseconds of GPS time")
            t_ns = np.asarray(batch["gps_ns"].fill_null(-1).to_numpy(zero_copy_only=False)).astype(np.int64)
        else:
            week, seconds = column("gps_week"), column("seconds_of_week")
            bad = ~(np.isfinite(week) & np.isfinite(seconds))
            t_ns = gps_ns_from_week_seconds(np.where(bad, 0, week).astype(np.int64), np.where(bad, 0.0, seconds))
            t_ns[bad] = -1
        values = [column(name) for name in NEEDED[self.sensor]]
        if self.sensor == "ins":
            return ins_columns(t_ns, self.latency_s, *values, dropped=dropped)
        if self.sensor == "laser":
            good = np.all(np.isfinite(np.array(values)), axis=0) & (t_ns > 0)
            count(dropped, "not a number", int((~good).sum()))
            xyz = _in_frame(dict(zip("xyz", values, strict=True)), self.frame)
            columns: dict[str, NDArray[np.generic]] = {"t_ns": latency(t_ns, self.latency_s)}
            return Chunk(keep(columns | {f"{axis}_m": v for axis, v in xyz.items()}, good), dropped)
        ping, beam, angle, speed = values
        time = column("two_way_time_s") if "two_way_time_s" in names else 2 * column("range_m") / speed
        good = np.isfinite(ping) & np.isfinite(beam) & (np.abs(beam) < 32_768)
        count(dropped, "not a number", int((~good).sum()))
        whole = [np.where(good, v, 0.0) for v in (ping, beam)]
        time = np.where(good, time, np.nan)
        return sounding_columns(
            t_ns, self.latency_s, whole[0].astype(np.int64), whole[1].astype(np.int16), time, np.radians(angle), speed, dropped
        )
