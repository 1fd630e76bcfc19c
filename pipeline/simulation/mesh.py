"""Target and pool as planar polygons and as triangles, built from the letters a, b, c, e or from a list of faces.

With letters the origin is the centre of the wall's front face; x runs into the wall, y along it ("north" is +y), z up.
A block on side s = ±1 is the prism over (0, s b/2), (c, s b/2), (c, s(b/2 + c)), e high.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.config.target import Faces, Letters, Target
from pipeline.simulation.scenario_surroundings import Surroundings
from pipeline.simulation.site import Floats

_SIDES = {"south": -1.0, "north": 1.0}
_BEHIND_M = 30.0  # the floor reaches this far toward the vessel
POOL_NAMES = ("back_wall", "floor")  # polygons that are not the target's
BOX = "/"  # first letter of the names of boxes' polygons, which no face's name has


@dataclass(frozen=True)
class FacePolygon:
    """A planar face."""

    name: str
    vertices_m: Floats  # (k, 3), seen from outside counter-clockwise


def block_bases_m(target: Letters, side: str) -> list[float]:
    """Return heights of blocks' bases: the low side's first at first_base_m, the other side's stagger_m above it."""
    first = -target.a / 2 if target.first_base_m is None else target.first_base_m
    stagger = target.e if target.stagger_m is None else target.stagger_m
    count = int(target.a / (2 * target.e) + 1e-9) if target.blocks_per_side is None else target.blocks_per_side
    lowest = first if side == target.low_side else first + stagger
    return [lowest + 2 * target.e * k for k in range(count)]


def prism(name: str, corners: Floats, low_m: float, high_m: float, caps: bool = True) -> list[FacePolygon]:
    """Return side faces, top and bottom of a prism.

    Parameters
    ----------
    name : str
        First part of the faces' names.
    corners : (k, 2) array
        Footprint, counter-clockwise seen from above, m.
    low_m, high_m : float
        Heights of bottom and top.
    caps : bool
        Whether top and bottom are returned too.
    """
    def at(height_m: float) -> Floats:
        return np.column_stack([corners, np.full(len(corners), height_m)])

    low, high = at(low_m), at(high_m)
    after = np.roll(np.arange(len(corners)), -1)
    faces = [FacePolygon(f"{name}_{k}", np.array([low[k], low[n], high[n], high[k]])) for k, n in enumerate(after)]
    return faces + ([FacePolygon(f"{name}_top", high), FacePolygon(f"{name}_bottom", low[::-1])] if caps else [])


def target_polygons(target: Target) -> list[FacePolygon]:
    """Return the listed faces; or, with letters, the blocks and the wall (a box back to the pool's wall)."""
    if isinstance(target, Faces):
        return [FacePolygon(name, np.array(face.corners, dtype=np.float64)) for name, face in target.faces.items()]
    a, half, c, e = target.a, target.b / 2, target.c, target.e
    polygons = prism("wall", np.array([[0, -half], [c, -half], [c, half], [0, half]]), -a / 2, a / 2)
    for side, s in _SIDES.items():
        footprint = np.array([[0, s * half], [c, s * half], [c, s * (half + c)]])
        footprint = footprint if s > 0 else footprint[::-1]
        for k, base in enumerate(block_bases_m(target, side)):
            polygons += prism(f"{side}_{k}", footprint, base, base + e)
    return polygons


def target_extents(target: Target) -> Floats:
    """Return least and greatest x, y, z of the target's faces, (3, 2), m."""
    if isinstance(target, Letters):
        half = target.b / 2 + target.c
        return np.array([[0.0, target.c], [-half, half], [-target.a / 2, target.a / 2]])
    corners = np.concatenate([polygon.vertices_m for polygon in target_polygons(target)])
    return np.stack([corners.min(axis=0), corners.max(axis=0)], axis=1)


def pool_polygons(target: Target, surroundings: Surroundings) -> list[FacePolygon]:
    """Return the back wall (with letters the plane x = c), if there is one, and the floor."""
    (_, c), _, (low, high) = target_extents(target)
    reach = surroundings.half_length_m
    floor, top = low - surroundings.floor_gap_m, high + surroundings.wall_above_m
    wall = np.array([[c, -reach, floor], [c, -reach, top], [c, reach, top], [c, reach, floor]])
    ground = np.array([[-_BEHIND_M, -reach, floor], [c, -reach, floor], [c, reach, floor], [-_BEHIND_M, reach, floor]])
    back_wall, the_floor = POOL_NAMES
    return [FacePolygon(back_wall, wall)] * surroundings.back_wall + [FacePolygon(the_floor, ground)]


def box_polygons(surroundings: Surroundings) -> list[FacePolygon]:
    """Return the faces of the boxes before the target."""
    polygons = []
    for box in surroundings.boxes:
        (x0, y0, low), (x1, y1, high) = box.low_m, box.high_m
        corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        middle, turn = corners.mean(axis=0), Rotation.from_euler("Z", box.turn_deg, degrees=True).as_matrix()[:2, :2]
        polygons += prism(f"{BOX}{box.name}", (corners - middle) @ turn.T + middle, low, high)
    return polygons


def corner_lines(target: Target) -> Floats:
    """Return the vertical inner corners at the back wall, (n, 4): x, y, lowest z, highest z; none without letters.

    Slanted faces meet the back wall at y = ±(b/2 + c). In the gaps between blocks the wall's sides meet it at y = ±b/2.
    """
    if isinstance(target, Faces):
        return np.empty((0, 4))
    lines = []
    for side, s in _SIDES.items():
        bases = block_bases_m(target, side)
        lines += [(target.c, s * (target.b / 2 + target.c), base, base + target.e) for base in bases]
        lines += [(target.c, s * target.b / 2, base + target.e, base + 2 * target.e) for base in bases[:-1]]
    return np.array(lines)


def corner_segments(target: Target) -> Floats:
    """Return all inner corners of letters' target as ends of straight lines, (n, 2, 3); none without letters.

    Beside the vertical ones, a block's top and bottom meet the back wall along y, and the wall's side along x. No other
    wall is there where another block of the same side, or the floor, is: the blocks stand apart.
    """
    lines = [[(x, y, low), (x, y, high)] for x, y, low, high in corner_lines(target).tolist()]
    if isinstance(target, Letters):
        half, c = target.b / 2, target.c
        for side, s in _SIDES.items():
            for base in block_bases_m(target, side):
                for z in (base, base + target.e):
                    lines.append([(c, s * half, z), (c, s * (half + c), z)])
                    lines.append([(0.0, s * half, z), (c, s * half, z)])
    return np.array(lines).reshape(-1, 2, 3)


@dataclass(frozen=True)
class Mesh:
    """Triangles, each with the plane it lies in: normal · x = distance."""

    vertices_m: Floats  # (v, 3)
    triangles: NDArray[np.uint32]  # (t, 3)
    normals: Floats  # (t, 3), outward
    distances_m: Floats  # (t,)
    surfaces: NDArray[np.int64]  # (t,) number of the plane: coplanar faces share one
    names: tuple[str, ...]  # (t,) polygon of each triangle


def build_mesh(target: Target, surroundings: Surroundings) -> Mesh:
    """Return the triangles of target, pool and boxes, without the water."""
    tilt = Rotation.from_euler("XY", surroundings.tilt_deg, degrees=True)
    polygons = [FacePolygon(p.name, tilt.apply(p.vertices_m)) for p in target_polygons(target)]
    polygons += pool_polygons(target, surroundings) + box_polygons(surroundings)
    triangles: list[tuple[int, int, int]] = []
    planes: list[Floats] = []
    names: list[str] = []
    first = 0
    for polygon in polygons:
        corners = polygon.vertices_m
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        for k in range(1, len(corners) - 1):
            triangles.append((first, first + k, first + k + 1))
            planes.append(np.append(normal, normal @ corners[0]))
            names.append(polygon.name)
        first += len(corners)
    table = np.array(planes)
    _, surfaces = np.unique(np.round(table, 9) + 0.0, axis=0, return_inverse=True)
    return Mesh(
        vertices_m=np.concatenate([p.vertices_m for p in polygons]),
        triangles=np.array(triangles, dtype=np.uint32),
        normals=table[:, :3],
        distances_m=table[:, 3],
        surfaces=surfaces.astype(np.int64).ravel(),
        names=tuple(names),
    )
