"""The target as named planar polygons, built from the letters a, b, c, e in this one place.

Seen from above (the boat passes on the left, x < 0, y upward)::

        pool wall x = c
     .------------------.   y =  b/2 + c
      \\   P3 blocks      |
       \\                 |
        |  P2            |   y in [-b/2, b/2], x = 0: the centre wall's front face
       /                 |
      /   P1 blocks      |
     '------------------'   y = -b/2 - c

Nothing downstream knows a, b, c, e: it sees faces with a family, a plane and corners.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FAMILIES = ("P1", "P2", "P3", "H")
ROOT_HALF = float(np.sqrt(0.5))


@dataclass(frozen=True)
class Face:
    """A convex planar polygon: ``normal · x = distance_m`` on it, normal outward, corners (k, 3) counter-clockwise
    about the normal, in the target frame."""

    name: str
    family: str
    normal: Array
    distance_m: float
    vertices_m: Array

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
        edge a margin is kept besides, or what the footprint may stray (n, 3) across it where that is more.
        """
        inward, offsets = self.inward_edges()
        smallest = np.full(len(points_m), np.inf)
        for normal, offset in zip(inward, offsets, strict=True):
            distance = points_m @ normal - offset
            for spread in spreads_m:
                distance -= np.abs(spread @ normal)
            distance -= margin_m if stray_m is None else np.maximum(np.abs(stray_m @ normal), margin_m)
            np.minimum(smallest, distance, out=smallest)
        return smallest


@dataclass(frozen=True)
class TargetModel:
    """All faces; ``face`` numbers in tables are indices into ``faces``."""

    faces: tuple[Face, ...]
    water_level_m: float
    period_m: float  # height after which the blocks repeat

    def family_faces(self, family: str) -> list[int]:
        return [number for number, face in enumerate(self.faces) if face.family == family]

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner of the box round all faces."""
        corners = np.concatenate([face.vertices_m for face in self.faces])
        return corners.min(axis=0), corners.max(axis=0)

    def upright_grid(self, step_m: float, lowest_m: float) -> Array:
        """Points (n, 3) about ``step_m`` apart on the vertical faces above ``lowest_m``."""
        pieces = [np.empty((0, 3))]
        for face in self.faces:
            low, high = face.vertices_m[:, 2].min(), face.vertices_m[:, 2].max()
            if face.family == "H" or high <= lowest_m:
                continue
            ends = face.vertices_m[face.vertices_m[:, 2] == low]
            along = (np.arange(max(1, round(float(np.linalg.norm(ends[1] - ends[0])) / step_m))) + 0.5)[:, None]
            line = ends[0] + along / len(along) * (ends[1] - ends[0])
            up = np.arange(max(low, lowest_m) + step_m / 2, high, step_m)
            pieces.append(np.column_stack([np.repeat(line[:, :2], len(up), axis=0), np.tile(up, len(line))]))
        return np.concatenate(pieces)

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


def _face(
    name: str, family: str, normal: tuple[float, float, float], vertices: list[tuple[float, float, float]]
) -> Face:
    n, v = np.array(normal), np.array(vertices)
    if np.dot(np.cross(v[1] - v[0], v[2] - v[1]), n) < 0:
        v = v[::-1].copy()
    return Face(name, family, n, float(n @ v[0]), v)


def build_target(
    a: float,
    b: float,
    c: float,
    e: float,
    low_side: str = "south",
    blocks_per_side: int | None = None,
    first_base_m: float | None = None,
    stagger_m: float | None = None,
    water_level_m: float = 0.0,
) -> TargetModel:
    """The faces from the letters (metres), in the target frame; CONVENTIONS.md, "The target".

    A block on side s = ±1 (+1 is north, +y) is the prism of height e over the triangle (0, s b/2), (c, s b/2),
    (c, s (b/2 + c)). Its measured face runs at 45° from the wall's edge back to the pool's wall; its outward normal is
    (-1, s, 0)/√2. P1 are the faces on -y, P3 those on +y, P2 the wall's front. The low side's first base stands at
    ``first_base_m`` (default -a/2), the other side's ``stagger_m`` (default e) higher; then one block every 2 e.
    """
    count = int(np.floor(a / (2 * e) + 1e-9)) if blocks_per_side is None else blocks_per_side
    first = -a / 2 if first_base_m is None else first_base_m
    stagger = e if stagger_m is None else stagger_m
    wall = [(0.0, -b / 2, -a / 2), (0.0, b / 2, -a / 2), (0.0, b / 2, a / 2), (0.0, -b / 2, a / 2)]
    faces = [_face("P2", "P2", (-1.0, 0.0, 0.0), wall)]
    for family, side, word in (("P1", -1, "south"), ("P3", 1, "north")):
        base = first + (0.0 if word == low_side else stagger)
        near, inner, outer = (0.0, side * b / 2), (c, side * b / 2), (c, side * (b / 2 + c))
        for k in range(count):
            low, high = base + 2 * e * k, base + 2 * e * k + e
            name = f"{family}-{k}"
            slanted = [(*near, low), (*outer, low), (*outer, high), (*near, high)]
            faces.append(_face(name, family, (-ROOT_HALF, side * ROOT_HALF, 0.0), slanted))
            for word_, z, up in (("top", high, 1.0), ("bottom", low, -1.0)):
                faces.append(_face(f"{name}-{word_}", "H", (0.0, 0.0, up), [(*near, z), (*inner, z), (*outer, z)]))
    return TargetModel(tuple(faces), water_level_m, 2 * e)
