"""Faults of single faces, placed on the triangles of the mesh: shifts, turns and bows of a face or of its wet part."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.target import Letters, Target
from pipeline.errors import ConfigError
from pipeline.simulation.mesh import BOX, POOL_NAMES, Mesh
from pipeline.simulation.scenario_surroundings import FaceFault
from pipeline.simulation.site import Floats

_LEVEL = 0.99  # vertical component of the normal of a level face
_SIDES = {"south": "P1", "north": "P3"}


def face_of_polygon(target: Target, polygon: str) -> str:
    """Return the name of a face (CONVENTIONS.md) from that of its polygon; empty if it is none of the target's faces.

    >>> letters = Letters.model_construct()
    >>> [face_of_polygon(letters, name) for name in ("wall_3", "south_2_2", "north_0_top", "south_2_0", "floor")]
    ['P2', 'P1-2', 'P3-0-top', '', '']
    """
    if not isinstance(target, Letters):
        return "" if polygon in POOL_NAMES or polygon.startswith(BOX) else polygon
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


class PlacedFault:
    """A fault on the triangles of its faces."""

    def __init__(
        self, fault: FaceFault, number: int, faces: NDArray[np.str_], mesh: Mesh, water_level_m: float
    ) -> None:
        self.fault, self.mesh, self.water_level_m = fault, mesh, water_level_m
        self.parts = (fault.part != "wet", fault.part != "dry")  # whether it is on the dry part, and on the wet one
        known = {name for face in set(faces) - {""} for name in _families(str(face))}
        for name in fault.faces:
            if name not in known:
                raise ConfigError(
                    f"surroundings.face_faults[{number}].faces: the target has no face {name!r}; its faces are "
                    f"{', '.join(sorted(known))}"
                )
        concerned = [bool(set(fault.faces) & set(_families(str(face)))) for face in faces]
        self.triangles: NDArray[np.bool_] = np.array(concerned)
        self.middles_m, self.low_m, self.high_m = self._middles_m()
        level = np.abs(mesh.normals[:, 2:]) > _LEVEL
        first = np.where(level, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        second = np.where(level, [0.0, 1.0, 0.0], np.cross([0.0, 0.0, 1.0], mesh.normals))
        turn = np.radians(fault.turn_deg)
        # a turn ω moves the point at v from the middle by ω × v, of which normal · (ω × v) = (normal × ω) · v rises
        self.slopes = np.cross(mesh.normals, turn[0] * first + turn[1] * second)

    def _middles_m(self) -> tuple[Floats, float, float]:
        """Return the middle (t, 3) of each triangle's face, or of its part, and the ends of all faces' heights.

        The middle is that of the corners; its height is halfway up the part.
        """
        mesh, part = self.mesh, self.fault.part
        lowest = self.water_level_m if part == "dry" else -np.inf
        highest = self.water_level_m if part == "wet" else np.inf
        names = np.array(mesh.names)
        middles, ends = np.zeros((len(names), 3)), []
        for polygon in sorted(set(names[self.triangles])):
            own = names == polygon
            corners = mesh.vertices_m[np.unique(mesh.triangles[own])]
            low, high = np.clip([corners[:, 2].min(), corners[:, 2].max()], lowest, highest)
            middles[own] = [*corners[:, :2].mean(axis=0), (low + high) / 2]
            ends += [float(low), float(high)]
        return middles, min(ends), max(ends)

    def plane(self) -> Floats:
        """Return the gradient of the height by place and the height at the frame's origin, (t, 4), without the bow."""
        at_origin = self.fault.shift_m - np.einsum("ij,ij->i", self.slopes, self.middles_m)
        return np.where(self.triangles[:, None], np.column_stack([self.slopes, at_origin]), 0.0)

    def bows_m(self, z_m: Floats) -> Floats:
        """Return how far the bow stands out at heights (n,) of its faces."""
        up = np.clip((z_m - self.low_m) / max(self.high_m - self.low_m, 1e-9), 0.0, 1.0)
        return np.asarray(self.fault.bow_m * 4 * up * (1 - up))
