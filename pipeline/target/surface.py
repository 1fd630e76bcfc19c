"""Nearest points on a surface, and what it hides: the only importer of open3d beside the simulator's ray caster."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
THREADS = 2  # each point is searched by itself, so the result does not depend on the number


class ClosestSurface:
    """Nearest point of a target model's faces; calls return points (n, 3) m and face numbers (n,).

    Single precision (micrometres within tens of metres): for searching and labelling, never for a result.
    """

    def __init__(self, model: TargetModel) -> None:
        import open3d  # half a second: only where needed

        o3d: Any = open3d
        vertices, triangles = model.triangles()
        self._tensor = o3d.core.Tensor
        self._scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        self._scene.add_triangles(self._tensor(vertices.astype(np.float32)), self._tensor(triangles.astype(np.uint32)))
        self._face_of_triangle = model.face_of_triangle()
        self._model = model

    def __reduce__(self) -> tuple[type, tuple[TargetModel]]:
        """Return how workers make it: the scene is built anew there."""
        return ClosestSurface, (self._model,)

    def around(self, points_m: Array, reach_m: float) -> NDArray[np.bool_]:
        """Return which points (n, 3) m may be within reach of the surface: those in its box, enlarged by the reach."""
        low, high = self._model.bounds()
        return np.asarray(np.all((points_m >= low - reach_m) & (points_m <= high + reach_m), axis=1))

    def __call__(self, points_m: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return the nearest points (n, 3) m on the surface, and the numbers of their faces (n,)."""
        answer = self._scene.compute_closest_points(self._tensor(points_m.astype(np.float32)), nthreads=THREADS)
        triangles = answer["primitive_ids"].numpy().astype(np.int64)
        return answer["points"].numpy().astype(np.float64), self._face_of_triangle[triangles]

    def ranges(self, origins_m: Array, directions: Array) -> Array:
        """Return how far along unit rays (n, 3) the surface is, (n,) m; infinite where they miss it."""
        rays = np.hstack([origins_m, directions]).astype(np.float32)
        return np.asarray(self._cast(rays)["t_hit"].numpy(), dtype=np.float64)

    def first_met(self, origins_m: Array, directions: Array) -> NDArray[np.int64]:
        """Return the number of the face that each ray (n, 3) meets first; -1 where it meets none."""
        rays = np.hstack([origins_m, directions]).astype(np.float32)
        triangle = self._cast(rays)["primitive_ids"].numpy().astype(np.int64)
        missed = triangle >= len(self._face_of_triangle)
        return np.where(missed, -1, self._face_of_triangle[np.where(missed, 0, triangle)])

    def hides(self, origins_m: Array, points_m: Array, spare_m: float) -> NDArray[np.bool_]:
        """Return which points (n,) lie behind the surface.

        Parameters
        ----------
        origins_m
            Where each point is seen from (n, 3), target frame.
        points_m
            Points (n, 3), target frame.
        spare_m
            A point counts that lies farther than this behind the surface, along its ray.
        """
        away = points_m - origins_m
        rays = np.hstack([origins_m, away]).astype(np.float32)
        share = self._cast(rays)["t_hit"].numpy().astype(np.float64)
        return np.asarray((1 - share) * np.linalg.norm(away, axis=1) > spare_m)

    def _cast(self, rays: NDArray[np.float32]) -> Any:
        return self._scene.cast_rays(self._tensor(rays), nthreads=THREADS)
