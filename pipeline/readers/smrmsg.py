"""SMRMSG, the accuracy file that POSPac and others write beside an SBET: 10 little-endian doubles a record, no header.

A record has time (GPS seconds of week), and the RMS of position north, east, down [m], of velocity north, east, down
[m/s], and of roll, pitch, heading [arc-minutes]. The file does not hold the week. It gets the week that brings its
beginning nearest to that of the SBET.
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

_RECORD_BYTES = 10 * 8
_ROWS = 65_536  # read at a time
_COLUMNS = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
_PLACES = (1, 2, 3, 7, 8, 9)  # places of these columns in a record
_SCALES = (1.0, 1.0, 1.0, 1 / 60, 1 / 60, 1 / 60)


@dataclass(frozen=True)
class SmrmsgPart:
    """One file; ``gps_week`` is the week of its first record. Its chunks hold sigmas only."""

    path: Path
    name: str
    gps_week: int
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the sigmas, batch by batch."""
        week, last = self.gps_week, -np.inf
        with opened(self.path, self.name) as file:
            while data := file.read(_ROWS * _RECORD_BYTES):
                records = np.frombuffer(data, "<f8", count=len(data) // _RECORD_BYTES * 10).reshape(-1, 10)
                dropped = Counter({"stray bytes at the end": len(data) % _RECORD_BYTES})
                if len(records):
                    weeks, week, last = running_weeks(records[:, 0], week, last)
                    good = possible_week_time(weeks, records[:, 0])
                    dropped["accuracy at an impossible time"] += int(np.count_nonzero(~good))
                    t_ns = gps_ns_from_week_seconds(weeks[good], records[good, 0]) - latency_ns(self.latency_s)
                    values = (records[good, place] * scale for place, scale in zip(_PLACES, _SCALES, strict=True))
                    sigmas = sigma_rows(t_ns, dict(zip(_COLUMNS, values, strict=True)), dropped)
                    yield Chunk({}, {reason: count for reason, count in dropped.items() if count}, sigmas)
