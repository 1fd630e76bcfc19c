"""The target frame of a found place, and its faces in it, continued below the water."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import radians

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.gaps import gaps_below
from pipeline.maths.geometry.geodesy import PoolFrame, geodetic_from_ecef
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.maths.surfaces.outline import bent, clipped, convex_hull
from pipeline.maths.target.face import plane_of
from pipeline.maths.target.outlines import looks_away

Array = NDArray[np.float64]
UPRIGHT_DEG = 20.0  # a wall may lean by this; what leans more is a slope
FOOT_M = 0.5  # height of the strip at the lower end of a face's dry part, by whose width it goes on below the water
BEND_M = 0.02  # a corner nearer to the line between its neighbours is none: rounded to mm it could bend inwards
DIGITS, ANGLE_DIGITS = 3, 9  # decimals of metres, and of latitude and longitude


@dataclass(frozen=True)
class FoundFace:
    """A face: its name, and its corners (k, 3), counter-clockwise as the boat sees them, target frame.

    continued_m (k, 2): the same along the axes of its plane; gaps_m (k, 2): heights above the water, lower and upper
    end, between which no points lie; below_m (k, 2): of further gaps, below the water, that nobody has seen.
    """

    name: str
    corners_m: Array
    plane: DryPlane
    continued_m: Array
    gaps_m: Array
    below_m: Array


@dataclass(frozen=True)
class FoundPlace:
    """A target: origin and azimuth, the height of the water in its frame, its faces.

    planes: all that were found; level_m: height of the water in their frame; read, used: numbers of laser points;
    boat_m: the middle of the boat's track, east and north in the planes' frame; track_m (k, 2): some of its places.
    """

    latitude_deg: float
    longitude_deg: float
    height_m: float
    azimuth_deg: float
    water_level_m: float
    faces: tuple[FoundFace, ...]
    planes: tuple[DryPlane, ...]
    level_m: float
    read: int = 0
    used: int = 0
    boat_m: tuple[float, float] = (0.0, 0.0)
    track_m: Array = field(default_factory=lambda: np.empty((0, 2)))


def found_place(planes: Sequence[DryPlane], level_m: float, frame: PoolFrame, depth_m: float) -> FoundPlace:
    """Return the target that these planes make.

    x goes into the largest wall, y along it, so that it lies to starboard of a boat that passes toward +y; the origin
    is on the wall, at the water, in the middle of the wall's dry part.

    Parameters
    ----------
    planes : sequence of DryPlane
        All planes, in the given frame.
    level_m : float
        Height of the water there.
    frame : PoolFrame
        The planes' frame, with its y axis to the north.
    depth_m : float
        Depth below the water to which faces are continued.

    Raises
    ------
    RawDataError
        No wall can serve.
    """
    walls = [plane for plane in planes if not plane.refused and abs(plane.tilt_deg - 90) < UPRIGHT_DEG]
    if not walls:
        raise RawDataError(
            f"laser: no upright wall that can serve among {len(planes)} planes; pass nearer to one, and slowly"
        )
    main = walls[0]
    ahead = -main.normal[:2] / np.linalg.norm(main.normal[:2])  # x, horizontal
    azimuth_deg = round(float(np.degrees(np.arctan2(-ahead[1], ahead[0]))) % 360, DIGITS)  # y = (-ahead_y, ahead_x)
    middle = main.corners_m(_at_height(main, level_m).mean(axis=0)[None])[0]
    latitude, longitude, height = geodetic_from_ecef(frame.points_to_ecef(middle[None])[0])
    latitude_deg, longitude_deg = (round(float(np.degrees(angle)), ANGLE_DIGITS) for angle in (latitude, longitude))
    height_m = round(height, DIGITS)
    target = PoolFrame.at(radians(latitude_deg), radians(longitude_deg), height_m, radians(azimuth_deg))
    water = target.points_from_ecef(frame.points_to_ecef(middle[None]))[0, 2]
    judged, faces = [], []
    for plane in planes:
        if not plane.refused:
            continued = _continued(plane, level_m, depth_m)
            corners = target.points_from_ecef(frame.points_to_ecef(plane.corners_m(continued)))
            if looks_away(corners, plane_of(corners)[0]):
                plane = replace(plane, refused="looks away from the passes beside the largest wall")
            else:
                faces.append((plane, np.round(corners, DIGITS), continued))
        judged.append(plane)
    return FoundPlace(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_m=height_m,
        azimuth_deg=azimuth_deg,
        water_level_m=round(float(water), DIGITS) + 0.0,  # no -0.0
        faces=_named(faces, level_m, depth_m),
        planes=tuple(judged),
        level_m=level_m,
    )


def _at_height(plane: DryPlane, level_m: float) -> Array:
    """Return the two ends (2, 2), along the plane's axes, of a face's foot, moved to a height."""
    _, up = plane_axes(plane.normal)
    base = plane.distance_m * plane.normal[2]
    height = (level_m - base) / up[2]
    lowest = max(float(plane.outline_m[:, 1].min()), height)
    foot = clipped(plane.outline_m, np.array([0.0, -1.0]), -(lowest + FOOT_M))
    foot = foot if len(foot) else plane.outline_m
    return np.array([[foot[:, 0].min(), height], [foot[:, 0].max(), height]])


def _continued(plane: DryPlane, level_m: float, depth_m: float) -> Array:
    """Return the outline (k, 2) of a face with its part below the water: a hypothesis, which the soundings test."""
    return bent(convex_hull(np.concatenate([plane.outline_m, _at_height(plane, level_m - depth_m)])), BEND_M)


def _named(
    faces: Sequence[tuple[DryPlane, Array, Array]], level_m: float, depth_m: float
) -> tuple[FoundFace, ...]:
    """Return the faces with names: walls and slopes, numbered along y."""
    counts = {"wall": 0, "slope": 0}
    named = []
    for plane, corners, continued in sorted(faces, key=lambda face: float(face[1][:, 1].mean())):
        kind = "wall" if abs(plane.tilt_deg - 90) < UPRIGHT_DEG else "slope"
        counts[kind] += 1
        gaps = plane.gaps_m - level_m if kind == "wall" else np.empty((0, 2))  # a slope's gaps have no one height
        below = gaps_below(gaps, plane.lowest_m - level_m, -depth_m)
        of_gaps = (np.round(heights, DIGITS) + 0.0 for heights in (gaps, below))  # no -0.0
        named.append(FoundFace(f"{kind}-{counts[kind]}", corners, plane, continued, *of_gaps))
    return tuple(named)
