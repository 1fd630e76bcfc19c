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
_CELLS = 128  # of a field's lattice, in each direction
_CELLS_OF_LENGTH = 4  # in the length over which it is alike


class _Field:
    """A random field of sigma 1 with the correlation exp(-d² / 2 length²): white noise on a lattice, smoothed.

    The lattice is turned at random, and repeats after 32 lengths along its own axes. Its mean is zero: otherwise all
    repetitions would share one. Linear interpolation takes some of the variance: with the correlation ρ of neighbours
    (2 + ρ) / 3 is left by axis.
    """

    def __init__(self, seed: int, name: str, length_m: float) -> None:
        from scipy.ndimage import gaussian_filter
        from scipy.spatial.transform import Rotation

        random = generator(seed, name)
        turn = Rotation.random(random_state=random).as_matrix()
        self._cells_1_m = turn.T * (_CELLS_OF_LENGTH / length_m)
        white = random.standard_normal((_CELLS, _CELLS, _CELLS), dtype=np.float32)
        smooth = gaussian_filter(white, _CELLS_OF_LENGTH / np.sqrt(2), mode="wrap")
        left = (2 + np.exp(-0.5 / _CELLS_OF_LENGTH**2)) / 3
        self._lattice = (smooth - smooth.mean()) / (smooth.std() * left**1.5)

    def at(self, points_m: Floats) -> Floats:
        """Return the field (n,) at points (n, 3)."""
        from scipy.ndimage import map_coordinates

        cells = (points_m @ self._cells_1_m).T
        return np.asarray(map_coordinates(self._lattice, cells, np.float64, order=1, mode="grid-wrap"))


class Relief:
    """Heights of the faces as built over their planes, along the outward normals."""

    def __init__(self, target: Target, surroundings: Surroundings, mesh: Mesh, seed: int) -> None:
        self.mesh = mesh
        self.faces = np.array([face_of_polygon(target, polygon) for polygon in mesh.names])
        faults = enumerate(surroundings.face_faults)
        placed = [PlacedFault(fault, k, self.faces, mesh, target.water_level_m) for k, fault in faults]
        self._bowed = [fault for fault in placed if fault.fault.bow_m]
        of_part = [fault.plane() * np.array(fault.parts)[:, None, None] for fault in placed]
        self._plane = sum(of_part, start=np.zeros((2, len(mesh.triangles), 4)))  # dry and wet: gradient, height at zero
        self._surroundings, self._water_level_m = surroundings, target.water_level_m
        fields = {"unevenness": surroundings.unevenness_m, "fouling": surroundings.fouling_sigma_m}
        self._fields = {
            name: _Field(seed, name, surroundings.unevenness_length_m) for name, sigma_m in fields.items() if sigma_m
        }

    def __bool__(self) -> bool:
        """Return whether any face stands off its plane."""
        settings = self._surroundings
        added_m = (settings.unevenness_m, settings.fouling_m, settings.fouling_sigma_m)
        return bool(self._plane.any() or self._bowed or max(added_m) > 0)

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
        wet = points_m[:, 2] < self._water_level_m
        plane = self._plane[wet.astype(np.int64), triangles]
        heights: Floats = np.einsum("ij,ij->i", plane[:, :3], points_m) + plane[:, 3]
        for fault in self._bowed:
            rows = np.flatnonzero(fault.triangles[triangles] & np.where(wet, fault.parts[1], fault.parts[0]))
            heights[rows] += fault.bows_m(points_m[rows, 2])
        settings, on_target = self._surroundings, self.faces[triangles] != ""
        if settings.unevenness_m:
            rows = np.flatnonzero(on_target)
            heights[rows] += settings.unevenness_m * self._fields["unevenness"].at(points_m[rows])
        if settings.fouling_m or settings.fouling_sigma_m:
            rows = np.flatnonzero(on_target & wet)
            grown_m = np.full(len(rows), settings.fouling_m)
            if settings.fouling_sigma_m:
                grown_m += settings.fouling_sigma_m * self._fields["fouling"].at(points_m[rows])
            heights[rows] += np.maximum(grown_m, 0.0)
        return heights
