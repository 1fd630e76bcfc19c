"""The faces of a target as arrays, for compiled loops, and what these ask of one face.

The formulas are those of :class:`pipeline.maths.target.face.Face`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import CUBE, FLAGS, LINE, MATRIX, NUMBERS, compiled, named

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
NO_REACH = (0.0, 0.0)


class FaceTables(NamedTuple):
    """The faces of a target. Where one thing has several of another, ``first_…`` has the number of the first of them.

    Planes: axis (a, 3) of parallel ones; first_plane (a + 1,); offset_m (p,) along the axis, ascending; first_of_plane
    (p + 1,), face_of_plane (k,): numbers of the faces in a plane.

    Faces: normal (f, 3); height_m (f, 2), lowest and highest; first_edge (f + 1,); of each edge inward (e, 3) and
    edge_offset_m (e,), as :attr:`~pipeline.maths.target.face.Face.inward_edges`, outer (e,); first_crease (f + 1,); of
    each crease crease (c, 3, 3), unit vectors across and along it and its middle, and half_m (c,) its length.
    """

    axis: Array
    first_plane: Integers
    offset_m: Array
    first_of_plane: Integers
    face_of_plane: Integers
    normal: Array
    height_m: Array
    first_edge: Integers
    inward: Array
    edge_offset_m: Array
    outer: Flags
    first_crease: Integers
    crease: Array
    half_m: Array


FACES = named(
    FaceTables, MATRIX, NUMBERS, LINE, NUMBERS, NUMBERS, MATRIX, MATRIX, NUMBERS, MATRIX, LINE, FLAGS, NUMBERS,
    CUBE, LINE,
)  # fmt: skip


@compiled()
def product(rows: Array, row: int, x: float, y: float, z: float) -> float:
    """Return the scalar product of one row of ``rows`` (n, 3) and a vector."""
    return rows[row, 0] * x + rows[row, 1] * y + rows[row, 2] * z


@compiled()
def nearest_plane(faces: FaceTables, axis: int, along_m: float) -> int:
    """Return the number of the plane nearest to a place along an axis; of two as near, the first."""
    plane = faces.first_plane[axis]
    while (
        plane + 1 < faces.first_plane[axis + 1]
        and (faces.offset_m[plane] + faces.offset_m[plane + 1]) / 2 < along_m
    ):
        plane += 1
    return plane


@compiled()
def inside(faces: FaceTables, face: int, point: Array, least_m: float) -> float:
    """Return the :func:`clearance` of a point without a footprint; -inf if it is less than ``least_m``."""
    x, y, z = point[0], point[1], point[2]
    smallest = np.inf
    for edge in range(faces.first_edge[face], faces.first_edge[face + 1]):
        smallest = min(smallest, product(faces.inward, edge, x, y, z) - faces.edge_offset_m[edge])
        if not smallest >= least_m:
            return -np.inf
    for crease in range(faces.first_crease[face], faces.first_crease[face + 1]):
        smallest = min(smallest, _off_crease(faces, crease, point, NO_REACH))
    return smallest if smallest >= least_m else -np.inf


@compiled()
def _off_crease(faces: FaceTables, crease: int, point: Array, reach_m: tuple[float, float]) -> float:
    """Return the distance of a point from a crease less the reach of its footprint across and along it."""
    axes = faces.crease[crease]
    x, y, z = point[0] - axes[2, 0], point[1] - axes[2, 1], point[2] - axes[2, 2]
    aside, beyond = abs(product(axes, 0, x, y, z)), abs(product(axes, 1, x, y, z)) - faces.half_m[crease]
    return max(aside - reach_m[0], beyond - reach_m[1])


@compiled()
def _reach(axis: Array, spread: Array, margin_m: float, corner_factor: float, outer: bool) -> float:
    """Return the extent of a footprint with its margin along a unit vector; ``spread``: as for :func:`clearance`."""
    extent, stray = 0.0, 0.0
    for half in range(2):
        extent += abs(product(spread, half, axis[0], axis[1], axis[2]))
    stray = abs(product(spread, 2, axis[0], axis[1], axis[2]))
    edge = extent + max(stray, margin_m)
    return edge if outer else max(edge, corner_factor * extent)


@compiled()
def clearance(
    faces: FaceTables, face: int, point: Array, spread: Array, margin_m: float, corner_factor: float
) -> float:
    """Return the smallest distance of a point in the plane from the face's edges and creases, + inside.

    ``spread`` (3, 3): its rows are the half axes of the footprint and the vector by which it may stray.
    """
    x, y, z = point[0], point[1], point[2]
    smallest = np.inf
    for edge in range(faces.first_edge[face], faces.first_edge[face + 1]):
        reach = _reach(faces.inward[edge], spread, margin_m, corner_factor, faces.outer[edge])
        smallest = min(smallest, product(faces.inward, edge, x, y, z) - faces.edge_offset_m[edge] - reach)
    for crease in range(faces.first_crease[face], faces.first_crease[face + 1]):
        axes = faces.crease[crease]
        across = _reach(axes[0], spread, margin_m, corner_factor, False)
        along = _reach(axes[1], spread, margin_m, corner_factor, False)
        smallest = min(smallest, _off_crease(faces, crease, point, (across, along)))
    return smallest
