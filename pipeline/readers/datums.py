"""Parts of a coordinate reference system (CRS): horizontal part, heights, ellipsoid, geocentric form of its datum.

The program assumes that the INS's positions and the laser's points are in the same datum. It never transforms from one
datum to another, because for most pairs of datums the parameters depend on place and date. "ECEF" is the geocentric
form of the common datum. The INS's latitudes and longitudes are converted with the ellipsoid of WGS 84
(``pipeline.maths.geometry.geodesy``), points with the ellipsoid of their CRS. GRS 80 and CGCS2000 differ from WGS 84 by
0.12 mm at most. Other ellipsoids differ by metres, and are refused.
"""

from typing import Any

WGS84_AXES_M = (6_378_137.0, 6_356_752.314245)  # semi-major, semi-minor
_AXIS_TOLERANCE_M = 0.001
_HORIZONTAL_DIRECTIONS, _UP = {"east", "north"}, "up"


def horizontal_part(crs: Any) -> Any:
    """Return the CRS without the vertical part of a compound CRS, and without a bound transformation to a datum."""
    if crs.is_compound:
        return horizontal_part(crs.sub_crs_list[0])
    return horizontal_part(crs.source_crs) if crs.is_bound else crs


def height_system(crs: Any) -> str | None:
    """Return the name of a compound CRS's vertical part; None without one, or if its heights are ellipsoidal."""
    names = [part.name for part in crs.sub_crs_list if part.is_vertical]
    return next((name for name in names if "ellipsoid" not in name.lower()), None)


def unusable_reason(crs: Any) -> str | None:
    """Return the words that say why points in this CRS do not fit the INS's positions; None if they fit."""
    horizontal = horizontal_part(crs)
    if horizontal.geodetic_crs is None:
        return "is no CRS of points on the earth; write laser, EPSG:4978 or the like"
    directions = [axis.direction.lower() for axis in (*horizontal.axis_info, *crs.axis_info[2:])]
    heights = [direction for direction in directions[2:] if not crs.is_geocentric]
    if not crs.is_geocentric and (set(directions[:2]) != _HORIZONTAL_DIRECTIONS or set(heights) - {_UP}):
        return f"has axes that run {', '.join(directions)}; export the points in a CRS of east, north and up"
    ellipsoid = horizontal.ellipsoid
    if not is_like_wgs84(ellipsoid):
        return (
            f"is on the ellipsoid {ellipsoid.name}, the INS on that of WGS 84, GRS 80 or CGCS2000: points and heights "
            "would be wrong by metres; export the points in the INS's datum, such as in EPSG:4978"
        )
    if horizontal.prime_meridian.longitude != 0:
        meridian = horizontal.prime_meridian.name
        return f"counts longitudes from {meridian}; export the points with longitudes from Greenwich"
    return None


def is_like_wgs84(ellipsoid: Any) -> bool:
    """Return whether an ellipsoid's semi-axes agree with WGS 84 within 1 mm, as those of GRS 80 and CGCS2000 do."""
    axes = (ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre)
    return all(abs(axis - wgs84) < _AXIS_TOLERANCE_M for axis, wgs84 in zip(axes, WGS84_AXES_M, strict=True))


def geocentric_crs(crs: Any) -> Any:
    """Return the geocentric CRS of the same datum, metres."""
    from pyproj import CRS

    geodetic = horizontal_part(crs).geodetic_crs.to_json_dict()
    axes = [
        {"name": f"Geocentric {letter}", "abbreviation": letter, "direction": f"geocentric{letter}", "unit": "metre"}
        for letter in "XYZ"
    ]
    datum = {key: geodetic[key] for key in ("datum", "datum_ensemble") if key in geodetic}
    system = {"subtype": "Cartesian", "axis": axes}
    return CRS.from_json_dict({"type": "GeodeticCRS", "name": "geocentric", **datum, "coordinate_system": system})
