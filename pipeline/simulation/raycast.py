"""What a ray meets: open3d finds the triangle (float32), its plane gives the range (float64)."""

import numpy as np
from numpy.typing import NDArray

from pipeline.simulation.mesh import Mesh
from pipeline.simulation.site import Floats


class RayCaster:
    """Rays against a mesh."""

    def __init__(self, mesh: Mesh) -> None:
        import open3d as o3d  # late: a second to import

        self.mesh = mesh
        self._tensor = o3d.core.Tensor.from_numpy
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(
            self._tensor(mesh.vertices_m.astype(np.float32)), self._tensor(np.ascontiguousarray(mesh.triangles))
        )
        self._none = self._scene.INVALID_ID

    def cast(self, origins_m: Floats, directions: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """Range (inf: nothing met) and number of the plane (-1) for (n, 3) origins and unit directions.

        range = (distance - normal · origin) / (normal · direction) in the plane of the triangle that is met first.
        """
        rays = np.concatenate([origins_m, directions], axis=1, dtype=np.float32)
        triangle = self._scene.cast_rays(self._tensor(rays))["primitive_ids"].numpy()
        met = triangle != self._none
        index = np.where(met, triangle, 0).astype(np.int64)
        normals = self.mesh.normals[index]
        toward = np.einsum("ij,ij->i", normals, directions)
        away = self.mesh.distances_m[index] - np.einsum("ij,ij->i", normals, origins_m)
        met &= np.abs(toward) > 1e-9
        ranges = np.divide(away, toward, out=np.full(len(rays), np.inf), where=met)
        return ranges, np.where(met, self.mesh.surfaces[index], -1)
