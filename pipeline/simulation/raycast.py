"""Ray casting: open3d finds the triangle (float32), and the range follows from the triangle's plane (float64)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.simulation.mesh import Mesh
from pipeline.simulation.relief import Relief
from pipeline.simulation.site import Floats


class RayCaster:
    """Intersection of rays with a mesh."""

    def __init__(self, mesh: Mesh, relief: Relief | None = None) -> None:
        import open3d as o3d  # late: a second to import

        self.mesh, self._relief = mesh, relief
        self._tensor = o3d.core.Tensor.from_numpy
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(
            self._tensor(mesh.vertices_m.astype(np.float32)), self._tensor(np.ascontiguousarray(mesh.triangles))
        )
        self._no_triangle = self._scene.INVALID_ID

    def cast(self, origins_m: Floats, directions: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """Return the range at which each ray first meets the mesh, and the plane that it meets.

        range = (distance - normal · origin) / (normal · direction) with the plane of the triangle that is met first.

        Parameters
        ----------
        origins_m : (n, 3) array
            Target frame, m.
        directions : (n, 3) array
            Unit vectors, target frame.

        Returns
        -------
        ranges : (n,) array
            m; inf: the ray meets nothing.
        surfaces : (n,) array
            Number of the plane; -1: the ray meets nothing.
        """
        _, triangles = self.first_met(origins_m, directions)
        ranges = self.ranges(triangles, origins_m, directions)
        return ranges, np.where(np.isfinite(ranges), self.mesh.surfaces[triangles], -1)

    def normals(self, origins_m: Floats, directions: Floats) -> Floats:
        """Return the outward normal (n, 3), as designed, of the face that each ray meets first; zero if it meets none.

        Parameters
        ----------
        origins_m : (n, 3) array
            Target frame, m.
        directions : (n, 3) array
            Unit vectors, target frame.
        """
        _, triangles = self.first_met(origins_m, directions)
        return np.where((triangles >= 0)[:, None], self.mesh.normals[triangles], 0.0)

    def first_met(self, origins_m: Floats, directions: Floats) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return how far (n,) m each ray goes until it meets the mesh as designed, and the triangle (n,) that it meets.

        The way is right to some micrometres over the cosine of incidence. A ray that meets nothing: inf and -1.
        Parameters are those of :meth:`cast`.
        """
        rays = np.concatenate([origins_m, directions], axis=1, dtype=np.float32)
        met = self._scene.cast_rays(self._tensor(rays))
        triangles = met["primitive_ids"].numpy()
        hit = triangles != self._no_triangle
        return np.where(hit, met["t_hit"].numpy(), np.float32(np.inf)), np.where(hit, triangles.astype(np.int64), -1)

    def ranges(self, triangles: NDArray[np.int64], origins_m: Floats, directions: Floats) -> Floats:
        """Return the ranges (n,) to the faces as built, by the triangles (n,) that the rays meet; inf for -1.

        The other parameters are those of :meth:`cast`.
        """
        normals = self.mesh.normals[triangles]
        approach = np.einsum("ij,ij->i", normals, directions)
        heights = self.mesh.distances_m[triangles] - np.einsum("ij,ij->i", normals, origins_m)
        hit = (triangles >= 0) & (np.abs(approach) > 1e-9)
        ranges: Floats = np.divide(heights, approach, out=np.full(len(hit), np.inf), where=hit)
        if self._relief:
            rows = np.flatnonzero(hit)
            ranges[rows] = self._relief.ranges(ranges[rows], triangles[rows], origins_m[rows], directions[rows])
        return ranges


@dataclass(frozen=True)
class Pool:
    """Surfaces that the sensors' rays may meet, in the target frame."""

    caster: RayCaster
    water_level_m: float
    corner_lines: Floats  # (n, 4): x, y, lowest z, highest z of inner corners
    corner_segments: Floats  # (n, 2, 3): ends of all inner corners
