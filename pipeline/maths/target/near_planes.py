"""Points near the planes of a target's faces."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class NearPlane:
    """Numbers of the faces in one plane, rows (m,) of the points near it, and their distances (m,) along ``axis``."""

    faces: list[int]
    axis: Array
    rows: NDArray[np.int64]
    distance_m: Array

    def intersections(self, points_m: Array, beams: TargetBeams, sine: float) -> tuple[Array, Array]:
        """Return the points (m, 3) in which the rays meet the plane, and their ranges (m,).

        For rays that meet the plane at less than the angle of ``sine``, they are the feet of the points instead.

        Parameters
        ----------
        points_m
            All points (n, 3) m, target frame.
        beams
            Rays of the points.
        sine
            Sine of the smallest angle between ray and plane.
        """
        directions = beams.directions[self.rows]
        slant = directions @ self.axis
        steep = np.abs(slant) >= max(sine, np.finfo(float).tiny)
        beyond = np.where(steep, self.distance_m / np.where(steep, slant, 1.0), 0.0)
        ways = np.where(steep[:, None], beyond[:, None] * directions, self.distance_m[:, None] * self.axis)
        return points_m[self.rows] - ways, beams.ranges_m[self.rows] - beyond


def planes_with_points(
    model: TargetModel, points_m: Array, reach_m: float, among: Flags | None = None, seen: str = "both"
) -> Iterator[NearPlane]:
    """Yield each plane of the model that has points within ``reach_m``, with these points.

    Among parallel planes a point belongs to the nearest. So one projection and one search serve all tops and bottoms,
    instead of forty.

    Parameters
    ----------
    model
        The target.
    points_m
        Points (n, 3) m, target frame.
    reach_m
        Largest distance from the plane.
    among
        Mask (n,) of the points to use; None: all.
    seen
        Faces to use: "dry" (those that the laser uses), "wet" (those that the sonar uses), or "both" (all).
    """
    parallel: dict[tuple[float, ...], dict[float, list[int]]] = {}
    for number, face in enumerate(model.faces):
        if seen != "both" and face.seen not in (seen, "both"):
            continue
        sign = np.sign(face.normal[np.flatnonzero(np.abs(face.normal) > 1e-9)[0]])
        axis = tuple((sign * face.normal + 0.0).tolist())
        # Tops of one side and bottoms of the other lie at one height from different sums: rounding makes one plane.
        parallel.setdefault(axis, {}).setdefault(round(float(sign * face.distance_m), 9), []).append(number)
    for axis, planes in parallel.items():
        direction, offsets = np.array(axis), np.array(sorted(planes))
        along = points_m @ direction
        nearest = np.searchsorted((offsets[1:] + offsets[:-1]) / 2, along) if len(offsets) > 1 else 0
        distance = along - offsets[nearest]
        near = np.abs(distance) <= reach_m
        rows = np.flatnonzero(near if among is None else near & among)
        plane_number = np.broadcast_to(nearest, len(points_m))[rows].astype(np.int16)
        rows = rows[np.argsort(plane_number, kind="stable")]
        ends = np.cumsum(np.bincount(plane_number, minlength=len(offsets)))
        for k, (start, end) in enumerate(pairwise([0, *ends.tolist()])):
            if end > start:
                rows_of_plane = rows[start:end]
                yield NearPlane(planes[float(offsets[k])], direction, rows_of_plane, distance[rows_of_plane])


def near_planes(
    model: TargetModel, points_m: Array, reach_m: float, among: Flags, seen: str
) -> tuple[NDArray[np.int64], tuple[NearPlane, ...]]:
    """Return the rows of the points near any plane of the target, and these planes, to label only these points.

    Parameters
    ----------
    model
        The target.
    points_m
        Points (n, 3) m, target frame.
    reach_m
        Largest distance from the plane.
    among
        Mask (n,) of the points to use.
    seen
        Faces to use: "dry" (those that the laser uses), "wet" (those that the sonar uses), or "both" (all).

    Returns
    -------
    Rows, ascending, and the planes. The rows of a plane are numbers within the returned rows.
    """
    planes = tuple(planes_with_points(model, points_m, reach_m, among, seen))
    near = np.zeros(len(points_m), dtype=bool)
    for plane in planes:
        near[plane.rows] = True
    number = np.cumsum(near) - 1
    return np.flatnonzero(near), tuple(replace(plane, rows=number[plane.rows]) for plane in planes)
