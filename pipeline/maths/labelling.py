"""Which face a point lies on: by polygon, with a margin of the footprint's half extent along its own direction."""

from dataclasses import dataclass

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


def near_planes(model: TargetModel, points_m: Array, reach_m: float) -> Flags:
    """Points (n,) within ``reach_m`` of the plane of some face: a quick way to leave out the rest."""
    near = np.zeros(len(points_m), dtype=bool)
    for normal, distance in sorted({(tuple(face.normal.tolist()), face.distance_m) for face in model.faces}):
        near |= np.abs(points_m @ np.array(normal) - distance) <= reach_m
    return near


def label_points(
    model: TargetModel, points_m: Array, beams: Beams, gate_m: float, margin_m: float, min_grazing_rad: float
) -> Labels:
    """Label points (n, 3) in the target frame.

    A point belongs to a face if it lies within ``gate_m`` of the face's plane, its ray meets the front at no less than
    ``min_grazing_rad`` and its whole footprint lies within the polygon with ``margin_m`` to spare. Of several faces the
    nearest plane wins.
    """
    n = len(points_m)
    face_of = np.full(n, NO_FACE, dtype=np.int16)
    cosine_of = np.zeros(n)
    best = np.full(n, np.inf)
    near_plane, seen_flat = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    z = points_m[:, 2]
    sine = np.sin(min_grazing_rad) if beams.directions.any() else 0.0
    planes: dict[tuple[float, ...], tuple[Array, NDArray[np.int64]]] = {}
    for number, face in enumerate(model.faces):
        key = (*face.normal, face.distance_m)
        if key not in planes:
            distance = points_m @ face.normal - face.distance_m
            planes[key] = (distance, np.flatnonzero(np.abs(distance) <= gate_m))
        distance, index = planes[key]
        low, high = face.vertices_m[:, 2].min() - gate_m, face.vertices_m[:, 2].max() + gate_m
        index = index[(z[index] >= low) & (z[index] <= high)]
        if len(index) == 0:
            continue
        on_plane = points_m[index] - distance[index, None] * face.normal
        inside = face.clearance(on_plane) >= 0
        near_plane[index[inside]] = True
        index, on_plane = index[inside], on_plane[inside]
        cosine = -(beams.directions[index] @ face.normal)
        steep = cosine >= sine
        seen_flat[index[~steep]] = True
        index, on_plane, cosine = index[steep], on_plane[steep], cosine[steep]
        clear = face.clearance(on_plane, *beams.rows(index).spreads(face.normal)) >= margin_m
        better = clear & (np.abs(distance[index]) < best[index])
        index = index[better]
        face_of[index], cosine_of[index], best[index] = number, cosine[better], np.abs(distance[index])
    free = face_of == NO_FACE
    grazing = free & seen_flat
    near_edge = free & near_plane & ~seen_flat
    return Labels(face_of, cosine_of, free & ~near_plane, near_edge, grazing)
