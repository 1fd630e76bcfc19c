"""SBET: 17 little-endian doubles a record, seconds of week (Applanix POSPac).

time, latitude, longitude (rad), height (ellipsoidal), velocities (wander frame), roll, pitch, platform heading, wander
angle, accelerations, angular rates. True heading = platform heading - wander. Forward-right-down against north-east-down
is the same three numbers as starboard-forward-up against east-north-up (roll, pitch, azimuth).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.records import ins_columns
from pipeline.streams import Chunk
from pipeline.times import gps_ns_from_week_seconds

RECORD = 136
ROWS = 100_000
STRAY_LIMIT = 8  # bytes after the last whole record that are no cut record: less than one of its numbers


@dataclass(frozen=True)
class SbetPart:
    """One SBET file; seconds that fall back by about a week start the next one."""

    path: Path
    name: str
    gps_week: int | None
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        if self.gps_week is None:
            raise ConfigError(
                f"session.yaml: ins.gps_week: is missing; {self.path.name} holds seconds of week alone: give the GPS week"
            )
        stray = self.path.stat().st_size % RECORD
        if stray >= STRAY_LIMIT:
            raise RawDataError(
                f"{self.path}: is cut: {stray} bytes follow the last whole record of {RECORD}; copy or export it again"
            )
        week, last = self.gps_week, -np.inf
        dropped = {"stray bytes at the end": stray} if stray else {}
        with self.path.open("rb") as file:
            while True:
                block = np.fromfile(file, "<f8", ROWS * 17)
                table = block[: len(block) // 17 * 17].reshape(-1, 17)
                if len(table) == 0:
                    break
                seconds = table[:, 0]
                good = np.isfinite(seconds) & (seconds >= 0) & (seconds < 2 * 604_800)
                if not good.all():
                    dropped["impossible time"] = dropped.get("impossible time", 0) + int((~good).sum())
                    table, seconds = table[good], seconds[good]
                if len(seconds) == 0:
                    continue
                jumps = np.diff(seconds, prepend=last if np.isfinite(last) else seconds[0]) < -302_400
                weeks = week + np.cumsum(jumps)
                week, last = int(weeks[-1]), float(seconds[-1])
                degrees = np.degrees(table)
                yield ins_columns(
                    gps_ns_from_week_seconds(weeks, seconds),
                    self.latency_s,
                    degrees[:, 1],
                    degrees[:, 2],
                    table[:, 3],
                    degrees[:, 7],
                    degrees[:, 8],
                    degrees[:, 9] - degrees[:, 10],
                    dropped,
                )
                dropped = {}
        if dropped:
            yield ins_columns(np.empty(0, np.int64), 0.0, *np.empty((6, 0)), dropped=dropped)
