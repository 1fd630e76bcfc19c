"""What a file itself says of its coordinate reference system, against what session.yaml says."""

from typing import Any

import numpy as np

from pipeline.errors import RawDataError
from pipeline.readers.crs import DEGREE_M, LASER, Array, Frame, vertical_of

CLEARLY_ELSEWHERE_M = 1000.0


def refuse_another(frame: Frame, declared: str, points: tuple[Array, Array, Array], name: str) -> None:
    """Refuse a file whose own CRS (``declared``, WKT) is clearly another one than session.yaml's.

    It is where the points' middle lies more than 1 km elsewhere, or nowhere, or the heights are said to be above a
    geoid and the session says the ellipsoid. What cannot be understood is not held against the file.
    """
    if frame.name == LASER or not declared or not len(points[0]):
        return
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    try:
        own, given = CRS.from_user_input(declared), CRS.from_user_input(frame.name)
        x, y, z = (float(np.median(values)) for values in points)
        one, other = _place_deg(own, x, y, z), _place_deg(given, x, y, z)
    except (ProjError, ValueError):
        return
    away_m = DEGREE_M * np.hypot((one[0] - other[0]) * np.cos(np.radians(other[1])), one[1] - other[1])
    if np.all(np.isfinite(one)) and not away_m <= CLEARLY_ELSEWHERE_M:
        raise RawDataError(
            f"{name}: says itself that its points are in {own.name}, but laser.frame is {frame.name!r} ({given.name}); "
            "mend laser.frame, or export the points anew"
        )
    vertical = vertical_of(own)
    if vertical is not None and frame.heights is not None:
        raise RawDataError(
            f"{name}: says itself that its heights are {vertical}, but laser.heights is {frame.heights}; "
            "export ellipsoidal heights"
        )


def _place_deg(crs: Any, x: float, y: float, z: float) -> tuple[float, float]:
    """Longitude and latitude of a point, by whatever way."""
    from pyproj import Transformer

    if crs.is_geocentric:
        longitude, latitude, _ = Transformer.from_crs(crs, "EPSG:4979", always_xy=True).transform(x, y, z)
    else:
        longitude, latitude = Transformer.from_crs(crs.to_2d(), "EPSG:4326", always_xy=True).transform(x, y)
    return float(longitude), float(latitude)
