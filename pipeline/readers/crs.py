"""Points in a coordinate reference system -> ECEF of that system's own datum, metres (:mod:`pipeline.readers.datums`).

A CRS of two axes, such as UTM, says nothing of heights: ``laser.heights: ellipsoidal`` must. Heights are then in the
unit of the CRS's own axes (feet with feet), with degrees in metres. Heights above a geoid are refused.
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
from pipeline.readers.datums import geocentric_of, horizontal_of, unfit, vertical_of
from pipeline.readers.row_checks import Sieve

Array = NDArray[np.float64]
Transform = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
Box = tuple[float, float, float, float]
ECEF = "EPSG:4978"
LASER = "laser"
AXES = ("x_m", "y_m", "z_m")
DEGREE_M = 111_320.0  # along a meridian
MARGIN_DEG = 1.0  # beyond a CRS's area of use, which is rounded
ZONE_M = 1e6  # Gauss-Krueger eastings may begin with the number of their zone: 39 500 000
ENOUGH = 100  # points by which lost digits are told from chance


@dataclass(frozen=True)
class Frame:
    """``laser.frame`` and ``laser.heights`` of session.yaml."""

    name: str = LASER
    heights: str | None = None


@dataclass(frozen=True)
class Placing:
    """A frame's way to ECEF; ``box``: its area of use in its own coordinates, west, south, east, north."""

    to_ecef: Transform
    box: Box | None
    unit_m: float  # metres in one unit of x and y
    height_unit_m: float  # and of z

    def inside(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Which points lie in the CRS's area of use."""
        if self.box is None:
            return np.ones(len(x), dtype=bool)
        west, south, east, north = self.box
        good: NDArray[np.bool_] = (x >= west) & (x <= east) & (y >= south) & (y <= north)
        return good


def keep_placed(sieve: Sieve, frame: Frame, name: str) -> None:
    """x_m, y_m, z_m in ``frame`` become ECEF; rows that have no place there are left out.

    Raises
    ------
    RawDataError
        The coordinates have lost their digits: whole pieces of a file are numbers of single precision.
    """
    placing = placing_of(frame)
    if frame.name != LASER:
        _refuse_float32(sieve["x_m"], sieve["y_m"], 1.0 if placing is None else placing.unit_m, name)
    if placing is None:
        return
    inside = placing.inside(sieve["x_m"], sieve["y_m"])
    if len(inside) and not inside.any():
        _refuse_misread(placing, sieve["x_m"], sieve["y_m"], name)
    sieve.keep(inside, "outside the area of laser.frame")
    moved = placing.to_ecef(*(sieve[axis] for axis in AXES))
    sieve.columns |= dict(zip(AXES, moved, strict=True))
    sieve.keep_finite()


def _refuse_misread(placing: Placing, x: Array, y: Array, name: str) -> None:
    """Points of which none lies in the CRS's area, though all would if they were read otherwise."""
    if np.all(placing.inside(y, x)):
        raise RawDataError(
            f"{name}: its x and y are interchanged for laser.frame (x {x[0]:.3f}, y {y[0]:.3f}): x must be east or "
            "longitude, y north or latitude; export the points in that order"
        )
    if placing.box is None or placing.unit_m != 1.0:
        return
    millions = round(((placing.box[0] + placing.box[2]) / 2 - float(np.median(x))) / ZONE_M)
    if np.all(placing.inside(x + millions * ZONE_M, y)):
        raise RawDataError(
            f"{name}: its x, such as {x[0]:.0f}, have other digits of a zone before them than laser.frame's, which "
            f"would be {x[0] + millions * ZONE_M:.0f}: name the CRS whose false easting is that of the points"
        )


def _refuse_float32(x: Array, y: Array, unit_m: float, name: str) -> None:
    """Whether all lie as near to a float32 as the rounding of a text or LAS brings them, where these lie far apart."""
    near = (0.006 if unit_m == DEGREE_M else 0.0006) / unit_m
    for values in (x, y):
        singles = values.astype(np.float32)
        apart = float(np.spacing(np.abs(singles).max(initial=0.0)))
        few = len(values) < ENOUGH or values.min() == values.max()
        if few or not apart > 10 * near or not np.all(np.abs(values - singles) <= near):
            return
    raise RawDataError(f"{name}: its coordinates went through float32; export it again in double precision")


@lru_cache(maxsize=8)
def placing_of(frame: Frame) -> Placing | None:
    """What turns x, y, z (or longitude, latitude, height) of ``frame`` into ECEF; None where nothing is to do.

    Raises
    ------
    ConfigError
        The frame is no CRS, or its points cannot be placed beside an INS's, or its heights are above something else
        than the ellipsoid.
    """
    if frame.name in (LASER, ECEF):
        return None
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    where = f"session.yaml: laser.frame = {frame.name!r}"
    try:
        with warnings.catch_warnings(action="ignore", category=FutureWarning):  # of +init=epsg:...
            crs = CRS.from_user_input(frame.name)
    except ProjError as error:
        raise ConfigError(
            f"{where}: no coordinate reference system is known by that name; write laser, or a CRS by its number, such "
            "as EPSG:4978 (ECEF) or EPSG:32651 (UTM zone 51 north)"
        ) from error
    if (why := unfit(crs)) is not None:
        raise ConfigError(f"{where}: {crs.name} {why}")
    _refuse_other_heights(crs, frame, where)
    level = horizontal_of(crs)
    try:
        return Placing(_transform(crs), None if crs.is_geocentric else _box(level), _unit_m(crs), height_unit_m(crs))
    except ProjError as error:
        raise ConfigError(
            f"{where}: {crs.name} cannot be turned into ECEF here; export the points in EPSG:4978 or EPSG:4979"
        ) from error


def _refuse_other_heights(crs: Any, frame: Frame, where: str) -> None:
    vertical = vertical_of(crs)
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
    """Metres in one unit of x and y."""
    factor = float(crs.axis_info[0].unit_conversion_factor)
    return DEGREE_M * math.degrees(factor) if horizontal_of(crs).is_geographic else factor


def height_unit_m(crs: Any) -> float:
    """Metres in one unit of z: where the CRS has two axes the unit of these, with angles metres."""
    if len(crs.axis_info) == 3:
        return float(crs.axis_info[2].unit_conversion_factor)
    return 1.0 if crs.is_geographic else _unit_m(crs)


def _transform(crs: Any) -> Transform:
    """Coordinates in the CRS (x: east or longitude, y: north or latitude) -> ECEF of its own datum."""
    from pyproj import Transformer

    level = horizontal_of(crs)
    solid = level if len(level.axis_info) == 3 else level.to_3d()
    scale = height_unit_m(crs) / float(solid.axis_info[2].unit_conversion_factor)
    way = Transformer.from_crs(solid, geocentric_of(crs), always_xy=True, allow_ballpark=False)

    def transform(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        # PROJ writes into the arrays it is given, and marks what it cannot turn by inf
        moved = way.transform(x, y, z * scale, inplace=False)
        return np.asarray(moved[0]), np.asarray(moved[1]), np.asarray(moved[2])

    return transform


def _box(crs: Any) -> Box | None:
    """The area of use, widened a little; None where the CRS has none, or one across the date line."""
    from pyproj import Transformer

    area = crs.area_of_use
    if area is None or area.west >= area.east:
        return None
    south, north = max(area.south - MARGIN_DEG, -90.0), min(area.north + MARGIN_DEG, 90.0)
    if crs.is_geographic:
        turn = 360.0 if (area.west, area.east) == (-180.0, 180.0) else MARGIN_DEG  # of the whole earth, 190 degrees too
        return area.west - turn, south, area.east + turn, north
    bounds = (max(area.west - MARGIN_DEG, -180.0), south, min(area.east + MARGIN_DEG, 180.0), north)
    flat = crs.to_2d()
    box = Transformer.from_crs(flat.geodetic_crs, flat, always_xy=True).transform_bounds(*bounds)
    return box if np.all(np.isfinite(box)) else None
