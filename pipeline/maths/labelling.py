"""Which face a point lies on: by polygon, with a margin of the footprint's half extent along its own direction."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.targets import TargetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

NO_FACE = -1


@dataclass(frozen=True)
class Labels:
    """face (n,): face number or -1. Masks of unlabelled points: off_surface, near_edge (on a face's plane, but outside
    its polygon or within the margin of its edges), grazing (ray too flat, or from behind)."""

    face: NDArray[np.int16]
    cos_incidence: Array
    off_surface: Flags
    near_edge: Flags
    grazing: Flags


@dataclass(frozen=True)
class Beams:
    """Rays in the target frame: unit directions (n, 3) and, for finite beams, the half widths' vectors at the range
    reached, across and along, (n, 3) m each: range · tan(half width) · unit vector normal to the ray."""

    directions: Array
    half_widths_m: tuple[Array, ...] = ()

    @classmethod
    def head_on(cls, count: int) -> "Beams":
        """Where rays are unknown (averaged points): every face is taken to be seen from its front."""
        return cls(np.zeros((count, 3)))

    def rows(self, index: NDArray[np.int64]) -> "Beams":
        return Beams(self.directions[index], tuple(width[index] for width in self.half_widths_m))

    def spreads(self, normal: Array) -> tuple[Array, ...]:
        """Half axes of the footprints on a plane, (n, 3) m each.

        Tilting a ray u by a small angle towards t moves its intersection with the plane by w = h - u (n · h) / (n · u),
        h = range · angle · t: h itself plus what is needed along the ray to come back to the plane (n · w = 0). On a
        face grazed at 10° the axis across the ray is six times longer than the beam is wide.
        """
        slant = self.directions @ normal
        return tuple(h - self.directions * ((h @ normal) / slant)[:, None] for h in self.half_widths_m)


@dataclass(frozen=True)
class NearPlane:
    """Faces in one plane, and the points near it: rows (m,) and their signed distances along ``axis`` (m,)."""

    faces: list[int]
    axis: Array
    rows: NDArray[np.int64]
    distance_m: Array


def _planes(model: TargetModel, points_m: Array, reach_m: float, among: Flags | None = None) -> Iterator[NearPlane]:
    """Each plane of the model with the points (of those ``among``) within ``reach_m``, parallel planes together.

    Of parallel planes a point goes to the nearest: one projection and one search for all tops and bottoms, not forty.
    """
    parallel: dict[tuple[float, ...], dict[float, list[int]]] = {}
    for number, face in enumerate(model.faces):
        sign = np.sign(face.normal[np.flatnonzero(np.abs(face.normal) > 1e-9)[0]])
        axis = tuple((sign * face.normal + 0.0).tolist())
        # Tops of one side and bottoms of the other lie at one height, computed by different sums: one plane.
        parallel.setdefault(axis, {}).setdefault(round(float(sign * face.distance_m), 9), []).append(number)
    for axis, planes in parallel.items():
        direction, offsets = np.array(axis), np.array(sorted(planes))
        along = points_m @ direction
        nearest = np.searchsorted((offsets[1:] + offsets[:-1]) / 2, along) if len(offsets) > 1 else 0
        distance = along - offsets[nearest]
        near = np.abs(distance) <= reach_m
        rows = np.flatnonzero(near if among is None else near & among)
        which = np.broadcast_to(nearest, len(points_m))[rows].astype(np.int16)
        rows = rows[np.argsort(which, kind="stable")]
        ends = np.cumsum(np.bincount(which, minlength=len(offsets)))
        for k, (start, end) in enumerate(pairwise([0, *ends.tolist()])):
            if end > start:
                here = rows[start:end]
                yield NearPlane(planes[float(offsets[k])], direction, here, distance[here])


def near_planes(
    model: TargetModel, points_m: Array, reach_m: float, among: Flags
) -> tuple[NDArray[np.int64], tuple[NearPlane, ...]]:
    """Rows of the points ``among`` (n,) these that lie within ``reach_m`` of some face's plane, ascending; and the
    planes, with the points numbered within those rows: for :func:`label_points` of these points alone."""
    planes = tuple(_planes(model, points_m, reach_m, among))
    near = np.zeros(len(points_m), dtype=bool)
    for plane in planes:
        near[plane.rows] = True
    number = np.cumsum(near) - 1
    return np.flatnonzero(near), tuple(replace(plane, rows=number[plane.rows]) for plane in planes)


def label_points(
    model: TargetModel,
    points_m: Array,
    beams: Beams,
    gate_m: float,
    margin_m: float,
    min_grazing_rad: float,
    planes: Iterable[NearPlane] | None = None,
) -> Labels:
    """Label points (n, 3) in the target frame; ``planes``: from :func:`near_planes`, where they are known already.

    A point belongs to a face if it lies within ``gate_m`` of the face's plane, its ray meets the front at no less than
    ``min_grazing_rad`` and its whole footprint lies within the polygon with ``margin_m`` to spare. Of several faces the
    nearest plane wins.
    """
    n = len(points_m)
    face_of = np.full(n, NO_FACE, dtype=np.int16)
    cosine_of = np.zeros(n)
    best = np.full(n, np.inf)
    near_plane, seen_flat = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    sine = np.sin(min_grazing_rad) if beams.directions.any() else 0.0
    for plane in _planes(model, points_m, gate_m) if planes is None else planes:
        z = points_m[plane.rows, 2]
        for number in plane.faces:
            face = model.faces[number]
            low, high = face.vertices_m[:, 2].min() - gate_m, face.vertices_m[:, 2].max() + gate_m
            level = np.flatnonzero((z >= low) & (z <= high))
            rows, away = plane.rows[level], plane.distance_m[level]
            on_plane = points_m[rows] - away[:, None] * plane.axis
            clearance = face.clearance(on_plane)
            inside = clearance >= 0
            near_plane[rows[inside]] = True
            rows, away, on_plane, clearance = rows[inside], away[inside], on_plane[inside], clearance[inside]
            cosine = -(beams.directions[rows] @ face.normal)
            steep = cosine >= sine
            seen_flat[rows[~steep]] = True
            if beams.half_widths_m:
                rows, away, on_plane, cosine = rows[steep], away[steep], on_plane[steep], cosine[steep]
                clear = face.clearance(on_plane, *beams.rows(rows).spreads(face.normal)) >= margin_m
            else:
                clear = steep & (clearance >= margin_m)
            better = clear & (np.abs(away) < best[rows])
            rows = rows[better]
            face_of[rows], cosine_of[rows], best[rows] = number, cosine[better], np.abs(away[better])
    free = face_of == NO_FACE
    grazing = free & seen_flat
    near_edge = free & near_plane & ~seen_flat
    return Labels(face_of, cosine_of, free & ~near_plane, near_edge, grazing)
