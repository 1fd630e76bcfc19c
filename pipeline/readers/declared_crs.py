"""Comparison of the coordinate reference system that a file declares with that of session.yaml."""

from typing import Any

import numpy as np

from pipeline.errors import RawDataError
from pipeline.readers.crs import LASER_FRAME, Array, LaserFrame, height_unit_m
from pipeline.readers.datums import geocentric_crs, height_system, horizontal_part, is_like_wgs84

CLEARLY_ELSEWHERE_M = 1000.0


def refuse_other_crs(frame: LaserFrame, declared: str, points: tuple[Array, Array, Array], name: str) -> None:
    """Refuse a file whose declared CRS contradicts that of session.yaml.

    The two contradict each other if they place the points' median more than 1 km apart, or only one can place it; if
    the declared ellipsoid is none of WGS 84, GRS 80 and CGCS2000; or if the declared heights are above a geoid, or in
    another unit. Two datums on the same ellipsoid (NAD83 and WGS 84, for example) give the same ECEF coordinates in
    this program. Therefore the user must know that the points' datum is the INS's. A CRS unknown to PROJ is ignored.

    Parameters
    ----------
    frame : LaserFrame
        Frame of the coordinates by session.yaml.
    declared : str
        CRS that the file declares, WKT; empty: none.
    points : tuple of three (n,) arrays
        Coordinates as they stand in the file.
    name : str
        The file's path in the session folder, for messages.

    Raises
    ------
    RawDataError
        The two systems contradict each other.
    """
    if frame.name == LASER_FRAME or not declared or not len(points[0]):
        return
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    try:
        file_crs, session_crs = CRS.from_user_input(declared), CRS.from_user_input(frame.name)
        if horizontal_part(file_crs).geodetic_crs is None:
            return
        median = tuple(float(np.median(values)) for values in points)
        positions_m = np.array([_position_m(file_crs, *median), _position_m(session_crs, *median)])
    except (ProjError, ValueError):
        return
    says = f"{name}: says itself that its points are in {file_crs.name}"
    exists = np.isfinite(positions_m).all(axis=1)
    if exists.any() and not (exists.all() and np.linalg.norm(np.diff(positions_m, axis=0)) <= CLEARLY_ELSEWHERE_M):
        raise RawDataError(
            f"{says}, but laser.frame is {frame.name!r} ({session_crs.name}); correct laser.frame, or export the "
            "points anew"
        )
    ellipsoid = horizontal_part(file_crs).ellipsoid
    if not is_like_wgs84(ellipsoid):
        raise RawDataError(
            f"{says}, on the ellipsoid {ellipsoid.name}, but laser.frame is {frame.name!r} ({session_crs.name}); "
            "export the points in the INS's datum"
        )
    vertical = height_system(file_crs)
    if vertical is not None:
        raise RawDataError(f"{name}: says itself that its heights are {vertical}; export ellipsoidal heights")
    units_m = height_unit_m(file_crs), height_unit_m(session_crs)
    if len(file_crs.axis_info) == 3 and not np.isclose(*units_m, rtol=1e-6):
        raise RawDataError(
            f"{name}: says itself that the unit of its heights is the {file_crs.axis_info[2].unit_name}, but that of "
            f"laser.frame ({session_crs.name}) is {units_m[1]:g} m; export the heights in that unit"
        )


def _position_m(crs: Any, x: float, y: float, z: float) -> Array:
    """Return a point in ECEF of the CRS's own datum.

    The height is set to 0, because heights in another unit must not count as another place. A geocentric CRS keeps z.
    """
    from pyproj import Transformer

    horizontal = horizontal_part(crs)
    if not crs.is_geocentric:
        horizontal, z = horizontal.to_2d().to_3d(), 0.0
    transformer = Transformer.from_crs(horizontal, geocentric_crs(crs), always_xy=True)
    return np.array(transformer.transform(x, y, z))
