"""Nearest points on a target's surface, and the rays that meet it.

Only this module and the simulator's ray caster import open3d.
"""

import sys
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
THREADS = 2  # points are independent of each other, so the number does not change the result


def _open3d() -> Any:
    """Return open3d, without the pages for a browser that its import brings: they take more than half of its time."""
    pages = "open3d.visualization.draw_plotly"
    if "open3d" in sys.modules or pages in sys.modules:
        import open3d

        return open3d
    stand_in = ModuleType(pages)
    vars(stand_in).update(dict.fromkeys(("get_plotly_fig", "draw_plotly", "draw_plotly_server")))
    sys.modules[pages] = stand_in
    try:
        import open3d
    finally:
        del sys.modules[pages]
    return open3d


class ClosestSurface:
    """Finder of the nearest points on a target model's faces. A call returns points (n, 3) m and face numbers (n,).

    It works in single precision (micrometres within tens of metres). It serves searches and labels, never a result.
    """

    def __init__(self, model: TargetModel) -> None:
        o3d = _open3d()  # late: it takes half a second
        vertices, triangles = model.triangles()
        self._tensor = o3d.core.Tensor
        self._scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        self._scene.add_triangles(self._tensor(vertices.astype(np.float32)), self._tensor(triangles.astype(np.uint32)))
        self._face_of_triangle = model.face_of_triangle()
        self._model = model

    def __reduce__(self) -> tuple[type, tuple[TargetModel]]:
        """Return the constructor and its argument for pickle: a worker builds the scene anew."""
        return ClosestSurface, (self._model,)

    def around(self, points_m: Array, reach_m: float) -> NDArray[np.bool_]:
        """Return a mask (...): true for points (..., 3) m in the surface's box, enlarged by ``reach_m`` all round."""
        low, high = self._model.bounds()
        return np.asarray(np.all((points_m >= low - reach_m) & (points_m <= high + reach_m), axis=-1))

    def __call__(self, points_m: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return the nearest points (n, 3) m on the surface, and the numbers of their faces (n,)."""
        answer = self._scene.compute_closest_points(self._tensor(points_m.astype(np.float32)), nthreads=THREADS)
        triangles = answer["primitive_ids"].numpy().astype(np.int64)
        return answer["points"].numpy().astype(np.float64), self._face_of_triangle[triangles]

    def ranges(self, origins_m: Array, directions: Array) -> Array:
        """Return the distances (n,) m to the surface along unit rays (n, 3); infinite for rays that miss it."""
        rays = np.hstack([origins_m, directions]).astype(np.float32)
        return np.asarray(self._cast(rays)["t_hit"].numpy(), dtype=np.float64)

    def first_met(self, origins_m: Array, directions: Array) -> NDArray[np.int64]:
        """Return the number (n,) of the face that each ray (n, 3) meets first; -1 for rays that meet none."""
        rays = np.hstack([origins_m, directions]).astype(np.float32)
        triangle = self._cast(rays)["primitive_ids"].numpy().astype(np.int64)
        missed = triangle >= len(self._face_of_triangle)
        return np.where(missed, -1, self._face_of_triangle[np.where(missed, 0, triangle)])

    def hides(self, origins_m: Array, points_m: Array, spare_m: float) -> NDArray[np.bool_]:
        """Return a mask (n,): true for points behind the surface.

        Parameters
        ----------
        origins_m
            Positions (n, 3) m of the sensor, target frame.
        points_m
            Points (n, 3) m, target frame.
        spare_m
            A point is behind the surface if it lies farther than this (m) behind it, along its ray.
        """
        away = points_m - origins_m
        rays = np.hstack([origins_m, away]).astype(np.float32)
        share = self._cast(rays)["t_hit"].numpy().astype(np.float64)
        return np.asarray((1 - share) * np.linalg.norm(away, axis=1) > spare_m)

    def _cast(self, rays: NDArray[np.float32]) -> Any:
        return self._scene.cast_rays(self._tensor(rays), nthreads=THREADS)
