"""LAS 1.0 to 1.5 and LAZ, by laspy and lazrs (ASPRS, "LAS Specification 1.4 R15").

A file is read in *stretches* of at most 4,000,000 points, so that workers can share it.

A file with seconds of week needs ``laser.gps_week``, the week of its first point. A point whose seconds of week are
smaller than the first point's by more than half a week belongs to the next week. Adjusted standard time is GPS seconds
since the epoch minus 1e9 (:mod:`pipeline.readers.las_times`).
"""

import logging
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import ALL, scattered
from pipeline.artefacts.streams import BATCH_ROWS, Chunk
from pipeline.config.recording import LasTime
from pipeline.errors import RawDataError
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, NS, WEEK_S, gps_ns_from_week_seconds
from pipeline.readers.crs import COORDINATES, LaserFrame, frame_transform, transform_to_ecef
from pipeline.readers.declared_crs import refuse_other_crs
from pipeline.readers.las_header import LasHeader
from pipeline.readers.las_times import refuse_unusable_times
from pipeline.readers.laz import Array, DecodedPoints, Rows, decompressed_points
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import latency_ns, possible_ns
from pipeline.readers.row_filter import LASER_COLUMNS, RowFilter, chunk, no_rows

STRETCH_POINTS = 4_000_000
_COARSEST_M = 0.01  # coarsest scale of coordinates; 1e-7 degrees are 11 mm, and are accepted
_MAX_SECONDS = 8e9  # adjusted times beyond are left out: with the offset of 1e9 s they must fit int64 nanoseconds
logging.getLogger("laspy").addHandler(logging.NullHandler())  # its exceptions say the same as its log


@dataclass(frozen=True)
class LasPart:
    """Points ``start`` to ``stop`` of one file."""

    path: Path
    name: str
    compressed: bool
    start: int
    stop: int
    missing: int  # points that the header claims and the file lacks
    frame: LaserFrame
    crs: str  # CRS that the file declares, WKT; empty: none
    latency_s: float
    gps_week: int | None  # None: adjusted standard time
    declared_time: LasTime
    first_s: float
    limit: int = ALL  # points whose times draw a larger number are left out, before their frame is left

    def chunks(self) -> Iterator[Chunk]:
        """Yield the points in canonical columns, batch by batch."""
        dropped: Counter[str] = Counter({"truncated": self.missing})
        done = self.start
        with opened(self.path, self.name) as file:
            for points in self._points(file):
                first = done == self.start
                done += len(points.times_s)
                yield self._chunk(points, dropped, first)
        dropped["truncated"] += self.stop - done
        if dropped["truncated"]:
            yield no_rows(LASER_COLUMNS, dropped)

    def _points(self, file: BinaryIO) -> Iterator[DecodedPoints]:
        if self.stop <= self.start:
            return iter(())
        if self.compressed:
            return decompressed_points(self.path, self.name, self.start, self.stop, BATCH_ROWS)
        return las_points(file, self.name, self.start, self.stop)

    @np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
    def _chunk(self, points: DecodedPoints, dropped: Counter[str], first: bool) -> Chunk:
        if first:
            refuse_unusable_times(points.times_s, self.name, self.gps_week is None, self.declared_time)
        every = len(points.times_s)
        rows = RowFilter({"seconds": points.times_s, "row": np.arange(every)}, dropped)
        rows.keep_finite()
        rows.keep(rows["seconds"] != 0, "no time")
        rows.columns["t_ns"] = self._gps_ns(rows) - latency_ns(self.latency_s)
        usable = len(rows)
        if self.limit < ALL:
            drawn = np.flatnonzero(scattered(rows["t_ns"]) <= np.uint64(self.limit))
            rows.columns = {name: values[drawn] for name, values in rows.columns.items()}
        undrawn = usable - len(rows)
        places = points.places(rows["row"] if len(rows) < every else slice(None))
        rows.columns |= dict(zip(COORDINATES, places, strict=True))
        rows.keep_finite()
        if first:
            refuse_other_crs(self.frame, self.crs, (rows["x_m"], rows["y_m"], rows["z_m"]), self.name)
        transform_to_ecef(rows, self.frame, self.name)
        return replace(chunk(rows.columns, LASER_COLUMNS, dropped), undrawn=undrawn)

    def _gps_ns(self, rows: RowFilter) -> NDArray[np.int64]:
        if self.gps_week is None:
            rows.keep(np.abs(rows["seconds"]) < _MAX_SECONDS, "impossible time")
            t_ns = gps_ns_from_week_seconds(0, rows["seconds"]) + ADJUSTED_STANDARD_OFFSET_S * NS
            possible = possible_ns(t_ns)
            rows.keep(possible, "impossible time")
            return t_ns[possible]
        rows.keep((rows["seconds"] >= 0) & (rows["seconds"] < 2 * WEEK_S), "impossible time")
        week = self.gps_week + (rows["seconds"] < self.first_s - WEEK_S / 2)
        return gps_ns_from_week_seconds(week, rows["seconds"])


def las_parts(
    path: Path, name: str, header: LasHeader, gps_week: int | None, frame: LaserFrame, latency_s: float
) -> tuple[LasPart, ...]:
    """Divide a file into stretches of at most STRETCH_POINTS points.

    Parameters
    ----------
    path : Path
        The LAS or LAZ file.
    name : str
        Its path in the session folder.
    header : LasHeader
        Its header.
    gps_week : int or None
        Week of the first point; None: adjusted standard time.
    frame : LaserFrame
        Frame of the coordinates.
    latency_s : float
        Recorded minus true time, s.

    Returns
    -------
    tuple of LasPart

    Raises
    ------
    RawDataError
        Coordinates are stored with too coarse a scale.
    """
    _refuse_coarse(header.scales, frame, name)
    crs = crs_of_las(path, name) if frame != LaserFrame() else ""
    starts = range(0, header.present, STRETCH_POINTS) or range(1)
    parts = []
    for k, start in enumerate(starts):
        stop = min(start + STRETCH_POINTS, header.present)
        missing = header.claimed - header.present if k == len(starts) - 1 else 0
        label = name if len(starts) == 1 else f"{name}#{k}"
        parts.append(
            LasPart(
                path=path,
                name=label,
                compressed=header.compressed,
                start=start,
                stop=stop,
                missing=missing,
                frame=frame,
                crs=crs,
                latency_s=latency_s,
                gps_week=gps_week,
                declared_time=header.declared_time,
                first_s=header.first_s,
            )
        )
    return tuple(parts)


def _refuse_coarse(scales: tuple[float, ...], frame: LaserFrame, name: str) -> None:
    """Refuse a scale that is too coarse for points measured to millimetres; coordinates are multiples of the scale."""
    transform = frame_transform(frame)
    unit_m, height_unit_m = (1.0, 1.0) if transform is None else (transform.unit_m, transform.height_unit_m)
    units_m = (unit_m, unit_m, height_unit_m)
    for axis, scale, axis_unit_m in zip("xyz", scales, units_m, strict=True):
        if scale * axis_unit_m > _COARSEST_M * 1.2:
            raise RawDataError(
                f"{name}: its {axis} are whole numbers of {scale:g}, steps of {scale * axis_unit_m:.3g} m; export it "
                f"again with a scale of {0.1 * _COARSEST_M / axis_unit_m:.1g} or finer"
            )


def crs_of_las(path: Path, name: str) -> str:
    """Return the CRS in the file's variable-length records, WKT; empty if there is none that can be read."""
    import laspy
    from pyproj.exceptions import ProjError

    try:
        with opened(path, name) as file:
            crs = laspy.LasHeader.read_from(file, read_evlrs=False).parse_crs()
    except (laspy.LaspyException, ProjError, ValueError, LookupError, OverflowError, struct.error, EOFError):
        return ""
    return "" if crs is None else str(crs.to_wkt())


def las_points(file: BinaryIO, name: str, start: int, stop: int) -> Iterator[DecodedPoints]:
    """Yield points ``start`` to ``stop``, batch by batch."""
    import laspy

    try:
        reader = laspy.LasReader(file, closefd=False, read_evlrs=False)
        if start:
            reader.seek(start)
        while start < stop:
            points = reader.read_points(min(BATCH_ROWS, stop - start))
            if not len(points):
                return
            timed = "gps_time" in points.point_format.dimension_names
            times_s = np.asarray(points.gps_time if timed else np.zeros(len(points)), np.float64)
            yield DecodedPoints(times_s, partial(_places, points))
            start += len(points)
    except (laspy.LaspyException, ValueError, LookupError, OverflowError, struct.error) as error:
        raise RawDataError(f"{name}: is damaged ({error}); copy or export it again") from error


def _places(points: Any, rows: Rows) -> tuple[Array, ...]:
    return tuple(np.asarray(axis, np.float64)[rows] for axis in (points.x, points.y, points.z))
