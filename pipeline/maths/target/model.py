"""The target: named planar polygons, and the relations between their planes.

Parallel faces at known distances form a *family*. A family has one plane of unknown place and direction. Each of its
faces stands off this plane by a known *offset* along the family's normal (zero for all faces if they lie in one plane).
The dry and the wet faces of a family share its plane; the calibration rests on that. A family is *level* if its plane
is horizontal. Then its normal points up and offsets are heights.

Nothing downstream knows the kind of the target: other modules use only faces with a family, a plane and corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.kernels.faces import FaceTables
from pipeline.maths.target.face import HORIZONTAL_COSINE, Face
from pipeline.maths.target.face_tables import face_tables

Array = NDArray[np.float64]

LEAST_DEPTH_M = 0.1
SLOPING_COSINE = 0.3  # of the normal's z: a face that leans by more than 17°
ROLES = ("P1", "P2", "P3")  # roles of families in the patent's steps


@dataclass(frozen=True)
class Family:
    """Parallel faces at known distances. The family's plane is ``normal · x = distance_m`` by design.

    ``faces`` are the faces' numbers; ``one_plane``: no face stands off the plane.
    """

    name: str
    normal: Array
    distance_m: float
    faces: tuple[int, ...]
    one_plane: bool

    @property
    def level(self) -> bool:
        """Return whether the faces are horizontal."""
        return bool(self.normal[2] > HORIZONTAL_COSINE)

    @property
    def sloping(self) -> bool:
        """Return whether the faces lean so far from upright, without being level, that they tell a height."""
        return bool(SLOPING_COSINE < abs(self.normal[2]) <= HORIZONTAL_COSINE)


@dataclass(frozen=True)
class TargetModel:
    """The target by design.

    Parameters
    ----------
    faces
        All faces; ``face`` numbers in tables are indices into them.
    families
        All families: those with a role first, level ones last.
    parallel
        Pairs of families that are parallel at an unknown distance.
    water_level_m
        Height of the water, target frame.
    repeats_m
        Height after which the shape repeats; None if it does not.
    found
        Whether the corners come from laser points of the place itself: then left and right are not in question.
    """

    faces: tuple[Face, ...]
    families: tuple[Family, ...]
    parallel: tuple[tuple[str, str], ...]
    water_level_m: float
    repeats_m: float | None
    found: bool = False

    @property
    def wet_heights_m(self) -> tuple[float, float]:
        """Z of the target's lower end and of the water's surface; a target out of the water has a depth of 0.1 m."""
        return self.water_level_m - max(self.depth_m, LEAST_DEPTH_M), self.water_level_m

    @property
    def depth_m(self) -> float:
        """Return the depth of the target's lower end below the water."""
        return self.water_level_m - min(float(face.vertices_m[:, 2].min()) for face in self.faces)

    @property
    def half_period_m(self) -> float:
        """Return half of the height after which the shape repeats, or 0.5 m: the scale on which poses differ."""
        return 0.5 if self.repeats_m is None else self.repeats_m / 2

    @property
    def width_m(self) -> float:
        """Return the width of the front; without a front, of the widest upright face."""
        front = self.front()
        if front is not None:
            return front.width_m
        return max((face.width_m for face in self.faces if not face.level), default=1.0)

    def front(self) -> Face | None:
        """Return the face toward the passing boat with the largest width times depth under water; None without one."""
        wet = [face for face in self.faces if face.seen != "dry" and face.vertices_m[:, 2].min() < self.water_level_m]
        ahead = [face for face in wet if not face.level and face.normal[0] < -0.9]
        return max(ahead, key=lambda face: face.width_m * self._depth(face), default=None)

    @property
    def tied_families(self) -> frozenset[str]:
        """Return the names of the families whose plane both sensors may see: they tie the sonar to the laser."""
        seen = {family.name: {self.faces[number].seen for number in family.faces} for family in self.families}
        return frozenset(name for name, kinds in seen.items() if "both" in kinds or {"dry", "wet"} <= kinds)

    def _depth(self, face: Face) -> float:
        return float(min(face.vertices_m[:, 2].max(), self.water_level_m) - face.vertices_m[:, 2].min())

    def tables(self, seen: str) -> FaceTables:
        """Return the faces as arrays, with the planes of those that are seen: "dry", "wet" or "both"."""
        return self._tables[seen]

    @cached_property
    def _tables(self) -> dict[str, FaceTables]:
        return {seen: face_tables(self.faces, seen) for seen in ("dry", "wet", "both")}

    def bounds(self) -> tuple[Array, Array]:
        """Return the lowest and the highest corner (3,) of the box round all faces."""
        corners = np.concatenate([face.vertices_m for face in self.faces])
        return corners.min(axis=0), corners.max(axis=0)

    def mirrored(self) -> "TargetModel":
        """Return the target with left and right exchanged: y -> -y."""
        return replace(self, faces=tuple(face.mirrored() for face in self.faces))

    @property
    def symmetric(self) -> bool:
        """Return whether the mirrored target is the same."""
        return all(any(face.same_corners(other) for other in self.faces) for face in self.mirrored().faces)

    @property
    def mirror_images(self) -> tuple["TargetModel", ...]:
        """Return the mirrored target, which may be the true one; none if it is the same, or if the target was found."""
        return () if self.found or self.symmetric else (self.mirrored(),)

    def triangles(self) -> tuple[Array, Array]:
        """Return vertices (v, 3) and corner numbers (t, 3) of triangles; those of a face share its first corner."""
        vertices: list[Array] = []
        triangles: list[tuple[int, int, int]] = []
        for face in self.faces:
            first = sum(map(len, vertices))
            vertices.append(face.vertices_m)
            triangles += [(first, first + k, first + k + 1) for k in range(1, len(face.vertices_m) - 1)]
        return np.concatenate(vertices), np.array(triangles)

    def face_of_triangle(self) -> NDArray[np.int64]:
        """Return the face number of each triangle of :meth:`triangles`."""
        return np.repeat(np.arange(len(self.faces)), [len(face.vertices_m) - 2 for face in self.faces])


def names_in_order(families: Sequence[Family]) -> tuple[Family, ...]:
    """Return the families with a role first, then the others in their order, level ones last."""

    def place(family: Family) -> int:
        return ROLES.index(family.name) if family.name in ROLES else len(ROLES) + family.level

    return tuple(sorted(families, key=place))


@dataclass(frozen=True)
class TargetFrame:
    """Rotation R_target_from_pool (3, 3), and the origin of the target in the pool frame (3,) m."""

    R_target_from_pool: Array
    origin_pool_m: Array

    @property
    def shift_m(self) -> Array:
        """Return the origin of the pool in the target frame, (3,) m."""
        return -self.R_target_from_pool @ self.origin_pool_m

    def points_from_pool(self, points_pool_m: Array) -> Array:
        """Return the target coordinates (n, 3) m of points (n, 3) m in the pool frame."""
        return np.asarray((self.R_target_from_pool @ (points_pool_m - self.origin_pool_m).T).T)

    def points_to_pool(self, points_target_m: Array) -> Array:
        """Return the pool coordinates (n, 3) m of points (n, 3) m in the target frame."""
        return np.asarray((self.R_target_from_pool.T @ points_target_m.T).T + self.origin_pool_m)

    def trajectory_from_pool(self, trajectory: Trajectory) -> Trajectory:
        """Return a trajectory in the target frame, from one in the pool frame."""
        return trajectory.transformed(self.R_target_from_pool, self.shift_m)
