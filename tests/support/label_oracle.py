"""Labels of points by numpy, plane by plane and face by face: the oracle of the compiled loop."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.labels import MOST_SLANTED
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.face import Face
from pipeline.maths.target.face_tables import ROUNDING_M
from pipeline.maths.target.labelling import NO_FACE, Labels, LabelSettings
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


class _Candidates:
    """The best face of each point so far, while face after face is tried."""

    def __init__(self, points_m: Array, beams: TargetBeams, settings: LabelSettings) -> None:
        count = len(points_m)
        self.points_m, self.beams, self.settings = points_m, beams, settings
        self.sine = np.sin(settings.min_grazing_rad) if beams.directions.any() else 0.0
        self.face = np.full(count, NO_FACE, dtype=np.int16)
        self.cosine, self.edge_weight = np.zeros(count), np.zeros(count)
        self.distance_m = np.full(count, np.inf)
        self.near_plane, self.too_flat = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)

    def try_plane(self, plane: NearPlane, faces: tuple[Face, ...]) -> None:
        """Try all faces in one plane."""
        met, ranges = plane.intersections(self.points_m, self.beams, self.sine)
        for number in plane.faces:
            self._try_face(number, faces[number], plane, met, ranges)

    def _try_face(self, number: int, face: Face, plane: NearPlane, met: Array, ranges: Array) -> None:
        settings, beams = self.settings, self.beams
        low, high = face.vertices_m[:, 2].min() - ROUNDING_M, face.vertices_m[:, 2].max() + ROUNDING_M
        level = np.flatnonzero((met[:, 2] >= low) & (met[:, 2] <= high))
        rows, away, on_plane, reached = plane.rows[level], plane.distance_m[level], met[level], ranges[level]
        clearance = face.clearance(on_plane)
        inside = (clearance >= 0) & (on_plane[:, 2] > settings.lowest_m) & (on_plane[:, 2] < settings.highest_m)
        self.near_plane[rows[inside]] = True
        rows, away, on_plane, reached = rows[inside], away[inside], on_plane[inside], reached[inside]
        cosine = -(beams.directions[rows] @ face.normal)
        steep = cosine >= self.sine
        self.too_flat[rows[~steep]] = True
        steep &= face.clearance(self.points_m[rows] - away[:, None] * plane.axis) >= settings.margin_m / 2
        if beams.half_widths:
            rows, away, on_plane, cosine = rows[steep], away[steep], on_plane[steep], cosine[steep]
            reached = reached[steep]
            spreads = beams.spreads(rows, face.normal, reached)
            stray_m = beams.stray_on(rows, face.normal, reached)
            limits = {"margin_m": settings.margin_m, "corner_factor": settings.corner_factor}
            spare_m = face.clearance(on_plane, *spreads, stray_m=stray_m, **limits)
            half = settings.corner_factor * sum(np.abs(spread[:, 2]) for spread in spreads)
        else:
            half = settings.spot_m / np.maximum(cosine, MOST_SLANTED)
            spare_m = np.where(steep, clearance[inside] - np.maximum(settings.margin_m, half), -1.0)
            half = np.zeros(1)
        height = on_plane[:, 2]
        spare_m = np.minimum(spare_m, np.minimum(settings.highest_m - height, height - settings.lowest_m) - half)
        better = (spare_m > 0) & (np.abs(away) < self.distance_m[rows])
        rows = rows[better]
        self.face[rows], self.cosine[rows] = number, cosine[better]
        self.edge_weight[rows] = np.minimum(1.0, spare_m[better] / settings.ramp_m) if settings.ramp_m else 1.0
        self.distance_m[rows] = np.abs(away[better])

    def labels(self) -> Labels:
        """Return the faces of the points, and for points without a face the reason."""
        free = self.face == NO_FACE
        near_edge = free & self.near_plane & ~self.too_flat
        return Labels(
            face=self.face,
            cos_incidence=self.cosine,
            edge_weight=self.edge_weight,
            off_surface=free & ~self.near_plane,
            near_edge=near_edge,
            grazing=free & self.too_flat,
            masked=np.zeros(len(free), dtype=bool),
        )


def label_points_by_numpy(
    model: TargetModel, points_m: Array, beams: TargetBeams, settings: LabelSettings, among: Flags | None = None
) -> Labels:
    """Return what ``label_points`` must return."""
    candidates = _Candidates(points_m, beams, settings)
    for plane in planes_with_points(model, points_m, settings.gate_m, among, settings.seen):
        candidates.try_plane(plane, model.faces)
    labels = candidates.labels()
    return labels if among is None else replace(labels, off_surface=labels.off_surface & among)
