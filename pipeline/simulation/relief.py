"""How the target's faces as built stand off their planes: shifted, turned, bowed, uneven.

The mesh stays as designed. A ray that meets a face's plane is made longer or shorter until it meets the face as built.
Thus no cracks open between faces, and both sensors see the same faces.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipeline.config.target import Letters, Target
from pipeline.errors import ConfigError
from pipeline.simulation.mesh import POOL_NAMES, Mesh
from pipeline.simulation.random_streams import generator
from pipeline.simulation.scenario_surroundings import FaceFault, Surroundings
from pipeline.simulation.site import Floats

Bools = NDArray[np.bool_]
_STEPS = 3  # each leaves of the error the slope of the relief times the tangent of the incidence, some hundredths
_WAVES = 32  # that make up the unevenness
_LEVEL = 0.99  # vertical component of the normal of a level face
_SIDES = {"south": "P1", "north": "P3"}


def face_of_polygon(target: Target, polygon: str) -> str:
    """Return the name of a face (CONVENTIONS.md) from that of its polygon; empty if it is none of the target's faces.

    >>> letters = Letters.model_construct()
    >>> [face_of_polygon(letters, name) for name in ("wall_3", "south_2_2", "north_0_top", "south_2_0", "floor")]
    ['P2', 'P1-2', 'P3-0-top', '', '']
    """
    if not isinstance(target, Letters):
        return "" if polygon in POOL_NAMES else polygon
    if polygon == "wall_3":
        return "P2"
    side, *rest = polygon.split("_")
    if side not in _SIDES or rest[-1] not in ("2", "top", "bottom"):
        return ""
    return f"{_SIDES[side]}-{rest[0]}" + ("" if rest[-1] == "2" else f"-{rest[-1]}")


def _families(face: str) -> tuple[str, ...]:
    """Return the names under which a fault may mean a face: its own, and that of all faces alike it."""
    if face.endswith(("-top", "-bottom")):
        return face, "H"
    return face, face.split("-")[0]


class Relief:
    """Heights of the faces as built over their planes, along the outward normals."""

    def __init__(
        self, target: Target, surroundings: Surroundings, mesh: Mesh, seed: int
    ) -> None:
        self.mesh, self.water_level_m = mesh, target.water_level_m
        self.faces = np.array([face_of_polygon(target, polygon) for polygon in mesh.names])
        self._faults = [self._placed(fault, k) for k, fault in enumerate(surroundings.face_faults)]
        self._sigma_m = surroundings.unevenness_m
        random = generator(seed, "unevenness")
        waves = random.standard_normal((_WAVES, 3)) / surroundings.unevenness_length_m
        self._waves_1_m = waves.astype(np.float32)  # four times as fast; wrong by some 1e-5 of the unevenness
        self._phases = random.uniform(0, 2 * np.pi, _WAVES).astype(np.float32)

    def __bool__(self) -> bool:
        """Return whether any face stands off its plane."""
        return bool(self._faults) or self._sigma_m > 0

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
        if self._sigma_m:
            rows = np.flatnonzero(self.faces[triangles] != "")
            points, total = points_m[rows].astype(np.float32), np.zeros(len(rows), dtype=np.float32)
            for wave, phase in zip(self._waves_1_m, self._phases, strict=True):
                total += np.cos(points @ wave + phase)
            heights[rows] += self._sigma_m * np.sqrt(2 / _WAVES) * total
        return heights

    def _placed(self, fault: FaceFault, number: int) -> "_PlacedFault":
        known = {name for face in set(self.faces) - {""} for name in _families(str(face))}
        for name in fault.faces:
            if name not in known:
                raise ConfigError(
                    f"surroundings.face_faults[{number}].faces: the target has no face {name!r}; its faces are "
                    f"{', '.join(sorted(known))}"
                )
        chosen = np.array([bool(set(fault.faces) & set(_families(str(face)))) for face in self.faces])
        return _PlacedFault(fault, chosen, self._middles_m(fault, chosen), self.mesh, self.water_level_m)

    def _middles_m(self, fault: FaceFault, chosen: Bools) -> Mapping[str, Floats]:
        """Return the middle (3,) of the part of each face, by its polygon, and under "" the ends of all their heights.

        The middle is that of the corners; its height is halfway up the part.
        """
        lowest = self.water_level_m if fault.part == "dry" else -np.inf
        highest = self.water_level_m if fault.part == "wet" else np.inf
        middles, ends = {}, []
        for polygon in {name for name, own in zip(self.mesh.names, chosen, strict=True) if own}:
            own = [k for k, name in enumerate(self.mesh.names) if name == polygon]
            corners = self.mesh.vertices_m[np.unique(self.mesh.triangles[own])]
            low, high = np.clip([corners[:, 2].min(), corners[:, 2].max()], lowest, highest)
            middles[polygon] = np.array([*corners[:, :2].mean(axis=0), (low + high) / 2])
            ends += [low, high]
        return middles | {"": np.array([min(ends), max(ends)])}


class _PlacedFault:
    """A fault on the triangles of its faces."""

    def __init__(
        self, fault: FaceFault, triangles: Bools, middles_m: Mapping[str, Floats], mesh: Mesh, water_level_m: float
    ) -> None:
        self.fault, self.triangles, self.water_level_m = fault, triangles, water_level_m
        self.low_m, self.high_m = middles_m[""]
        self.middles_m = np.array([middles_m.get(name, np.zeros(3)) for name in mesh.names])
        normals = mesh.normals
        level = np.abs(normals[:, 2:]) > _LEVEL
        first = np.where(level, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        second = np.where(level, [0.0, 1.0, 0.0], np.cross([0.0, 0.0, 1.0], normals))
        turn = np.radians(fault.turn_deg)
        # a turn ω moves the point at v from the middle by ω × v, of which normal · (ω × v) = (normal × ω) · v rises
        self.slopes = np.cross(normals, turn[0] * first + turn[1] * second)

    def concerns(self, z_m: Floats) -> Bools:
        """Return which heights (n,) are in the faces' part."""
        wet = z_m < self.water_level_m
        return np.ones(len(z_m), dtype=bool) if self.fault.part == "whole" else wet == (self.fault.part == "wet")

    def heights_m(self, triangles: NDArray[np.int64], points_m: Floats) -> Floats:
        """Return the heights (n,) at points (n, 3) of some triangles (n,)."""
        slope = np.einsum("ij,ij->i", self.slopes[triangles], points_m - self.middles_m[triangles])
        up = np.clip((points_m[:, 2] - self.low_m) / max(self.high_m - self.low_m, 1e-9), 0.0, 1.0)
        return np.asarray(self.fault.shift_m + slope + self.fault.bow_m * 4 * up * (1 - up))
