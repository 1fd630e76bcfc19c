"""What a file itself says of its coordinate reference system, against what session.yaml says."""

from typing import Any

import numpy as np

from pipeline.errors import RawDataError
from pipeline.readers.crs import LASER, Array, Frame, height_unit_m
from pipeline.readers.datums import geocentric_of, horizontal_of, is_satellites, vertical_of

CLEARLY_ELSEWHERE_M = 1000.0


def refuse_another(frame: Frame, declared: str, points: tuple[Array, Array, Array], name: str) -> None:
    """Refuse a file whose own CRS (``declared``, WKT) is clearly another one than session.yaml's.

    It is where the points' middle lies more than 1 km elsewhere, or nowhere; where it is on an ellipsoid that no
    satellite system has; where its heights are above a geoid, or in another unit. Two datums on the same ellipsoid
    (NAD83 and WGS 84, say) place the same numbers alike here, whichever the session names: which of them the points are
    in must be known, and be the INS's. What cannot be understood is not held against the file.
    """
    if frame.name == LASER or not declared or not len(points[0]):
        return
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    try:
        own, given = CRS.from_user_input(declared), CRS.from_user_input(frame.name)
        if horizontal_of(own).geodetic_crs is None:
            return
        middle = tuple(float(np.median(values)) for values in points)
        one, other = _place_m(own, *middle), _place_m(given, *middle)
    except (ProjError, ValueError):
        return
    says = f"{name}: says itself that its points are in {own.name}"
    somewhere = np.isfinite([one, other]).all(axis=1)
    if somewhere.any() and not (somewhere.all() and np.linalg.norm(one - other) <= CLEARLY_ELSEWHERE_M):
        raise RawDataError(
            f"{says}, but laser.frame is {frame.name!r} ({given.name}); correct laser.frame, or export the points anew"
        )
    ellipsoid = horizontal_of(own).ellipsoid
    if not is_satellites(ellipsoid):
        raise RawDataError(
            f"{says}, on the ellipsoid {ellipsoid.name}, but laser.frame is {frame.name!r} ({given.name}); export the "
            "points in the INS's datum"
        )
    vertical = vertical_of(own)
    if vertical is not None:
        raise RawDataError(f"{name}: says itself that its heights are {vertical}; export ellipsoidal heights")
    if len(own.axis_info) == 3 and not np.isclose(height_unit_m(own), height_unit_m(given), rtol=1e-6):
        raise RawDataError(
            f"{name}: says itself that the unit of its heights is the {own.axis_info[2].unit_name}, but that of "
            f"laser.frame ({given.name}) is {height_unit_m(given):g} m; export the heights in that unit"
        )


def _place_m(crs: Any, x: float, y: float, z: float) -> Array:
    """A point in ECEF of the CRS's own datum; heights do not count, so that one in feet is no other place."""
    from pyproj import Transformer

    level = horizontal_of(crs)
    if not crs.is_geocentric:
        level, z = level.to_2d().to_3d(), 0.0
    way = Transformer.from_crs(level, geocentric_of(crs), always_xy=True)
    return np.array(way.transform(x, y, z))
