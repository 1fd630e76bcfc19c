"""How the target's faces as built stand off their planes: shifted, turned, bowed, uneven, and fouled below the water.

The mesh stays as designed. A ray that meets a face's plane is made longer or shorter until it meets the face as built.
Thus no cracks open between faces, and both sensors see the same faces.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.target import Target
from pipeline.simulation.face_faults import PlacedFault, face_of_polygon
from pipeline.simulation.mesh import Mesh
from pipeline.simulation.random_streams import generator
from pipeline.simulation.scenario_surroundings import Surroundings
from pipeline.simulation.site import Floats

_STEPS = 3  # each leaves of the error the slope of the relief times the tangent of the incidence, some hundredths
_WAVES = 32  # that make up a field


class _Waves:
    """A random field of sigma 1, a sum of waves, alike over a length."""

    def __init__(self, seed: int, name: str, length_m: float) -> None:
        random = generator(seed, name)
        waves = random.standard_normal((_WAVES, 3)) / length_m
        self._waves_1_m = waves.astype(np.float32)  # four times as fast; wrong by some 1e-5 of the field
        self._phases = random.uniform(0, 2 * np.pi, _WAVES).astype(np.float32)

    def at(self, points_m: Floats) -> Floats:
        """Return the field (n,) at points (n, 3)."""
        points, total = points_m.astype(np.float32), np.zeros(len(points_m), dtype=np.float32)
        for wave, phase in zip(self._waves_1_m, self._phases, strict=True):
            total += np.cos(points @ wave + phase)
        return np.asarray(np.sqrt(2 / _WAVES) * total)


class Relief:
    """Heights of the faces as built over their planes, along the outward normals."""

    def __init__(self, target: Target, surroundings: Surroundings, mesh: Mesh, seed: int) -> None:
        self.mesh = mesh
        self.faces = np.array([face_of_polygon(target, polygon) for polygon in mesh.names])
        faults = enumerate(surroundings.face_faults)
        self._faults = [PlacedFault(fault, k, self.faces, mesh, target.water_level_m) for k, fault in faults]
        self._surroundings, self._water_level_m = surroundings, target.water_level_m
        self._uneven, self._fouling = (
            _Waves(seed, name, surroundings.unevenness_length_m) for name in ("unevenness", "fouling")
        )

    def __bool__(self) -> bool:
        """Return whether any face stands off its plane."""
        settings = self._surroundings
        return bool(self._faults) or max(settings.unevenness_m, settings.fouling_m, settings.fouling_sigma_m) > 0

    def ranges(self, ranges_m: Floats, triangles: NDArray[np.int64], origins_m: Floats, directions: Floats) -> Floats:
        """Return the ranges (n,) to the faces as built, from those to the planes of the triangles that the rays meet.

        A plane that is higher by s is met at r + s / (normal · direction). The height is that over the point met.
        """
        approach = np.einsum("ij,ij->i", self.mesh.normals[triangles], directions)
        result = ranges_m
        for _ in range(_STEPS):
            result = ranges_m + self.heights_m(triangles, origins_m + result[:, None] * directions) / approach
        return result

    def heights_m(self, triangles: NDArray[np.int64], points_m: Floats) -> Floats:
        """Return the heights (n,) of the faces as built above their planes at points (n, 3) of some triangles (n,)."""
        heights = np.zeros(len(points_m))
        for fault in self._faults:
            rows = np.flatnonzero(fault.triangles[triangles] & fault.concerns(points_m[:, 2]))
            heights[rows] += fault.heights_m(triangles[rows], points_m[rows])
        settings, on_target = self._surroundings, self.faces[triangles] != ""
        if settings.unevenness_m:
            rows = np.flatnonzero(on_target)
            heights[rows] += settings.unevenness_m * self._uneven.at(points_m[rows])
        if settings.fouling_m or settings.fouling_sigma_m:
            rows = np.flatnonzero(on_target & (points_m[:, 2] < self._water_level_m))
            grown_m = settings.fouling_m + settings.fouling_sigma_m * self._fouling.at(points_m[rows])
            heights[rows] += np.maximum(grown_m, 0.0)
        return heights
