"""E57 (ASTM E2807), by pye57's libE57Format in a process of its own (:mod:`pipeline.readers.e57_worker`).

pye57's own class reads a scan whole and knows no times, so the worker uses the library's reader beneath it, which fills
buffers of a batch and looks at every page's checksum. That reader cannot seek: a scan is one part.

A point's ``timeStamp`` is seconds since the scan's ``acquisitionStart``, which is seconds since the GPS epoch without
leap seconds, if its clock was set by GPS (``isAtomicClockReferenced``). Both are optional in the format and needed
here. Coordinates are metres, Cartesian or spherical (range, azimuth from x to y, elevation from the xy plane); the
scan's pose brings them into the frame of the file, which ``laser.frame`` names. Points and times that are marked as
invalid are left out.

The library sees a file only after :mod:`pipeline.readers.e57_xml` has looked at its header and its XML part. Where
integers of a constant take no bits, a damaged count of points would be endless: see
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
from pipeline.readers.crs import AXES, Array, Frame, keep_placed
from pipeline.readers.declared_crs import refuse_another
from pipeline.readers.decoder_process import ADVICE, Numbers, batches, text
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.row_checks import LASER_COLUMNS, LAST_WEEK, Sieve, chunk, latency_ns, no_rows, possible_ns

WORKER = Path(__file__).with_name("e57_worker.py")
MAX_TEXT = 1 << 24
MAX_SECONDS = 1e8  # of a time stamp: three years
COARSEST_M = 0.001  # of coordinates in single precision
RETIME = "export it again with a time stamp for each point, or as LAS or LAZ with GPS time"


@dataclass(frozen=True)
class Scan:
    """What a file says of one scan; rotation w, x, y, z."""

    points: int
    timed: bool
    axes: str  # cartesian, spherical; "" where neither is there
    single: bool
    start_s: float
    atomic: bool
    rotation: list[float]
    translation: list[float]


@dataclass(frozen=True)
class E57Part:
    """One scan of a file; ``crs``: what the file itself says of its frame, WKT or nothing."""

    path: Path
    name: str
    number: int
    scan: Scan
    crs: str
    frame: Frame
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        done = 0
        for numbers in points(self.path, self.name, self.number):
            if not done:
                refuse_another(self.frame, self.crs, placed(numbers, self.scan), self.name)
            done += len(numbers[0])
            yield self._chunk(numbers, dropped)
        dropped["truncated"] += self.scan.points - done
        if dropped["truncated"]:
            yield no_rows(LASER_COLUMNS, dropped)

    @np.errstate(all="ignore")  # damaged numbers are counted, not warned of
    def _chunk(self, numbers: Numbers, dropped: Counter[str]) -> Chunk:
        self._refuse_float32(numbers)
        seconds, *_, invalid, untimed = numbers
        columns = dict(zip(AXES, placed(numbers, self.scan), strict=True))
        sieve = Sieve(columns | {"seconds": seconds, "invalid": invalid, "untimed": untimed}, dropped)
        sieve.keep(sieve["invalid"] == 0, "point marked as invalid")
        sieve.keep(sieve["untimed"] == 0, "no time")
        sieve.keep_finite()
        sieve.keep(np.abs(sieve["seconds"]) < MAX_SECONDS, "impossible time")
        sieve.columns["t_ns"] = self._gps_ns(sieve["seconds"])
        sieve.keep(possible_ns(sieve["t_ns"]), "impossible time")
        sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(self.latency_s)
        keep_placed(sieve, self.frame, self.name)
        return chunk(sieve.columns, LASER_COLUMNS, dropped)

    def _gps_ns(self, seconds: NDArray[np.float64]) -> NDArray[np.int64]:
        whole = int(np.floor(self.scan.start_s))
        fraction_s = self.scan.start_s - whole
        return whole * NS + np.rint((seconds + fraction_s) * NS).astype(np.int64)

    def _refuse_float32(self, numbers: Numbers) -> None:
        largest = max(float(np.max(np.abs(values), initial=0.0)) for values in numbers[1:4])
        step = float(np.spacing(np.float32(largest))) if self.scan.single and largest < 1e30 else 0.0
        if through_float32(numbers[0]) or step > COARSEST_M:
            raise RawDataError(
                f"{self.name}: its times or coordinates went through float32; export it again in double precision"
            )


def parts(
    path: Path, name: str, frame: Frame, latency_s: float, max_records: int | None = None
) -> tuple[E57Part, ...]:
    """A file's scans.

    Raises
    ------
    RawDataError
        The file is damaged or cut off, has no points, or more than likely, or has points whose GPS time is not known.
    """
    scans, crs = scans_of(path, name)
    with opened(path, name) as file:
        refuse_claim(_points_claimed(scans), size_of(file), max_records, "laser", name)
    for number, scan in enumerate(scans):
        where = name if len(scans) == 1 else f"{name}, scan {number}"
        if not scan.axes:
            raise RawDataError(f"{where}: has no coordinates of points; {ADVICE}")
        if not scan.timed:
            raise RawDataError(f"{where}: has no times of points (timeStamp); {RETIME}")
        if not scan.atomic:
            raise RawDataError(
                f"{where}: says that its clock was not set by GPS (acquisitionStart, isAtomicClockReferenced); {RETIME}"
            )
        if not 0 <= scan.start_s < LAST_WEEK * WEEK_NS / NS or not _possible_pose(scan):
            raise RawDataError(f"{where}: its pose or start of acquisition is damaged; {ADVICE}")
    names = [name] if len(scans) == 1 else [f"{name}#{number}" for number in range(len(scans))]
    return tuple(
        E57Part(path, label, number, scan, crs, frame, latency_s)
        for number, (label, scan) in enumerate(zip(names, scans, strict=True))
    )


def _points_claimed(scans: list[Scan]) -> int:
    counts = [scan.points for scan in scans]
    return min(counts) if min(counts) < 0 else sum(counts)


def _possible_pose(scan: Scan) -> bool:
    length = np.linalg.norm(scan.rotation)
    return bool(np.all(np.isfinite(scan.translation)) and 0.5 < length < 2)


def scans_of(path: Path, name: str) -> tuple[list[Scan], str]:
    """The scans, and the CRS that the file gives for its frame."""
    e57_xml.check(path, name)
    try:
        told: dict[str, Any] = json.loads(text(WORKER, [str(path)], name, MAX_TEXT))
    except ValueError as error:
        raise RawDataError(f"{name}: is damaged ({error}); {ADVICE}") from error
    scans = [Scan(**scan) for scan in told["scans"]]
    if not scans:
        raise RawDataError(f"{name}: has no scans; {ADVICE}")
    return scans, told["crs"]


def points(path: Path, name: str, number: int) -> Iterator[Numbers]:
    """A scan's points as stored: seconds, three coordinates, marks of invalid points and of invalid times."""
    e57_xml.check(path, name)  # again: the file may be another by now
    return batches(WORKER, [str(path), str(number), str(BATCH_ROWS)], name, 6, BATCH_ROWS)


@np.errstate(all="ignore")
def placed(numbers: Numbers, scan: Scan) -> tuple[Array, Array, Array]:
    """Coordinates in the frame of the file: Cartesian, through the scan's pose."""
    x, y, z = numbers[1:4]
    if scan.axes == "spherical":
        distance, azimuth, elevation = x, y, z
        level = distance * np.cos(elevation)
        x, y, z = level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)
    quaternion = np.array(scan.rotation) / np.linalg.norm(scan.rotation)
    x, y, z = rotation_from_quaternion(quaternion) @ np.array([x, y, z]) + np.array(scan.translation)[:, None]
    return x, y, z
