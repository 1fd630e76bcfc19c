"""The target: named planar polygons, and what is known of how their planes lie to each other.

Faces that are known to be parallel, at known distances, form a *family*: one plane of unknown place and direction, from
which each of its faces stands off by a known *offset* along the family's normal (zero for all that lie in one plane).
A dry face and a wet one of a family see the same plane; that is what a calibration lives on. A family is *level* if its
plane is horizontal: then its normal points up and offsets are heights.

Nothing downstream knows what the target is called or made of: it sees faces with a family, a plane and corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROLES = ("P1", "P2", "P3")  # of the patent's steps
LEVEL = 0.9998  # |n_z| of what is called horizontal: within 1.1°
ALIKE_M = 0.01  # corners nearer than this to each other are the same
TOUCH_M = 0.005  # a corner nearer than this to a plane lies in it


@dataclass(frozen=True)
class Face:
    """A convex planar polygon: ``normal · x = distance_m`` on it, normal outward, corners (k, 3) counter-clockwise
    about the normal, in the target frame. ``sense``: +1 where its normal is its family's, -1 where it is the opposite;
    ``offset_m`` from the family's plane, along the family's normal; ``seen``: by which sensor it is to be used;
    ``creases_m``: lines (2, 3) within it along which another face meets it."""

    name: str
    family: str
    normal: Array
    distance_m: float
    vertices_m: Array
    sense: float = 1.0
    offset_m: float = 0.0
    seen: str = "both"
    creases_m: tuple[Array, ...] = ()

    @property
    def level(self) -> bool:
        return bool(abs(self.normal[2]) > LEVEL)

    @property
    def width_m(self) -> float:
        """How far it reaches horizontally, along itself."""
        across = np.array([-self.normal[1], self.normal[0]])
        across = across / np.linalg.norm(across) if not self.level else np.array([0.0, 1.0])
        return float(np.ptp(self.vertices_m[:, :2] @ across))

    def inward_edges(self) -> tuple[Array, Array]:
        """Per edge the unit vector in the plane that points inside, (k, 3), and its offset: m · x >= offset inside."""
        edges = np.roll(self.vertices_m, -1, axis=0) - self.vertices_m
        inward = np.cross(self.normal, edges)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        return inward, np.sum(inward * self.vertices_m, axis=1)

    def clearance(
        self, points_m: Array, *spreads_m: Array, margin_m: float = 0.0, stray_m: Array | None = None
    ) -> Array:
        """Smallest distance (n,) from the polygon's edges, + inside, of points (n, 3) that lie in its plane.

        Each spread (n, 3) is a half axis of the footprint in the plane: the point counts with the whole parallelogram
        point ± spread_1 ± spread_2, so the margin lies along the direction in which the footprint spreads. From every
        edge a margin is kept besides, or what the footprint may stray (n, 3) across it where that is more. Creases
        count as edges, of both sides, along their length.
        """

        def reach(axis: Array) -> Array | float:
            """How far the footprint and its margin go along a unit vector (3,)."""
            spread = sum((np.abs(one @ axis) for one in spreads_m), start=np.zeros(1))
            return spread + (margin_m if stray_m is None else np.maximum(np.abs(stray_m @ axis), margin_m))

        inward, offsets = self.inward_edges()
        smallest = np.full(len(points_m), np.inf)
        for normal, offset in zip(inward, offsets, strict=True):
            np.minimum(smallest, points_m @ normal - offset - reach(normal), out=smallest)
        for one, other in self.creases_m:
            half = np.linalg.norm(other - one) / 2
            along = (other - one) / (2 * half)
            across = np.cross(self.normal, along)
            away = points_m - (one + other) / 2
            aside, beyond = np.abs(away @ across) - reach(across), np.abs(away @ along) - half - reach(along)
            np.minimum(smallest, np.maximum(aside, beyond), out=smallest)
        return smallest

    def meets(self, other: "Face") -> Array | None:
        """The line (2, 3) along which the other face meets this one within its edges; None where it does not."""
        away = other.vertices_m @ self.normal - self.distance_m
        ends = list(other.vertices_m[np.abs(away) < TOUCH_M])
        for k, (start, end) in enumerate(zip(away, np.roll(away, -1), strict=True)):
            if start * end < 0 and min(abs(start), abs(end)) >= TOUCH_M:
                one, next_ = other.vertices_m[k], other.vertices_m[(k + 1) % len(away)]
                ends.append(one + (next_ - one) * start / (start - end))
        if len(ends) != 2:
            return None  # apart, touching in a point, or in one plane
        line = ends[0] + np.linspace(0, 1, 41)[:, None] * (ends[1] - ends[0])
        inside = np.flatnonzero(self.clearance(line) > ALIKE_M)
        return None if len(inside) < 2 else np.array([line[inside[0]], line[inside[-1]]])

    def grid(self, step_m: float, lowest_m: float) -> Array:
        """Points (n, 3) about ``step_m`` apart on an upright face, above ``lowest_m``."""
        low, high = self.vertices_m[:, 2].min(), self.vertices_m[:, 2].max()
        across = np.array([-self.normal[1], self.normal[0], 0.0]) / np.hypot(*self.normal[:2])
        up = np.cross(self.normal, across)
        up *= np.sign(up[2])
        along = self.vertices_m @ across
        many = max(1, round(float(np.ptp(along)) / step_m))
        columns = along.min() + (np.arange(many) + 0.5) / many * np.ptp(along)
        heights = np.arange(max(low, lowest_m) + step_m / 2, high, step_m)
        foot = self.distance_m * self.normal
        rows = (heights - foot[2]) / up[2]
        points = foot + np.repeat(columns, len(rows))[:, None] * across + np.tile(rows, many)[:, None] * up
        return np.asarray(points[self.clearance(points) >= 0])


@dataclass(frozen=True)
class Family:
    """Parallel faces at known distances; on its plane ``normal · x = distance_m`` by design. ``faces``: their numbers;
    ``one_plane``: no face stands off it."""

    name: str
    normal: Array
    distance_m: float
    faces: tuple[int, ...]
    one_plane: bool

    @property
    def level(self) -> bool:
        return bool(self.normal[2] > LEVEL)


@dataclass(frozen=True)
class TargetModel:
    """All faces; ``face`` numbers in tables are indices into ``faces``. ``families``: roles first, level ones last;
    ``parallel``: pairs of families that are parallel at an unknown distance; ``repeats_m``: the height after which the
    shape repeats, None where it does not."""

    faces: tuple[Face, ...]
    families: tuple[Family, ...]
    parallel: tuple[tuple[str, str], ...]
    water_level_m: float
    repeats_m: float | None

    @property
    def depth_m(self) -> float:
        """How far its lower end lies below the water."""
        return self.water_level_m - min(float(face.vertices_m[:, 2].min()) for face in self.faces)

    @property
    def half_period_m(self) -> float:
        """Half of what it repeats after; of what does not repeat half a metre, the scale on which poses differ."""
        return 0.5 if self.repeats_m is None else self.repeats_m / 2

    @property
    def width_m(self) -> float:
        """Of its front; without one, of its widest upright face."""
        front = self.front()
        if front is not None:
            return front.width_m
        return max((face.width_m for face in self.faces if not face.level), default=1.0)

    def front(self) -> Face | None:
        """The widest wet face that looks at the passing boat; None, where every face looks aside, up or down."""
        wet = [face for face in self.faces if face.seen != "dry" and face.vertices_m[:, 2].min() < self.water_level_m]
        ahead = [face for face in wet if not face.level and face.normal[0] < -0.9]
        return max(ahead, key=lambda face: face.width_m * self._depth(face), default=None)

    def _depth(self, face: Face) -> float:
        return float(min(face.vertices_m[:, 2].max(), self.water_level_m) - face.vertices_m[:, 2].min())

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner of the box round all faces."""
        corners = np.concatenate([face.vertices_m for face in self.faces])
        return corners.min(axis=0), corners.max(axis=0)

    def upright_grid(self, step_m: float, lowest_m: float) -> Array:
        """Points (n, 3) about ``step_m`` apart on the upright faces above ``lowest_m``."""
        upright = [face for face in self.faces if not face.level and face.vertices_m[:, 2].max() > lowest_m]
        return np.concatenate([np.empty((0, 3)), *(face.grid(step_m, lowest_m) for face in upright)])

    def mirrored(self) -> "TargetModel":
        """The same with left and right exchanged: y -> -y."""
        flip = np.array([1.0, -1.0, 1.0])
        faces = [replace(f, normal=f.normal * flip, vertices_m=f.vertices_m[::-1] * flip) for f in self.faces]
        return replace(self, faces=tuple(faces))

    @property
    def symmetric(self) -> bool:
        """Whether the mirrored target is the same."""
        return all(any(_alike(face, other) for other in self.faces) for face in self.mirrored().faces)

    def context(self) -> tuple[Array, Array]:
        """Triangles (vertices (v, 3), corner numbers (t, 3)) of the faces, each fanned from its first corner."""
        vertices: list[Array] = []
        triangles: list[tuple[int, int, int]] = []
        for face in self.faces:
            first = sum(map(len, vertices))
            vertices.append(face.vertices_m)
            triangles += [(first, first + k, first + k + 1) for k in range(1, len(face.vertices_m) - 1)]
        return np.concatenate(vertices), np.array(triangles)

    def face_of_triangle(self) -> NDArray[np.int64]:
        """Face number of each triangle of :meth:`context`."""
        return np.repeat(np.arange(len(self.faces)), [len(face.vertices_m) - 2 for face in self.faces])


def _alike(one: Face, other: Face) -> bool:
    """Same corners, wherever they begin."""
    away = np.linalg.norm(one.vertices_m[:, None] - other.vertices_m[None], axis=2)
    return bool(len(one.vertices_m) == len(other.vertices_m) and np.all(away.min(axis=1) < ALIKE_M))


def plane_of(vertices_m: Array) -> tuple[Array, float]:
    """Unit normal (3,) and distance of a polygon (k, 3), counter-clockwise about the normal.

    Newell's method: components of Σ v_i × v_{i+1}, twice the area of the polygon's shadow along each axis; right for
    corners slightly off a plane too. The distance is the mean of normal · v.
    """
    after = np.roll(vertices_m, -1, axis=0)
    shadows = np.sum((vertices_m - after)[:, [1, 2, 0]] * (vertices_m + after)[:, [2, 0, 1]], axis=0)
    normal = shadows / np.linalg.norm(shadows) + 0.0
    return normal, float(np.mean(vertices_m @ normal))


def names_in_order(families: Sequence[Family]) -> tuple[Family, ...]:
    """Roles first, level ones last, else as given."""

    def place(family: Family) -> int:
        return ROLES.index(family.name) if family.name in ROLES else len(ROLES) + family.level

    return tuple(sorted(families, key=place))
