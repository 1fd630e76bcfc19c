"""NovAtel OEM/SPAN logs, binary and ASCII: INSPVA, INSPVAS and INSPVAX records, and the INS's own sigmas.

A record is usable if its status is INS_SOLUTION_GOOD, INS_ALIGNMENT_COMPLETE or INS_SOLUTION_FREE. If a file has
several of the three kinds, the kind with the most usable records is used. INSPVAX must have more than twice as many,
because INSPVA and INSPVAS have ellipsoidal heights. Heights of INSPVAX are above sea level: its undulation is added.

The sigmas (latitude, longitude, height [m], velocities, roll, pitch, azimuth [degrees]) are those of INSSTDEV. Without
INSSTDEV they are those of INSSTDEVS, or else those of usable INSPVAX. Their time is the one in the record's header.
"""

import threading
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.artefacts.streams import Chunk
from pipeline.gps_time import gps_ns_from_week_seconds
from pipeline.readers.novatel_records import USABLE, Records, choose_records, read_records
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import keep_possible_poses, latency_ns, possible_week_time, sigma_rows
from pipeline.readers.row_filter import INS_COLUMNS, SIGMA_COLUMNS, Columns, RowFilter, TimeOrder, chunk, no_rows

STATUS = {
    0: "INS_INACTIVE", 1: "INS_ALIGNING", 2: "INS_HIGH_VARIANCE", 3: "INS_SOLUTION_GOOD", 6: "INS_SOLUTION_FREE",
    7: "INS_ALIGNMENT_COMPLETE", 8: "DETERMINING_ORIENTATION", 9: "WAITING_INITIALPOS", 10: "WAITING_AZIMUTH",
    11: "INITIALIZING_BIASES", 12: "MOTION_DETECT", 14: "WAITING_ALIGNMENTORIENTATION",
}
STATES = {"status": STATUS, "type": {
    52: "INS_SBAS", 53: "INS_PSRSP", 54: "INS_PSRDIFF", 55: "INS_RTKFLOAT", 56: "INS_RTKFIXED", 68: "PPP_CONVERGING",
    69: "PPP", 73: "INS_PPP_CONVERGING", 74: "INS_PPP",
}}  # kept with each record: the filter's state, and in INSPVAX the kind of position
_SIGMA_PLACES = dict(zip(SIGMA_COLUMNS[1:], (0, 1, 2, 6, 7, 8), strict=True))  # places among the nine of a record
_ANGLES = ("latitude", "longitude", "roll", "pitch", "azimuth")
# Two decoders in two threads sometimes lose a record. The lock is kept for a whole file, whose records become a table
# in memory anyway. Therefore no thread waits for anything else while it keeps the lock.
_DECODER = threading.Lock()


@dataclass(frozen=True)
class NovatelPart:
    """One log file."""

    path: Path
    name: str
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the INS records in canonical columns, with their sigmas, batch by batch."""
        with _DECODER:
            chunks = list(self._decode())
        yield from chunks

    def _decode(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        with opened(self.path, self.name) as file:
            kinds = choose_records(file, dropped)
            order = TimeOrder(self.name)
            if kinds.poses is not None:
                for records in read_records(file, kinds.poses):
                    sigmas = _sigmas(records, self.latency_s, dropped) if kinds.sigmas == kinds.poses else {}
                    yield _chunk(records, order, self.latency_s, dropped, sigmas)
            if kinds.poses is not None and kinds.sigmas is not None and kinds.sigmas != kinds.poses:
                for records in read_records(file, kinds.sigmas):
                    sigmas = _sigmas(records, self.latency_s, dropped)
                    yield chunk({name: np.empty(0) for name in INS_COLUMNS}, INS_COLUMNS, dropped, sigmas)
            if dropped:
                yield no_rows(INS_COLUMNS, dropped)
            order.check()


@np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
def _chunk(
    records: Records, order: TimeOrder, latency_s: float, dropped: Counter[str], sigmas: Columns
) -> Chunk:
    """Return a chunk of the records' usable poses, with ``sigmas``; count the other records in ``dropped``."""
    usable = np.isin(records["status"], USABLE)
    for status, count in zip(*np.unique(records["status"][~usable], return_counts=True), strict=True):
        dropped[f"ins status {STATUS.get(int(status), int(status))}"] += int(count)
    records = records[usable]
    names = records.dtype.names or ()
    own_time = "week" in names
    undulation = records["undulation"] if "undulation" in names else 0.0
    rows = RowFilter(
        {
            "week": records["week" if own_time else "header_week"].astype(np.int64),
            "seconds": records["seconds"].astype(float) if own_time else records["header_ms"] / 1000.0,
            "height_m": records["height"] + undulation,
            **{f"{name}_rad": np.radians(records[name]) for name in _ANGLES},
            **{name: records[name].astype(np.uint8) for name in STATES if name in names},
        },
        dropped,
    )
    keep_possible_poses(rows)
    rows.keep(possible_week_time(rows["week"], rows["seconds"]), "impossible time")
    t_ns = gps_ns_from_week_seconds(rows["week"], rows["seconds"])
    rows.columns["t_ns"] = t_ns - latency_ns(latency_s)
    order.keep(rows)
    states = {name: rows[name] for name in STATES if name in names}
    return replace(chunk(rows.columns, INS_COLUMNS, dropped, sigmas), states=states)


@np.errstate(all="ignore")
def _sigmas(records: Records, latency_s: float, dropped: Counter[str]) -> Columns:
    """Return the INS's own sigmas, columns SIGMA_COLUMNS."""
    if "status" in (records.dtype.names or ()):
        records = records[np.isin(records["status"], USABLE)]
    week, seconds = records["header_week"].astype(np.int64), records["header_ms"] / 1000.0
    possible = possible_week_time(week, seconds)
    dropped["accuracy at an impossible time"] += int(np.count_nonzero(~possible))
    t_ns = gps_ns_from_week_seconds(week[possible], seconds[possible]) - latency_ns(latency_s)
    sigmas = records["sigmas"][possible].T
    return sigma_rows(t_ns, {name: sigmas[place] for name, place in _SIGMA_PLACES.items()}, dropped)
