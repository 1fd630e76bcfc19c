"""Which face a point lies on: by polygon, with a margin of the footprint's half extent along its own direction."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

NO_FACE = -1
LEVEL_M = 1e-6  # rounding, of points on a horizontal face


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
    """Rays in the target frame: unit directions (n, 3), measured ranges (n,) m and, for finite beams, the half widths'
    vectors across and along, (n, 3) each, for one metre of range: tan(half width) · unit vector normal to the ray; the
    beam may stray by ``stray`` times the first of them."""

    directions: Array
    ranges_m: Array
    half_widths: tuple[Array, ...] = ()
    stray: float = 0.0

    @classmethod
    def head_on(cls, count: int) -> "Beams":
        """Where rays are unknown (averaged points): every face is taken to be seen from its front."""
        return cls(np.zeros((count, 3)), np.zeros(count))

    def corners(self, rows: NDArray[np.int64]) -> Iterator[Array]:
        """Rays (n, 3) along the four corners of these beams, as far out as the beams may stray."""
        across, along = (width[rows] for width in self.half_widths)
        for one, other in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            yield self.directions[rows] + one * (1 + self.stray) * across + other * along

    def spreads(self, rows: NDArray[np.int64], normal: Array, reached_m: Array) -> tuple[Array, ...]:
        """Half axes of the footprints on a plane that these rays meet at ``reached_m``, (n, 3) m each.

        Tilting a ray u by a small angle towards t moves its intersection with the plane by w = h - u (n · h) / (n · u),
        h = range · angle · t: h itself plus what is needed along the ray to come back to the plane (n · w = 0). On a
        face grazed at 10° the axis across the ray is six times longer than the beam is wide.
        """
        directions = self.directions[rows]
        slant, reached = (directions @ normal)[:, None], reached_m[:, None]
        halves = [width[rows] for width in self.half_widths]
        return tuple(reached * (h - directions * ((h @ normal)[:, None] / slant)) for h in halves)


def hidden_in_part(
    model: TargetModel, faces: NDArray[np.int16], corners: Iterable[Array], first_met: Callable[[Array], Integers]
) -> Flags:
    """Beams of which a corner ray meets something else than the plane of their face (n,): an edge before it hides part
    of the footprint, or another face rises out of it, and the echo is the mean of two things. ``first_met``: rays
    (n, 3) -> the face that each meets first (-1: none)."""
    planes = {plane: k for k, plane in enumerate(dict.fromkeys((one.family, one.offset_m) for one in model.faces))}
    plane = np.array([planes[one.family, one.offset_m] for one in model.faces] + [-1])
    hidden = np.zeros(len(faces), dtype=bool)
    for rays in corners:
        hidden |= plane[first_met(rays)] != plane[faces]
    return hidden


@dataclass(frozen=True)
class NearPlane:
    """Faces in one plane, and the points near it: rows (m,) and their signed distances along ``axis`` (m,)."""

    faces: list[int]
    axis: Array
    rows: NDArray[np.int64]
    distance_m: Array

    def met(self, points_m: Array, beams: Beams, sine: float) -> tuple[Array, Array]:
        """Where the rays of its points meet the plane (m, 3), and at what range (m,); of rays flatter than ``sine`` the
        feet of the points."""
        directions = beams.directions[self.rows]
        slant = directions @ self.axis
        steep = np.abs(slant) >= max(sine, np.finfo(float).tiny)
        beyond = np.where(steep, self.distance_m / np.where(steep, slant, 1.0), 0.0)
        ways = np.where(steep[:, None], beyond[:, None] * directions, self.distance_m[:, None] * self.axis)
        return points_m[self.rows] - ways, beams.ranges_m[self.rows] - beyond


def _planes(
    model: TargetModel, points_m: Array, reach_m: float, among: Flags | None = None, seen: str = "both"
) -> Iterator[NearPlane]:
    """Each plane of the model with the points (of those ``among``) within ``reach_m``, parallel planes together; of
    faces to be ``seen`` dry, or wet, or all.

    Of parallel planes a point goes to the nearest: one projection and one search for all tops and bottoms, not forty.
    """
    parallel: dict[tuple[float, ...], dict[float, list[int]]] = {}
    for number, face in enumerate(model.faces):
        if seen != "both" and face.seen not in (seen, "both"):
            continue
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
    model: TargetModel, points_m: Array, reach_m: float, among: Flags, seen: str
) -> tuple[NDArray[np.int64], tuple[NearPlane, ...]]:
    """Rows of the points ``among`` (n,) these that lie within ``reach_m`` of the plane of some face to be ``seen`` dry,
    or wet, ascending; and the planes, with the points numbered within those rows: for :func:`label_points` of these
    points alone."""
    planes = tuple(_planes(model, points_m, reach_m, among, seen))
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
    heights_m: tuple[float, float] = (-np.inf, np.inf),
    seen: str = "both",
) -> Labels:
    """Label points (n, 3) in the target frame by the faces to be ``seen`` dry, or wet, or all; ``planes``: from
    :func:`near_planes`, where they are known already.

    A point belongs to a face if it lies within ``gate_m`` of the face's plane, its ray meets the front at no less than
    ``min_grazing_rad`` and its whole footprint, taken where the ray meets the plane, lies within the polygon with
    ``margin_m`` to spare (or what the beam may stray, where that is more), and between ``heights_m``. Of several faces
    the nearest plane wins.

    Where the ray meets the plane does not depend on the measured range, nor does the footprint there. Were the point
    itself taken, a range too long
    would bring it in at one edge of a grazed face and out at the other, and those that are left would tilt the face:
    cov(distance from the plane, place) = σ² sin i cos i. (Along the water line alone that was a fifth of the sigma of
    roll.) The point must lie within the polygon nevertheless, by half the margin, which noise does not cross: a strong
    echo of a corner stands on the corner wherever its beam points.
    """
    n = len(points_m)
    face_of = np.full(n, NO_FACE, dtype=np.int16)
    cosine_of = np.zeros(n)
    best = np.full(n, np.inf)
    near_plane, seen_flat = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    sine = np.sin(min_grazing_rad) if beams.directions.any() else 0.0
    for plane in _planes(model, points_m, gate_m, seen=seen) if planes is None else planes:
        met, ranges = plane.met(points_m, beams, sine)
        for number in plane.faces:
            face = model.faces[number]
            low, high = face.vertices_m[:, 2].min() - LEVEL_M, face.vertices_m[:, 2].max() + LEVEL_M
            level = np.flatnonzero((met[:, 2] >= low) & (met[:, 2] <= high))
            rows, away, on_plane, reached = plane.rows[level], plane.distance_m[level], met[level], ranges[level]
            clearance = face.clearance(on_plane)
            inside = (clearance >= 0) & (on_plane[:, 2] > heights_m[0]) & (on_plane[:, 2] < heights_m[1])
            near_plane[rows[inside]] = True
            rows, away, on_plane, reached = rows[inside], away[inside], on_plane[inside], reached[inside]
            cosine = -(beams.directions[rows] @ face.normal)
            steep = cosine >= sine
            seen_flat[rows[~steep]] = True
            steep &= face.clearance(points_m[rows] - away[:, None] * plane.axis) >= margin_m / 2
            if beams.half_widths:
                rows, away, on_plane, cosine = rows[steep], away[steep], on_plane[steep], cosine[steep]
                spreads = beams.spreads(rows, face.normal, reached[steep])
                clear = face.clearance(on_plane, *spreads, margin_m=margin_m, stray_m=beams.stray * spreads[0]) >= 0
            else:
                clear = steep & (clearance[inside] >= margin_m)
            better = clear & (np.abs(away) < best[rows])
            rows = rows[better]
            face_of[rows], cosine_of[rows], best[rows] = number, cosine[better], np.abs(away[better])
    free = face_of == NO_FACE
    grazing = free & seen_flat
    near_edge = free & near_plane & ~seen_flat
    return Labels(face_of, cosine_of, free & ~near_plane, near_edge, grazing)
