"""A found place as a table for people."""

import numpy as np

from pipeline.console import plural
from pipeline.finding.dry_planes import DryPlane
from pipeline.finding.place import FoundPlace
from pipeline.text_table import text_table


def table_text(place: FoundPlace) -> str:
    """Return the planes that were found, those that serve first, and the place, for the screen."""
    names = {id(face.plane): face.name for face in place.faces}
    order = sorted(place.planes, key=lambda plane: (id(plane) not in names, names.get(id(plane), "")))
    rows = [_row(names.get(id(plane), ""), plane) for plane in order]
    head = ["face", "width m", "height m", "looks to °", "lean °", "uneven mm", "points", ""]
    serve = f"{plural(len(place.faces), 'face')} of {plural(len(place.planes), 'plane')} can serve"
    return "\n".join(
        [
            f"{place.read:,} laser points, {place.used:,} of them used: {serve}.",
            "",
            *text_table("  <10>9>10>11>8>11>10  <1", head, rows),
            "",
            f"Origin: latitude {place.latitude_deg:.9f}, longitude {place.longitude_deg:.9f}, height "
            f"{place.height_m:.3f}; azimuth {place.azimuth_deg:.3f}°; the water is at {place.water_level_m:.3f} m.",
        ]
    )


def _row(name: str, plane: DryPlane) -> list[str]:
    looks = float(np.degrees(np.arctan2(plane.normal[0], plane.normal[1]))) % 360
    flat = plane.flat
    return [
        name or "-",
        f"{flat.width_m:.1f}",
        f"{flat.height_m:.1f}",
        f"{looks:.1f}",
        f"{90 - plane.tilt_deg:.1f}",
        f"{1000 * flat.uneven_m:.0f}",
        f"{plane.points:,}",
        plane.refused and f"refused: {plane.refused}",
    ]
