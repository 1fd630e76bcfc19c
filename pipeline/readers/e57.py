"""E57 (ASTM E2807), read with pye57's libE57Format in a process of its own (:mod:`pipeline.readers.e57_worker`).

pye57's own class reads a whole scan at once, and reads no times. The worker therefore uses the reader of libE57Format
below that class. It fills buffers of one batch, and verifies the checksum of every page. It cannot seek, and therefore
one scan is one part.

A point's ``timeStamp`` is in seconds since the scan's ``acquisitionStart``. If the scanner's clock was set by GPS
(``isAtomicClockReferenced``), ``acquisitionStart`` is in seconds since the GPS epoch, without leap seconds. Both are
optional in E57, but this reader needs them. Coordinates are in metres, Cartesian or spherical (range, azimuth from x to
y, elevation from the xy plane). The scan's pose transforms them to the frame of the file, which ``laser.frame`` names.
A point is left out if the point or its time is marked as invalid.

Integers of one constant value take no space in the file. A damaged number of points would therefore have no limit; see
:mod:`pipeline.readers.claimed_counts`.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.crs import COORDINATES, LaserFrame, transform_to_ecef
from pipeline.readers.declared_crs import refuse_other_crs
from pipeline.readers.decoder_process import REMEDY, DecodedColumns
from pipeline.readers.e57_scans import E57Scan, file_coordinates, read_scans, stored_points
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.row_checks import LAST_WEEK, latency_ns, possible_ns
from pipeline.readers.row_filter import LASER_COLUMNS, RowFilter, chunk, no_rows

_MAX_SECONDS = 1e8  # largest time stamp: three years
_COARSEST_M = 0.001  # largest step of coordinates in single precision
RETIME = "export it again with a time stamp for each point, or as LAS or LAZ with GPS time"


@dataclass(frozen=True)
class E57Part:
    """One scan of an E57 file."""

    path: Path
    name: str
    number: int
    scan: E57Scan
    crs: str  # CRS that the file declares, WKT; empty: none
    frame: LaserFrame
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the points in canonical columns, batch by batch."""
        dropped: Counter[str] = Counter()
        done = 0
        for decoded in stored_points(self.path, self.name, self.number):
            if not done:
                refuse_other_crs(self.frame, self.crs, file_coordinates(decoded, self.scan), self.name)
            done += len(decoded[0])
            yield self._chunk(decoded, dropped)
        dropped["truncated"] += self.scan.points - done
        if dropped["truncated"]:
            yield no_rows(LASER_COLUMNS, dropped)

    @np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
    def _chunk(self, decoded: DecodedColumns, dropped: Counter[str]) -> Chunk:
        self._refuse_float32(decoded)
        seconds, *_, invalid, untimed = decoded
        columns = dict(zip(COORDINATES, file_coordinates(decoded, self.scan), strict=True))
        rows = RowFilter(columns | {"seconds": seconds, "invalid": invalid, "untimed": untimed}, dropped)
        rows.keep(rows["invalid"] == 0, "point marked as invalid")
        rows.keep(rows["untimed"] == 0, "no time")
        rows.keep_finite()
        rows.keep(np.abs(rows["seconds"]) < _MAX_SECONDS, "impossible time")
        rows.columns["t_ns"] = self._gps_ns(rows["seconds"])
        rows.keep(possible_ns(rows["t_ns"]), "impossible time")
        rows.columns["t_ns"] = rows["t_ns"] - latency_ns(self.latency_s)
        transform_to_ecef(rows, self.frame, self.name)
        return chunk(rows.columns, LASER_COLUMNS, dropped)

    def _gps_ns(self, seconds: NDArray[np.float64]) -> NDArray[np.int64]:
        whole = int(np.floor(self.scan.start_s))
        fraction_s = self.scan.start_s - whole
        return whole * NS + np.rint((seconds + fraction_s) * NS).astype(np.int64)

    def _refuse_float32(self, decoded: DecodedColumns) -> None:
        largest = max(float(np.max(np.abs(values), initial=0.0)) for values in decoded[1:4])
        step = float(np.spacing(np.float32(largest))) if self.scan.single and largest < 1e30 else 0.0
        if through_float32(decoded[0]) or step > _COARSEST_M:
            raise RawDataError(
                f"{self.name}: its times or coordinates went through float32; export it again in double precision"
            )


def e57_parts(
    path: Path, name: str, frame: LaserFrame, latency_s: float, max_records: int | None = None
) -> tuple[E57Part, ...]:
    """Return a file's scans as parts.

    Parameters
    ----------
    path : Path
        The E57 file.
    name : str
        Its path in the session folder.
    frame : LaserFrame
        Frame of the file's coordinates.
    latency_s : float
        Recorded minus true time, s.
    max_records : int or None
        ``laser.max_records`` of session.yaml.

    Returns
    -------
    tuple of E57Part

    Raises
    ------
    RawDataError
        The file is damaged or cut off, claims more points than it can hold, or a scan has no coordinates or no GPS
        times.
    """
    scans, crs = read_scans(path, name)
    with opened(path, name) as file:
        refuse_claim(_points_claimed(scans), size_of(file), max_records, "laser", name)
    for number, scan in enumerate(scans):
        where = name if len(scans) == 1 else f"{name}, scan {number}"
        if not scan.axes:
            raise RawDataError(f"{where}: has no coordinates of points; {REMEDY}")
        if not scan.timed:
            raise RawDataError(f"{where}: has no times of points (timeStamp); {RETIME}")
        if not scan.atomic:
            raise RawDataError(
                f"{where}: says that its clock was not set by GPS (acquisitionStart, isAtomicClockReferenced); {RETIME}"
            )
        if not 0 <= scan.start_s < LAST_WEEK * WEEK_NS / NS or not _possible_pose(scan):
            raise RawDataError(f"{where}: its pose or start of acquisition is damaged; {REMEDY}")
    names = [name] if len(scans) == 1 else [f"{name}#{number}" for number in range(len(scans))]
    return tuple(
        E57Part(path=path, name=label, number=number, scan=scan, crs=crs, frame=frame, latency_s=latency_s)
        for number, (label, scan) in enumerate(zip(names, scans, strict=True))
    )


def _points_claimed(scans: list[E57Scan]) -> int:
    counts = [scan.points for scan in scans]
    return min(counts) if min(counts) < 0 else sum(counts)


def _possible_pose(scan: E57Scan) -> bool:
    length = np.linalg.norm(scan.rotation)
    return bool(np.all(np.isfinite(scan.translation)) and 0.5 < length < 2)


