"""LAS and LAZ by laspy: points in the scanner's frame (or a CRS), GPS time as seconds of week or adjusted standard time."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.records import count, keep, latency
from pipeline.streams import Chunk
from pipeline.times import ADJUSTED_STANDARD_OFFSET_S, NS, gps_ns_from_week_seconds

STRETCH = 4_000_000  # points of one part: two workers can share one file
CHUNK = 500_000
FIRST_YEAR_NS, LAST_YEAR_NS = 20 * 31_557_600 * NS, 120 * 31_557_600 * NS  # 2000 to 2100
FLOAT32_STEP_S = 2.0**-7


@dataclass(frozen=True)
class LasPart:
    """Points ``start`` to ``start + points`` of one file."""

    path: Path
    name: str
    start: int
    points: int
    gps_week: int | None
    latency_s: float
    frame: str

    def chunks(self) -> Iterator[Chunk]:
        import laspy

        read = 0
        try:
            with laspy.open(self.path) as file:
                standard = file.header.global_encoding.gps_time_type == laspy.header.GpsTimeType.STANDARD
                if self.start:
                    file.seek(self.start)
                while read < self.points:
                    points = file.read_points(min(CHUNK, self.points - read))
                    if len(points) == 0:
                        break
                    read += len(points)
                    yield self._chunk(points, standard)
        except (RawDataError, ConfigError):
            raise
        except Exception as error:  # laspy and lazrs raise many kinds for a cut or damaged file
            if read == 0 and self.start == 0:
                raise RawDataError(
                    f"{self.path}: cannot be decoded ({type(error).__name__}: {error}); export it again"
                ) from error
        if read < self.points:
            yield Chunk({}, {"missing: the file is cut": self.points - read})

    def _chunk(self, points: Any, standard: bool) -> Chunk:
        gps_time = np.asarray(points["gps_time"], dtype=np.float64)
        xyz = {axis: np.asarray(points[axis], dtype=np.float64) for axis in "xyz"}
        dropped: dict[str, int] = {}
        good = np.isfinite(gps_time) & np.isfinite(xyz["x"]) & np.isfinite(xyz["y"]) & np.isfinite(xyz["z"])
        count(dropped, "not a number", int((~good).sum()))
        good &= (xyz["x"] != 0) | (xyz["y"] != 0) | (xyz["z"] != 0)
        seconds = np.where(good, gps_time, 1.0)
        t_ns = self._times(seconds, standard)
        if len(seconds) > 100 and np.ptp(seconds) > 1 and np.all(np.mod(seconds, FLOAT32_STEP_S) == 0):
            raise RawDataError(
                f"{self.path}: times are whole steps of {FLOAT32_STEP_S:g} s: they went through single precision and cannot be "
                "georeferenced; export again with double precision"
            )
        columns: dict[str, NDArray[np.generic]] = {"t_ns": latency(t_ns, self.latency_s)}
        columns |= {f"{axis}_m": values for axis, values in _in_frame(xyz, self.frame).items()}
        count(dropped, "at the scanner's origin", int(len(good) - good.sum() - dropped.get("not a number", 0)))
        return Chunk(keep(columns, good) if not good.all() else columns, dropped)

    def _times(self, seconds: NDArray[np.float64], standard: bool) -> NDArray[np.int64]:
        if standard:
            whole = np.floor(seconds)
            t_ns = (whole.astype(np.int64) + ADJUSTED_STANDARD_OFFSET_S) * NS + np.rint((seconds - whole) * NS).astype(np.int64)
            if len(t_ns) and not FIRST_YEAR_NS < int(np.median(t_ns)) < LAST_YEAR_NS:
                raise RawDataError(
                    f"{self.path}: GPS time {seconds[0]:.3f} is impossible as adjusted standard time, which its header claims; "
                    "it may be seconds of week: export again"
                )
            return t_ns
        if self.gps_week is None:
            raise ConfigError(
                f"session.yaml: laser.gps_week: is missing; {self.path.name} holds seconds of week alone: give the GPS week"
            )
        if len(seconds) and not (0 <= float(np.median(seconds)) < 2 * 604_800):
            raise RawDataError(
                f"{self.path}: GPS time {seconds[0]:.3f} is impossible as seconds of week, which its header claims; export again"
            )
        return gps_ns_from_week_seconds(self.gps_week, seconds)


def _in_frame(xyz: dict[str, NDArray[np.float64]], frame: str) -> dict[str, NDArray[np.float64]]:
    """As they are in the scanner's frame; in ECEF from any three-dimensional CRS."""
    if frame == "laser":
        return xyz
    from pyproj import Transformer

    transformer = Transformer.from_crs(crs_of(frame), "EPSG:4978", always_xy=True)
    return dict(zip("xyz", map(np.asarray, transformer.transform(xyz["x"], xyz["y"], xyz["z"])), strict=True))


def crs_of(frame: str) -> Any:
    """The CRS of session.yaml's laser.frame; refused when unknown or without heights."""
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        crs = CRS.from_user_input(frame)
    except CRSError as error:
        raise ConfigError(
            f"session.yaml: laser.frame = {frame!r}: is neither 'laser' nor a CRS; write e.g. EPSG:4978"
        ) from error
    if len(crs.axis_info) < 3:
        raise ConfigError(
            f"session.yaml: laser.frame = {frame!r}: has no heights above the ellipsoid; use a three-dimensional CRS"
        )
    return crs


def las_parts(path: Path, name: str, gps_week: int | None, latency_s: float, frame: str) -> list[LasPart]:
    """Stretches of one file; its header is checked here."""
    import laspy

    if frame != "laser":
        crs_of(frame)
    try:
        with laspy.open(path) as file:
            points, names = file.header.point_count, set(file.header.point_format.dimension_names)
    except Exception as error:  # laspy raises many kinds for a damaged header
        raise RawDataError(f"{path}: its header cannot be read ({type(error).__name__}: {error}); export it again") from error
    if "gps_time" not in names:
        raise RawDataError(f"{path}: has no time stamps; export again with GPS time (point format 1, 3 or 6 and above)")
    limit = path.stat().st_size * 64  # no compression packs a point into less than a bit or so per field
    points = min(points, limit)
    starts = range(0, max(points, 1), STRETCH)
    return [
        LasPart(path, f"{name}#{k}" if points > STRETCH else name, s, min(STRETCH, points - s), gps_week, latency_s, frame)
        for k, s in enumerate(starts)
    ]
