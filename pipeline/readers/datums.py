"""A coordinate reference system's own way to ECEF: within its datum, over its own ellipsoid.

The INS's positions and the points are taken to be in one datum, whichever that is. No step from datum to datum is ever
made: for most of them the parameters depend on place and date. "ECEF" is then the geocentric form of that datum. The
INS's latitudes and longitudes go through the ellipsoid of WGS 84 (``pipeline.maths.geometry.geodesy``), points through
that of their CRS: GRS 80 and CGCS2000 differ from it by 0.12 mm at most. Others differ by metres.
"""

from typing import Any

WGS84_AXES_M = (6_378_137.0, 6_356_752.314245)  # semi-major, semi-minor
SAME_M = 0.001
LEVEL, UP = {"east", "north"}, "up"


def horizontal_of(crs: Any) -> Any:
    """The CRS without a compound's heights, and without a transformation to another datum that is bound to it."""
    if crs.is_compound:
        return horizontal_of(crs.sub_crs_list[0])
    return horizontal_of(crs.source_crs) if crs.is_bound else crs


def vertical_of(crs: Any) -> str | None:
    """The name of a compound CRS's vertical part, unless that is the ellipsoid."""
    names = [part.name for part in crs.sub_crs_list if part.is_vertical]
    return next((name for name in names if "ellipsoid" not in name.lower()), None)


def unfit(crs: Any) -> str | None:
    """Why points in this CRS cannot be placed beside an INS's positions; None where they can."""
    level = horizontal_of(crs)
    if level.geodetic_crs is None:
        return "is no CRS of points on the earth; write laser, EPSG:4978 or the like"
    directions = [axis.direction.lower() for axis in (*level.axis_info, *crs.axis_info[2:])]
    heights = [direction for direction in directions[2:] if not crs.is_geocentric]
    if not crs.is_geocentric and (set(directions[:2]) != LEVEL or set(heights) - {UP}):
        return f"has axes that run {', '.join(directions)}; export the points in a CRS of east, north and up"
    ellipsoid = level.ellipsoid
    if not is_satellites(ellipsoid):
        return (
            f"is on the ellipsoid {ellipsoid.name}, the INS on that of WGS 84, GRS 80 or CGCS2000: points and heights "
            "would be wrong by metres; export the points in the INS's datum, such as in EPSG:4978"
        )
    if level.prime_meridian.longitude != 0:
        return f"counts longitudes from {level.prime_meridian.name}; export the points with longitudes from Greenwich"
    return None


def is_satellites(ellipsoid: Any) -> bool:
    """Whether an ellipsoid is that of WGS 84, or as good as that: GRS 80, CGCS2000."""
    axes = (ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre)
    return all(abs(own - other) < SAME_M for own, other in zip(axes, WGS84_AXES_M, strict=True))


def geocentric_of(crs: Any) -> Any:
    """The geocentric CRS of the same datum, metres."""
    from pyproj import CRS

    told = horizontal_of(crs).geodetic_crs.to_json_dict()
    axes = [
        {"name": f"Geocentric {letter}", "abbreviation": letter, "direction": f"geocentric{letter}", "unit": "metre"}
        for letter in "XYZ"
    ]
    datum = {key: told[key] for key in ("datum", "datum_ensemble") if key in told}
    system = {"subtype": "Cartesian", "axis": axes}
    return CRS.from_json_dict({"type": "GeodeticCRS", "name": "geocentric", **datum, "coordinate_system": system})
