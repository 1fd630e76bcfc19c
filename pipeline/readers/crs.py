"""Points in a coordinate reference system -> ECEF (EPSG:4978), metres.

A CRS of two axes, such as UTM, says nothing of heights: ``laser.heights: ellipsoidal`` must. Heights are then in the
unit of the CRS's own axes (feet with feet), with degrees in metres. Heights above a geoid need a grid.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.sieve import Sieve

Array = NDArray[np.float64]
Transform = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
Box = tuple[float, float, float, float]
ECEF = "EPSG:4978"
LASER = "laser"
AXES = ("x_m", "y_m", "z_m")
DEGREE_M = 111_320.0  # along a meridian
MARGIN_DEG = 1.0  # beyond a CRS's area of use, which is rounded
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
    if placing.box is not None:
        west, south, east, north = placing.box
        x, y = sieve["x_m"], sieve["y_m"]
        sieve.keep((x >= west) & (x <= east) & (y >= south) & (y <= north), "outside the area of laser.frame")
    moved = placing.to_ecef(*(sieve[axis] for axis in AXES))
    sieve.columns |= dict(zip(AXES, moved, strict=True))
    sieve.keep_finite()


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
        The frame is no CRS, its heights are above something unsaid, or its way to ECEF needs a grid that is not
        installed: PROJ's guess would be wrong by metres.
    """
    if frame.name in (LASER, ECEF):
        return None
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    where = f"session.yaml: laser.frame = {frame.name!r}"
    try:
        crs = CRS.from_user_input(frame.name)
        _refuse_unsaid_heights(crs, frame, where)
        solid = crs if len(crs.axis_info) == 3 else crs.to_3d()
        if len(solid.axis_info) != 3:
            raise ConfigError(f"{where}: {crs.name} is no CRS of points; write laser, EPSG:4978 or the like")
        transform = _transform(solid, _height_scale(crs, solid))
        unit = _unit_m(crs)
        box = None if crs.is_geocentric else _box(crs)
    except ProjError as error:
        raise ConfigError(
            f"{where}: is no coordinate reference system ({error}); write laser, EPSG:4978 or the like"
        ) from error
    if transform is None:
        raise ConfigError(
            f"{where}: {crs.name} cannot be turned into ECEF here (no geocentric relation, or no geoid grid); "
            "export the points in EPSG:4978 or with ellipsoidal heights in EPSG:4979"
        )
    return Placing(transform, box, unit)


def _refuse_unsaid_heights(crs: Any, frame: Frame, where: str) -> None:
    if len(crs.axis_info) != 3 and frame.heights is None:
        raise ConfigError(
            f"{where}: {crs.name} has {len(crs.axis_info)} axes: heights above what? Write laser.heights: ellipsoidal "
            "if they are above the ellipsoid; else export ellipsoidal heights"
        )
    vertical = vertical_of(crs)
    if vertical is not None and frame.heights is not None:
        raise ConfigError(
            f"{where}: {crs.name} has heights of {vertical}, but laser.heights is {frame.heights}; "
            "name the CRS without them, or take laser.heights out"
        )


def vertical_of(crs: Any) -> str | None:
    """The name of a compound CRS's vertical part, unless that is the ellipsoid."""
    names = [part.name for part in crs.sub_crs_list if part.is_vertical]
    return next((name for name in names if "ellipsoid" not in name.lower()), None)


def _unit_m(crs: Any) -> float:
    axis = crs.axis_info[0]
    return DEGREE_M if axis.unit_name == "degree" else float(axis.unit_conversion_factor)


def _height_scale(crs: Any, solid: Any) -> float:
    """What heights are multiplied by where a CRS of two axes has been given a third."""
    if crs is solid or not crs.is_projected:
        return 1.0
    return float(crs.axis_info[0].unit_conversion_factor / solid.axis_info[2].unit_conversion_factor)


def _transform(solid: Any, height_scale: float) -> Transform | None:
    import warnings

    from pyproj import CRS
    from pyproj.transformer import TransformerGroup

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a missing grid: refused by the caller
        try:
            group = TransformerGroup(solid, CRS.from_user_input(ECEF), always_xy=True, allow_ballpark=False)
        except IndexError:  # pyproj's way to say that there is none
            return None
    if not group.transformers or not group.best_available:
        return None
    best = group.transformers[0]

    def transform(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        # PROJ writes into the arrays it is given, and marks what it cannot turn by inf
        moved = best.transform(x, y, z * height_scale, inplace=False)
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
