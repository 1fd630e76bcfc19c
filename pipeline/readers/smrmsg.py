"""SMRMSG, the accuracies that POSPac and others write beside an SBET: 10 little-endian doubles a record, no header.

Time (GPS seconds of week), RMS of position north, east, down [m], of velocity north, east, down [m/s], of roll, pitch,
heading [arc-minutes]. The week is not in the file: that nearest to the SBET's.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.artefacts.streams import Chunk
from pipeline.gps_time import gps_ns_from_week_seconds
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import latency_ns, possible_week_time, sigma_rows
from pipeline.readers.sbet import running_weeks

RECORD = 10 * 8
ROWS = 65_536
COLUMNS = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
PLACES = (1, 2, 3, 7, 8, 9)
SCALES = (1.0, 1.0, 1.0, 1 / 60, 1 / 60, 1 / 60)


@dataclass(frozen=True)
class AccuracyPart:
    """One file; ``gps_week`` is the week of its first record. Its chunks have sigmas alone."""

    path: Path
    name: str
    gps_week: int
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        week, last = self.gps_week, -np.inf
        with opened(self.path, self.name) as file:
            while data := file.read(ROWS * RECORD):
                records = np.frombuffer(data, "<f8", count=len(data) // RECORD * 10).reshape(-1, 10)
                dropped = Counter({"stray bytes at the end": len(data) % RECORD})
                if len(records):
                    weeks, week, last = running_weeks(records[:, 0], week, last)
                    good = possible_week_time(weeks, records[:, 0])
                    dropped["accuracy at an impossible time"] += int(np.count_nonzero(~good))
                    t_ns = gps_ns_from_week_seconds(weeks[good], records[good, 0]) - latency_ns(self.latency_s)
                    given = (records[good, place] * scale for place, scale in zip(PLACES, SCALES, strict=True))
                    sigmas = sigma_rows(t_ns, dict(zip(COLUMNS, given, strict=True)), dropped)
                    yield Chunk({}, {reason: count for reason, count in dropped.items() if count}, sigmas)
