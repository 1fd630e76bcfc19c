"""E57 (ASTM E2807), by pye57's libE57Format in a process of its own (:mod:`pipeline.readers.e57_worker`).

pye57's own class reads a scan whole and knows no times, so the worker uses the library's reader beneath it, which fills
buffers of a batch and looks at every page's checksum. That reader cannot seek: a scan is one part.

A point's ``timeStamp`` is seconds since the scan's ``acquisitionStart``, which is seconds since the GPS epoch without
leap seconds, if its clock was set by GPS (``isAtomicClockReferenced``). Both are optional in the format and needed
here. Coordinates are metres, Cartesian or spherical (range, azimuth from x to y, elevation from the xy plane); the
scan's pose brings them into the frame of the file, which ``laser.frame`` names. Points and times that are marked as
invalid are left out.

The library opens a file only after :mod:`pipeline.readers.e57_xml` has checked its header and its XML part. Integers of
one constant value take no bits, so that a damaged count of points would have no limit: see
:mod:`pipeline.readers.claimed_counts`.
"""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import BATCH_ROWS, Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS
from pipeline.maths.geometry.rotations import rotation_from_quaternion
from pipeline.readers import e57_xml
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.crs import COORDINATES, Array, LaserFrame, transform_to_ecef
from pipeline.readers.declared_crs import refuse_other_crs
from pipeline.readers.decoder_process import REMEDY, DecodedColumns, decoded_batches, decoded_text
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.row_checks import (
    LASER_COLUMNS,
    LAST_WEEK,
    RowFilter,
    chunk,
    latency_ns,
    no_rows,
    possible_ns,
)

E57_WORKER = Path(__file__).with_name("e57_worker.py")
MAX_TEXT = 1 << 24
_MAX_SECONDS = 1e8  # of a time stamp: three years
_COARSEST_M = 0.001  # of coordinates in single precision
RETIME = "export it again with a time stamp for each point, or as LAS or LAZ with GPS time"


@dataclass(frozen=True)
class E57Scan:
    """One scan as the file describes it: the fields of the worker's JSON."""

    points: int
    timed: bool  # points have time stamps
    axes: str  # cartesian, spherical; "" where neither is there
    single: bool  # coordinates in single precision
    start_s: float  # acquisitionStart, seconds since the GPS epoch
    atomic: bool  # its clock was set by GPS
    rotation: list[float]  # quaternion w, x, y, z of the scan's pose
    translation: list[float]  # m


@dataclass(frozen=True)
class E57Part:
    """One scan of a file."""

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

    @np.errstate(all="ignore")  # damaged decoded are counted, not warned of
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
        The file is damaged or cut off, has no points or an unlikely number of them, or points without GPS time.
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


def read_scans(path: Path, name: str) -> tuple[list[E57Scan], str]:
    """Return the scans, and the CRS that the file declares (WKT, or empty)."""
    e57_xml.check_header_and_xml(path, name)
    try:
        description: dict[str, Any] = json.loads(decoded_text(E57_WORKER, [str(path)], name, MAX_TEXT))
    except ValueError as error:
        raise RawDataError(f"{name}: is damaged ({error}); {REMEDY}") from error
    scans = [E57Scan(**scan) for scan in description["scans"]]
    if not scans:
        raise RawDataError(f"{name}: has no scans; {REMEDY}")
    return scans, description["crs"]


def stored_points(path: Path, name: str, number: int) -> Iterator[DecodedColumns]:
    """Return an iterator over a scan's points as stored, in batches of at most BATCH_ROWS.

    Parameters
    ----------
    path : Path
        The E57 file.
    name : str
        Its path in the session folder, for messages.
    number : int
        Number of the scan, from 0.

    Returns
    -------
    iterator over tuples of six (n,) arrays
        Seconds, three coordinates, marks of invalid points and of invalid times (not 0: invalid).
    """
    e57_xml.check_header_and_xml(path, name)  # again: the file may be another by now
    return decoded_batches(E57_WORKER, [str(path), str(number), str(BATCH_ROWS)], name, 6, BATCH_ROWS)


@np.errstate(all="ignore")
def file_coordinates(decoded: DecodedColumns, scan: E57Scan) -> tuple[Array, Array, Array]:
    """Return Cartesian coordinates x, y, z (m) in the file's frame from a scan's points as stored, by its pose."""
    x, y, z = decoded[1:4]
    if scan.axes == "spherical":
        distance, azimuth, elevation = x, y, z
        horizontal = distance * np.cos(elevation)
        x, y, z = horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), distance * np.sin(elevation)
    quaternion = np.array(scan.rotation) / np.linalg.norm(scan.rotation)
    x, y, z = rotation_from_quaternion(quaternion) @ np.array([x, y, z]) + np.array(scan.translation)[:, None]
    return x, y, z
