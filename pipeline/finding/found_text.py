"""A found place as a table for people."""

import numpy as np

from pipeline.console import plural
from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.place import FoundFace, FoundPlace
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.text_table import text_table

LEAST_BEFORE_M = 0.15  # of a plane from a face before which it stands
ENOUGH = 4  # faces, of which the others show the one that is wrong


def table_text(place: FoundPlace) -> str:
    """Return the planes that were found, those that serve first, and the place, for the screen."""
    rows = table_rows(place)
    head = ["face", "lies to °", "away m", "width m", "height m", "looks to °", "lean °", "uneven mm", "points", ""]
    serve = f"{plural(len(place.faces), 'face')} of {plural(len(place.planes), 'plane')} can serve"
    return "\n".join(
        [
            f"{place.read:,} laser points, {place.used:,} of them used: {serve}.",
            "",
            *text_table("  <10>10>8>9>10>11>8>11>10  <1", head, rows),
            "Lies to, away: direction (from true north) and distance of its middle from that of the boat's track.",
            "",
            f"Origin: latitude {place.latitude_deg:.9f}, longitude {place.longitude_deg:.9f}, height "
            f"{place.height_m:.3f}; azimuth {place.azimuth_deg:.3f}°; the water is at {place.water_level_m:.3f} m.",
            *remarks(place),
        ]
    )


def remarks(place: FoundPlace) -> list[str]:
    """Return what is to be said of the faces: sentences of gaps, and that they are too few to test each other."""
    return [*(_of_gaps(face) for face in place.faces if len(face.gaps_m)), *too_few(place)]


def _of_gaps(face: FoundFace) -> str:
    """Return the sentence of a face's gaps."""
    gaps = ", ".join(f"{low:.2f} – {high:.2f}" for low, high in face.gaps_m)
    if len(face.below_m):
        return (
            f"{face.name} has gaps at {gaps} m above the water, which repeat: points at these heights are not used, "
            "nor soundings where the gaps would go on below the water."
        )
    return f"{face.name} has gaps at {gaps} m above the water: points at these heights are not used."


def too_few(place: FoundPlace) -> list[str]:
    """Return the sentence that the faces are too few to test each other; empty if they are enough."""
    if len(place.faces) >= ENOUGH:
        return []
    faces = plural(len(place.faces), "face")
    return [
        f"With {faces} nobody can tell which is wrong if one does not go on below the water as above: "
        f"pass {ENOUGH} or more."
    ]


def serving_first(place: FoundPlace) -> list[DryPlane]:
    """Return all planes: those of faces in the order of their names, then the others."""
    names = {id(face.plane): face.name for face in place.faces}
    return sorted(place.planes, key=lambda plane: (id(plane) not in names, names.get(id(plane), "")))


def table_rows(place: FoundPlace) -> list[list[str]]:
    """Return the rows of the table, a cell for each column; the last says why a plane cannot serve."""
    names = {id(face.plane): face.name for face in place.faces}
    return [_row(names.get(id(plane), ""), plane, place.boat_m, before(place, plane)) for plane in serving_first(place)]


def before(place: FoundPlace, plane: DryPlane) -> str:
    """Return the name of the nearest face before which a refused plane stands, such as a moored boat; "" if none."""
    if not plane.refused or plane.level or not len(plane.outline_m):
        return ""
    (middle_m,) = plane.corners_m(plane.middle_m[None])
    found = []
    for face in place.faces:
        wall, along_m = face.plane, face.plane.outline_m[:, 0]  # the outline's height lacks what is hidden
        off_m = float(middle_m @ wall.normal - wall.distance_m)
        if off_m > LEAST_BEFORE_M and along_m.min() < middle_m @ plane_axes(wall.normal)[0] < along_m.max():
            found.append((off_m, face.name))
    return min(found, default=(0.0, ""))[1]


def _row(name: str, plane: DryPlane, boat_m: tuple[float, float], hidden: str) -> list[str]:
    lies, away = "-", "-"
    if len(plane.outline_m):
        east, north = plane.corners_m(plane.middle_m[None])[0, :2] - boat_m
        lies, away = f"{np.degrees(np.arctan2(east, north)) % 360:.0f}", f"{np.hypot(east, north):.1f}"
    looks = float(np.degrees(np.arctan2(plane.normal[0], plane.normal[1]))) % 360
    flat = plane.flat
    return [
        name or "-",
        lies,
        away,
        f"{flat.width_m:.1f}",
        f"{flat.height_m:.1f}",
        f"{looks:.1f}",
        f"{90 - plane.tilt_deg:.1f}",
        f"{1000 * flat.uneven_m:.0f}",
        f"{plane.points:,}",
        plane.refused and f"refused: {plane.refused}" + (f"; before {hidden}" if hidden else ""),
    ]
