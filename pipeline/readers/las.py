"""LAS 1.0 to 1.5 and LAZ, by laspy and lazrs (ASPRS, "LAS Specification 1.4 R15").

The header is checked here before laspy sees it: a damaged one may claim billions of points or of variable-length
records, which must cost neither memory nor time. A file is read in *stretches* of at most 4,000,000 points, so that
workers can share it. Header (little-endian): 6 u16 global encoding (bit 0: adjusted standard GPS time, else seconds of
week), 24 u8 x 2 version, 94 u16 header size, 96 u32 offset to points, 100 u32 number of VLRs, 104 u8 point format
(bit 7: LAZ), 105 u16 record length, 107 u32 points, 131 f64 x 3 scales, 155 f64 x 3 offsets, 247 u64 points (1.4).

Seconds of week need ``laser.gps_week``, the week of the first point; points more than half a week before that belong
to the next one. Adjusted standard time is GPS seconds since the epoch - 1e9 (:mod:`pipeline.readers.las_times`).
"""

import logging
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import BATCH_ROWS, Chunk
from pipeline.config.recording import LasTime
from pipeline.errors import RawDataError
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, NS, gps_ns_from_week_seconds
from pipeline.readers.crs import Frame, keep_placed, placing_of
from pipeline.readers.declared_crs import refuse_another
from pipeline.readers.decoder_process import Numbers
from pipeline.readers.las_times import WEEK_S, refuse_useless
from pipeline.readers.laz import points_at_most, unpack
from pipeline.readers.raw_file import opened, read_at, size_of
from pipeline.readers.row_checks import LASER_COLUMNS, Sieve, chunk, latency_ns, no_rows, possible_ns

STRETCH = 4_000_000
MAX_OFFSET = 1 << 26
COARSEST_M = 0.01  # scale of coordinates; 1e-7 degrees are 11 mm
TIMED_FORMATS = frozenset({1, 3, 4, 5, 6, 7, 8, 9, 10})
LENGTHS = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)  # least record length by point format
MAX_SECONDS = 1e10  # of adjusted time, which int64 nanoseconds must hold
logging.getLogger("laspy").addHandler(logging.NullHandler())  # what laspy logs, the exceptions say as well


@dataclass(frozen=True)
class Header:
    """What a LAS header says, checked against the file's size."""

    adjusted_time: bool
    told: LasTime  # what session.yaml says of the times, which goes before the flag
    compressed: bool
    size: int  # of the file, bytes
    claimed: int
    present: int
    first_s: float  # GPS time of the first point
    scales: tuple[float, ...]


@dataclass(frozen=True)
class LasPart:
    """Points ``start`` to ``stop`` of one file; ``missing`` are points the header claims and the file has not."""

    path: Path
    name: str
    compressed: bool
    start: int
    stop: int
    missing: int
    frame: Frame
    crs: str  # what the file itself says of its frame: WKT or nothing
    latency_s: float
    gps_week: int | None  # None: adjusted standard time
    told: LasTime
    first_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter({"truncated": self.missing})
        done = self.start
        with opened(self.path, self.name) as file:
            for points in self._points(file):
                first = done == self.start
                done += len(points[0])
                yield self._chunk(points, dropped, first)
        dropped["truncated"] += self.stop - done
        if dropped["truncated"]:
            yield no_rows(LASER_COLUMNS, dropped)

    def _points(self, file: BinaryIO) -> Iterator[Numbers]:
        if self.stop <= self.start:
            return iter(())
        if self.compressed:
            return unpack(self.path, self.name, self.start, self.stop, BATCH_ROWS)
        return _las_points(file, self.name, self.start, self.stop)

    @np.errstate(all="ignore")  # damaged numbers are counted, not warned of
    def _chunk(self, points: Numbers, dropped: Counter[str], first: bool) -> Chunk:
        seconds, x_m, y_m, z_m = points
        if first:
            refuse_useless(seconds, self.name, self.gps_week is None, self.told)
        sieve = Sieve({"seconds": seconds, "x_m": x_m, "y_m": y_m, "z_m": z_m}, dropped)
        sieve.keep_finite()
        sieve.keep(sieve["seconds"] != 0, "no time")
        sieve.columns["t_ns"] = self._gps_ns(sieve) - latency_ns(self.latency_s)
        if first:
            refuse_another(self.frame, self.crs, (sieve["x_m"], sieve["y_m"], sieve["z_m"]), self.name)
        keep_placed(sieve, self.frame, self.name)
        return chunk(sieve.columns, LASER_COLUMNS, dropped)

    def _gps_ns(self, sieve: Sieve) -> NDArray[np.int64]:
        if self.gps_week is None:
            sieve.keep(np.abs(sieve["seconds"]) < MAX_SECONDS, "impossible time")
            t_ns = gps_ns_from_week_seconds(0, sieve["seconds"]) + ADJUSTED_STANDARD_OFFSET_S * NS
            good = possible_ns(t_ns)
            sieve.keep(good, "impossible time")
            return t_ns[good]
        sieve.keep((sieve["seconds"] >= 0) & (sieve["seconds"] < 2 * WEEK_S), "impossible time")
        week = self.gps_week + (sieve["seconds"] < self.first_s - WEEK_S / 2)
        return gps_ns_from_week_seconds(week, sieve["seconds"])


def read_header(path: Path, name: str, told: LasTime = None) -> Header:
    """The header, checked.

    Raises
    ------
    RawDataError
        It contradicts itself or the file, or its point format has no time.
    """
    with opened(path, name) as file:
        size = size_of(file)
        head = file.read(375).ljust(375, b"\0")
        encoding, major, minor = struct.unpack_from("<H16x2B", head, 6)
        header_size, offset, records, form, length, claimed = struct.unpack_from("<HIIBHI", head, 94)
        scales = struct.unpack_from("<3d", head, 131)
        if minor >= 4:
            (claimed,) = struct.unpack_from("<Q", head, 247)
        compressed, form = bool(form & 0x80), form & 0x3F
        sound = major == 1 and minor <= 5 and 227 <= header_size <= offset <= min(size, MAX_OFFSET)
        sound = sound and form < len(LENGTHS) and length >= LENGTHS[form] and 54 * records <= offset - header_size
        if not sound or not all(np.isfinite(scale) and scale > 0 for scale in scales):
            raise RawDataError(f"{name}: its LAS header is damaged, or cut off; copy or export it again")
        if form not in TIMED_FORMATS:
            raise RawDataError(
                f"{name}: its point format {form} has no GPS time; export it again in point format 1, 3 or 6 to 10"
            )
        present = (size - offset) // length
        first = offset
        if compressed:
            present = points_at_most(file, name, records, header_size, offset, size)
            first = offset + 8
        time_at = first + (22 if form >= 6 else 20)
        (first_s,) = struct.unpack("<d", read_at(file, time_at, 8).ljust(8, b"\0"))
        here = min(claimed, present)
        adjusted = told == "adjusted_standard" if told else bool(encoding & 1)
        first_s = first_s if here and np.isfinite(first_s) else 0.0
        return Header(adjusted, told, compressed, size, claimed, here, first_s, scales)


def parts(
    path: Path, name: str, header: Header, gps_week: int | None, frame: Frame, latency_s: float
) -> tuple[LasPart, ...]:
    """A file's stretches. ``gps_week`` is None for adjusted standard time."""
    _refuse_coarse(header.scales, frame, name)
    crs = _crs_of(path, name) if frame != Frame() else ""
    starts = range(0, header.present, STRETCH) or range(1)
    made = []
    for k, start in enumerate(starts):
        stop = min(start + STRETCH, header.present)
        missing = header.claimed - header.present if k == len(starts) - 1 else 0
        label = name if len(starts) == 1 else f"{name}#{k}"
        common = (frame, crs, latency_s, gps_week, header.told, header.first_s)
        made.append(LasPart(path, label, header.compressed, start, stop, missing, *common))
    return tuple(made)


def _refuse_coarse(scales: tuple[float, ...], frame: Frame, name: str) -> None:
    """Coordinates are whole numbers of a scale, which must not blur what is measured to millimetres."""
    placing = placing_of(frame)
    unit_m, height_unit_m = (1.0, 1.0) if placing is None else (placing.unit_m, placing.height_unit_m)
    units_m = (unit_m, unit_m, height_unit_m)
    for axis, scale, axis_unit_m in zip("xyz", scales, units_m, strict=True):
        if scale * axis_unit_m > COARSEST_M * 1.2:
            raise RawDataError(
                f"{name}: its {axis} are whole numbers of {scale:g}, steps of {scale * axis_unit_m:.3g} m; export it "
                f"again with a scale of {0.1 * COARSEST_M / axis_unit_m:.1g} or finer"
            )


def _crs_of(path: Path, name: str) -> str:
    """The CRS in the file's variable-length records; nothing where there is none that can be understood."""
    import laspy
    from pyproj.exceptions import ProjError

    try:
        with opened(path, name) as file:
            crs = laspy.LasHeader.read_from(file, read_evlrs=False).parse_crs()
    except (laspy.LaspyException, ProjError, ValueError, LookupError, OverflowError, struct.error, EOFError):
        return ""
    return "" if crs is None else str(crs.to_wkt())


def _las_points(file: BinaryIO, name: str, start: int, stop: int) -> Iterator[Numbers]:
    """GPS time, x, y, z of points ``start`` to ``stop``, batch by batch."""
    import laspy

    try:
        reader = laspy.LasReader(file, closefd=False, read_evlrs=False)
        if start:
            reader.seek(start)
        while start < stop:
            points = reader.read_points(min(BATCH_ROWS, stop - start))
            if not len(points):
                return
            yield tuple(np.asarray(values, np.float64) for values in (points.gps_time, points.x, points.y, points.z))
            start += len(points)
    except (laspy.LaspyException, ValueError, LookupError, OverflowError, struct.error) as error:
        raise RawDataError(f"{name}: is damaged ({error}); copy or export it again") from error
