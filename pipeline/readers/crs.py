"""Transform points from a coordinate reference system (CRS) to ECEF of the CRS's own datum, metres.

A CRS of two axes, such as UTM, does not define heights. session.yaml must then have ``laser.heights: ellipsoidal``. The
heights are in the unit of x and y (feet if these are in feet), or in metres if x and y are in degrees. Heights above a
geoid are refused. :mod:`pipeline.readers.datums` describes what is assumed of datums.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.datums import geocentric_crs, height_system, horizontal_part, unusable_reason
from pipeline.readers.row_filter import RowFilter

Array = NDArray[np.float64]
ToEcef = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
Box = tuple[float, float, float, float]
ECEF = "EPSG:4978"
LASER_FRAME = "laser"
COORDINATES = ("x_m", "y_m", "z_m")
DEGREE_M = 111_320.0  # length of a degree along a meridian
MARGIN_DEG = 1.0  # added round a CRS's area of use, whose published limits are rounded
ZONE_M = 1e6  # Gauss-Krueger eastings may begin with the number of their zone: 39 500 000
_LEAST_POINTS = 100  # with fewer points coordinates may be float32 numbers by chance


@dataclass(frozen=True)
class LaserFrame:
    """``laser.frame`` and ``laser.heights`` of session.yaml."""

    name: str = LASER_FRAME
    heights: str | None = None


@dataclass(frozen=True)
class FrameTransform:
    """The transform of a frame's coordinates to ECEF, and the area in which the frame may be used."""

    to_ecef: ToEcef
    box: Box | None  # area of use in the frame's own coordinates: west, south, east, north
    unit_m: float  # metres in one unit of x and y
    height_unit_m: float  # metres in one unit of z

    def inside(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Return a mask (n,): true for points in the CRS's area of use."""
        if self.box is None:
            return np.ones(len(x), dtype=bool)
        west, south, east, north = self.box
        in_box: NDArray[np.bool_] = (x >= west) & (x <= east) & (y >= south) & (y <= north)
        return in_box


def transform_to_ecef(rows: RowFilter, frame: LaserFrame, name: str) -> None:
    """Transform columns x_m, y_m, z_m to ECEF, and leave out rows outside the frame's area of use.

    Parameters
    ----------
    rows : RowFilter
        Rows with coordinates in ``frame``; changed in place.
    frame : LaserFrame
        Frame of the coordinates.
    name : str
        The file's path in the session folder, for messages.

    Raises
    ------
    RawDataError
        The coordinates have lost digits (all are float32 numbers), or x and y are interchanged, or x begins with
        another zone number than the eastings of the CRS.
    """
    transform = frame_transform(frame)
    if frame.name != LASER_FRAME:
        _refuse_float32(rows["x_m"], rows["y_m"], 1.0 if transform is None else transform.unit_m, name)
    if transform is None:
        return
    inside = transform.inside(rows["x_m"], rows["y_m"])
    if len(inside) and not inside.any():
        _refuse_misread(transform, rows["x_m"], rows["y_m"], name)
    rows.keep(inside, "outside the area of laser.frame")
    ecef_m = transform.to_ecef(*(rows[axis] for axis in COORDINATES))
    rows.columns |= dict(zip(COORDINATES, ecef_m, strict=True))
    rows.keep_finite()


def _refuse_misread(transform: FrameTransform, x: Array, y: Array, name: str) -> None:
    """Refuse points that would all lie in the CRS's area if x and y were interchanged, or x had another zone number."""
    if np.all(transform.inside(y, x)):
        raise RawDataError(
            f"{name}: its x and y are interchanged for laser.frame (x {x[0]:.3f}, y {y[0]:.3f}): x must be east or "
            "longitude, y north or latitude; export the points in that order"
        )
    if transform.box is None or transform.unit_m != 1.0:
        return
    millions = round(((transform.box[0] + transform.box[2]) / 2 - float(np.median(x))) / ZONE_M)
    if np.all(transform.inside(x + millions * ZONE_M, y)):
        raise RawDataError(
            f"{name}: its x, such as {x[0]:.0f}, have other digits of a zone before them than laser.frame's, which "
            f"would be {x[0] + millions * ZONE_M:.0f}: name the CRS whose false easting is that of the points"
        )


def _refuse_float32(x: Array, y: Array, unit_m: float, name: str) -> None:
    """Refuse coordinates that were stored as float32.

    All x and y then lie within 0.6 mm (degrees: 6 mm) of float32 numbers. Other coordinates may do so by chance. The
    test therefore needs 100 points, and float32 numbers that are more than ten times that distance apart.
    """
    rounding = (0.006 if unit_m == DEGREE_M else 0.0006) / unit_m
    for values in (x, y):
        singles = values.astype(np.float32)
        spacing = float(np.spacing(np.abs(singles).max(initial=0.0)))
        too_few = len(values) < _LEAST_POINTS or values.min() == values.max()
        if too_few or not spacing > 10 * rounding or not np.all(np.abs(values - singles) <= rounding):
            return
    raise RawDataError(f"{name}: its coordinates went through float32; export it again in double precision")


@lru_cache(maxsize=8)
def frame_transform(frame: LaserFrame) -> FrameTransform | None:
    """Return the transform of x, y, z (or longitude, latitude, height) to ECEF; None for ``laser`` and EPSG:4978.

    Raises
    ------
    ConfigError
        The frame is no CRS; its ellipsoid, axes or prime meridian do not fit the INS's positions; its heights are not
        ellipsoidal; or PROJ cannot transform it.
    """
    if frame.name in (LASER_FRAME, ECEF):
        return None
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    where = f"session.yaml: laser.frame = {frame.name!r}"
    try:
        with warnings.catch_warnings(action="ignore", category=FutureWarning):  # PROJ warns of +init=epsg:...
            crs = CRS.from_user_input(frame.name)
    except ProjError as error:
        raise ConfigError(
            f"{where}: no coordinate reference system is known by that name; write laser, or a CRS by its number, such "
            "as EPSG:4978 (ECEF) or EPSG:32651 (UTM zone 51 north)"
        ) from error
    if (reason := unusable_reason(crs)) is not None:
        raise ConfigError(f"{where}: {crs.name} {reason}")
    _refuse_other_heights(crs, frame, where)
    box = None if crs.is_geocentric else _box(horizontal_part(crs))
    try:
        to_ecef = ecef_function(crs)
        return FrameTransform(to_ecef=to_ecef, box=box, unit_m=_unit_m(crs), height_unit_m=height_unit_m(crs))
    except ProjError as error:
        raise ConfigError(
            f"{where}: {crs.name} cannot be turned into ECEF here; export the points in EPSG:4978 or EPSG:4979"
        ) from error


def _refuse_other_heights(crs: Any, frame: LaserFrame, where: str) -> None:
    vertical = height_system(crs)
    if vertical is not None:
        raise ConfigError(
            f"{where}: {crs.name} has heights of {vertical}, above a geoid or the sea; export ellipsoidal heights, "
            "name the CRS without that part, and write laser.heights: ellipsoidal"
        )
    if len(crs.axis_info) != 3 and frame.heights is None:
        raise ConfigError(
            f"{where}: {crs.name} has no heights of its own, and nothing says what the points' heights are above. "
            "Write laser.heights: ellipsoidal if they are above the ellipsoid; else export ellipsoidal heights"
        )


def _unit_m(crs: Any) -> float:
    """Return the metres in one unit of x and y; for degrees the length of a degree along a meridian."""
    factor = float(crs.axis_info[0].unit_conversion_factor)
    return DEGREE_M * math.degrees(factor) if horizontal_part(crs).is_geographic else factor


def height_unit_m(crs: Any) -> float:
    """Return the metres in one unit of z; a CRS of two axes has heights in their unit, or in metres for angles."""
    if len(crs.axis_info) == 3:
        return float(crs.axis_info[2].unit_conversion_factor)
    return 1.0 if crs.is_geographic else _unit_m(crs)


def ecef_function(crs: Any) -> ToEcef:
    """Return a function that transforms x (east or longitude), y (north or latitude), z to ECEF of the same datum."""
    from pyproj import Transformer

    horizontal = horizontal_part(crs)
    with_heights = horizontal if len(horizontal.axis_info) == 3 else horizontal.to_3d()
    scale = height_unit_m(crs) / float(with_heights.axis_info[2].unit_conversion_factor)
    transformer = Transformer.from_crs(with_heights, geocentric_crs(crs), always_xy=True, allow_ballpark=False)

    def to_ecef(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        # without inplace=False PROJ writes into its arguments; coordinates that it cannot transform become inf
        ecef_m = transformer.transform(x, y, z * scale, inplace=False)
        return np.asarray(ecef_m[0]), np.asarray(ecef_m[1]), np.asarray(ecef_m[2])

    return to_ecef


def _box(crs: Any) -> Box | None:
    """Return the area of use in the CRS's coordinates, widened by MARGIN_DEG.

    None: the CRS has no area of use, the area crosses the date line, or PROJ cannot transform its corners.
    """
    from pyproj import Transformer

    area = crs.area_of_use
    if area is None or area.west >= area.east:
        return None
    south, north = max(area.south - MARGIN_DEG, -90.0), min(area.north + MARGIN_DEG, 90.0)
    if crs.is_geographic:
        margin = 360.0 if (area.west, area.east) == (-180.0, 180.0) else MARGIN_DEG  # whole earth: also 190°
        return area.west - margin, south, area.east + margin, north
    bounds = (max(area.west - MARGIN_DEG, -180.0), south, min(area.east + MARGIN_DEG, 180.0), north)
    flat = crs.to_2d()
    box = Transformer.from_crs(flat.geodetic_crs, flat, always_xy=True).transform_bounds(*bounds)
    return box if np.all(np.isfinite(box)) else None


def projected_from_ecef(name: str, option: str) -> tuple[Any, Callable[[Array], Array]]:
    """Return a projected CRS, and a function that turns points (n, 3) m in ECEF into x, y, height (n, 3) in it.

    Heights are ellipsoidal, m. The datum stays: ECEF is that of the CRS's own datum.

    Parameters
    ----------
    name
        The CRS, such as EPSG:32651.
    option
        The option that names it, for messages.
    """
    from pyproj import CRS, Transformer
    from pyproj.exceptions import ProjError

    try:
        crs = CRS.from_user_input(name)
    except ProjError as error:
        raise ConfigError(f"{option} {name}: no CRS is known by that name; write one such as EPSG:32651") from error
    if not crs.is_projected or crs.is_compound or _unit_m(crs) != 1.0:
        raise ConfigError(f"{option} {name}: {crs.name} is no projected CRS in metres without heights; name one, such "
        "as UTM")
    if (reason := unusable_reason(crs)) is not None:
        raise ConfigError(f"{option} {name}: {crs.name} {reason}")
    try:
        transformer = Transformer.from_crs(geocentric_crs(crs), crs.to_3d(), always_xy=True, allow_ballpark=False)
    except ProjError as error:
        raise ConfigError(f"{option} {name}: PROJ cannot turn points into {crs.name}; name another") from error

    def from_ecef(points_ecef_m: Array) -> Array:
        x, y, z = points_ecef_m.T.copy()
        return np.column_stack(transformer.transform(x, y, z, inplace=False))

    return crs, from_ecef
