"""A face of the target: a convex planar polygon, its edges, and the lines along which it meets other faces."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.face_grid import face_axes

Array = NDArray[np.float64]

HORIZONTAL_COSINE = 0.9998  # smallest |n_z| of a horizontal face: within 1.1°
SAME_CORNER_M = 0.01  # corners nearer than this to each other are the same
Mask = tuple[float, float, float, float]  # along the face from its middle, low and high; z, low and high; m
TOUCH_M = 0.005  # a corner nearer than this to a plane lies in it


@dataclass(frozen=True)
class Face:
    """A convex planar polygon of the target.

    Parameters
    ----------
    name, family
        Names of the face and of its family.
    normal, distance_m
        Plane ``normal · x = distance_m`` with the normal (3,) outward, target frame.
    vertices_m
        Corners (k, 3), counter-clockwise about the normal.
    sense
        +1 if its normal is that of its family, -1 if it is the opposite.
    offset_m
        Distance from the plane of the family, along the family's normal.
    seen
        The sensors that use the face: "dry" (the laser alone), "wet" (the sonar alone) or "both".
    creases_m
        Lines (2, 3) within the face along which another face meets it.
    masks_m
        Parts in which no point counts.
    outer_edges
        Whether each edge, from its corner to the next, is an outer corner of the target: another face turns away from
        this one along the whole edge. Any other edge may be an inner corner.
    """

    name: str
    family: str
    normal: Array
    distance_m: float
    vertices_m: Array
    sense: float = 1.0
    offset_m: float = 0.0
    seen: str = "both"
    creases_m: tuple[Array, ...] = ()
    outer_edges: tuple[bool, ...] = ()
    masks_m: tuple[Mask, ...] = ()

    @property
    def level(self) -> bool:
        """Return whether the face is horizontal."""
        return bool(abs(self.normal[2]) > HORIZONTAL_COSINE)

    @property
    def width_m(self) -> float:
        """Return the horizontal width of the face, measured along the face; for a horizontal face its width in y."""
        across = np.array([-self.normal[1], self.normal[0]])
        across = across / np.linalg.norm(across) if not self.level else np.array([0.0, 1.0])
        return float(np.ptp(self.vertices_m[:, :2] @ across))

    @cached_property
    def inward_edges(self) -> tuple[Array, Array]:
        """Return the inward unit vectors m (k, 3) of the edges, and their offsets (k,): m · x >= offset inside."""
        edges = np.roll(self.vertices_m, -1, axis=0) - self.vertices_m
        inward = np.cross(self.normal, edges)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        return inward, np.sum(inward * self.vertices_m, axis=1)

    def clearance(
        self,
        points_m: Array,
        *spreads_m: Array,
        margin_m: float = 0.0,
        stray_m: Array | None = None,
        corner_factor: float = 0.0,
    ) -> Array:
        """Return the smallest distance (n,) of points in the plane from the polygon's edges, + inside.

        Each point stands for its footprint, the parallelogram point ± spread_1 ± spread_2: its extent counts in the
        direction across each edge. From every edge the margin is kept besides, or the stray of the footprint across
        the edge if that is larger. From an edge that may be an inner corner, the distance is at least the footprint's
        extent times a factor. A crease counts along its length as such an edge on both sides.

        Parameters
        ----------
        points_m
            Points (n, 3) that lie in the plane.
        spreads_m
            Half axes (n, 3) of the footprints in the plane.
        margin_m
            Margin from every edge.
        stray_m
            Vectors (n, 3) by which the footprints may stray.
        corner_factor
            How many extents of the footprint an inner corner must be off.
        """

        def reach(axis: Array, outer: bool = False) -> Array:
            """Return the extent of the footprint with its margin along a unit vector (3,)."""
            spread = sum((np.abs(half_axis @ axis) for half_axis in spreads_m), start=np.zeros(1))
            edge = spread + (margin_m if stray_m is None else np.maximum(np.abs(stray_m @ axis), margin_m))
            return edge if outer else np.maximum(edge, corner_factor * spread)

        inward, offsets = self.inward_edges
        smallest = np.full(len(points_m), np.inf)
        outer_edges = self.outer_edges or (False,) * len(offsets)
        for normal, offset, outer in zip(inward, offsets, outer_edges, strict=True):
            np.minimum(smallest, points_m @ normal - offset - reach(normal, outer), out=smallest)
        for start, end in self.creases_m:
            half = np.linalg.norm(end - start) / 2
            along = (end - start) / (2 * half)
            across = np.cross(self.normal, along)
            away = points_m - (start + end) / 2
            aside, beyond = np.abs(away @ across) - reach(across), np.abs(away @ along) - half - reach(along)
            np.minimum(smallest, np.maximum(aside, beyond), out=smallest)
        return smallest

    def mirrored(self) -> "Face":
        """Return the face with left and right exchanged, y -> -y; its corners run the other way round."""
        flip = np.array([1.0, -1.0, 1.0])
        return replace(
            self,
            normal=self.normal * flip,
            vertices_m=self.vertices_m[::-1] * flip,
            creases_m=tuple(line * flip for line in self.creases_m),
            masks_m=tuple((-right, -left, low, high) for left, right, low, high in self.masks_m),
            outer_edges=(*self.outer_edges[-2::-1], *self.outer_edges[-1:]),
        )

    def meets(self, other: "Face") -> Array | None:
        """Return the line (2, 3) along which another face meets this one within its edges; None if there is none."""
        away = other.vertices_m @ self.normal - self.distance_m
        ends = list(other.vertices_m[np.abs(away) < TOUCH_M])
        for k, (start, end) in enumerate(zip(away, np.roll(away, -1), strict=True)):
            if start * end < 0 and min(abs(start), abs(end)) >= TOUCH_M:
                corner, next_corner = other.vertices_m[k], other.vertices_m[(k + 1) % len(away)]
                ends.append(corner + (next_corner - corner) * start / (start - end))
        if len(ends) != 2:
            return None  # apart, touching in a point, or in one plane
        line = ends[0] + np.linspace(0, 1, 41)[:, None] * (ends[1] - ends[0])
        inside = np.flatnonzero(self.clearance(line) > SAME_CORNER_M)
        return None if len(inside) < 2 else np.array([line[inside[0]], line[inside[-1]]])

    def turns_away(self, other: "Face") -> Array:
        """Return for each edge (k,) whether another face has the whole edge and makes an outer corner there.

        Both ends lie on the other face, and each face's middle lies behind the other's plane.
        """
        on_plane = np.abs(self.vertices_m @ other.normal - other.distance_m) < TOUCH_M
        on_face = on_plane & (other.clearance(self.vertices_m) > -SAME_CORNER_M)
        behind = other.vertices_m.mean(axis=0) @ self.normal - self.distance_m < -TOUCH_M
        behind &= self.vertices_m.mean(axis=0) @ other.normal - other.distance_m < -TOUCH_M
        return np.asarray(on_face & np.roll(on_face, -1) & behind)

    def cells(self, step_m: float) -> tuple[Array, float]:
        """Return the centres (n, 3) m of cells with sides of about ``step_m`` on the face, and the area of each in m².

        The sides run along :func:`face_axes`; whole cells fill the face's extent. A cell counts if its centre lies on
        the face.
        """
        axes = face_axes(self.normal)
        along = self.vertices_m @ axes.T
        low, extent = along.min(axis=0), np.ptp(along, axis=0)
        counts = np.maximum(1, np.rint(extent / step_m)).astype(int)
        sides = extent / counts
        columns, rows = (start + (np.arange(n) + 0.5) * side for start, n, side in zip(low, counts, sides, strict=True))
        flat = np.column_stack([np.repeat(columns, len(rows)), np.tile(rows, len(columns))]) @ axes
        centres = flat + np.outer(self.distance_m - flat @ self.normal, self.normal)
        return np.asarray(centres[self.clearance(centres) >= 0]), float(np.prod(sides))

    def same_corners(self, other: "Face") -> bool:
        """Return whether both faces have the same corners, in any order."""
        away = np.linalg.norm(self.vertices_m[:, None] - other.vertices_m[None], axis=2)
        same_count = len(self.vertices_m) == len(other.vertices_m)
        return bool(same_count and np.all(away.min(axis=1) < SAME_CORNER_M))


def plane_of(vertices_m: Array) -> tuple[Array, float]:
    """Return the unit normal (3,) and the distance of a polygon (k, 3), counter-clockwise about the normal.

    Newell's method: the components of Σ v_i × v_{i+1} are twice the areas of the polygon's projections along each axis.
    It also holds for corners slightly off a plane. The distance is the mean of normal · v.
    """
    after = np.roll(vertices_m, -1, axis=0)
    shadows = np.sum((vertices_m - after)[:, [1, 2, 0]] * (vertices_m + after)[:, [2, 0, 1]], axis=0)
    normal = shadows / np.linalg.norm(shadows) + 0.0
    return normal, float(np.mean(vertices_m @ normal))
