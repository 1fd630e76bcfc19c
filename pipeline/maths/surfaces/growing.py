"""Planes by region growing: from the flattest voxels outwards, as long as the points lie on the region's plane.

A voxel is a *seed* if its own points lie on a plane: if the smallest eigenvalue of their covariance, the square of
their thickness, is small. From the thinnest seed a region grows: of the voxels that touch it those join whose points
lie on its plane, by their mean square distance from it. Then the plane is fitted again to all its points. So a voxel at
an edge, in which two walls meet, joins neither, and a voxel of few points, which has no plane of its own, joins by its
distance. When nothing more joins, the region grows once more, with the last plane from the beginning: the first voxels
joined a plane that was known badly. (Region growing on normals: Rabbani et al. 2006, "Segmentation of point clouds
using smoothness constraint". Here planes alone are wanted, so the distance decides, not the turn from voxel to voxel,
by which a bent wall would be followed for ever.)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.surfaces.voxels import Voxels

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
FEWEST = 6  # points of a seed
GROWN = 1.2  # a region that has grown by this factor gets a new plane
ELONGATED = 0.05  # smallest ratio of a seed's second to its first eigenvalue: a line of points has no plane


@dataclass(frozen=True)
class GrowthLimits:
    """Limits of regions.

    thickness_m: largest RMS of a seed's points about their plane; distance_m: largest RMS of a voxel's points from the
    region's plane; least_voxels: smallest region.
    """

    thickness_m: float
    distance_m: float
    least_voxels: int


@dataclass(frozen=True)
class Plane:
    """Plane ``normal · x = distance_m``, and the RMS of its points from it; mean_m (3,) of the points."""

    normal: Array
    distance_m: float
    rms_m: float
    mean_m: Array


def plane_of_voxels(voxels: Voxels, rows: Integers) -> Plane:
    """Return the plane of least squares through the points of some voxels. The sense of its normal is arbitrary."""
    count = voxels.count[rows].astype(np.float64)
    share = count / count.sum()
    mean = share @ voxels.mean_m[rows]
    away = voxels.mean_m[rows] - mean
    covariance = np.einsum("g,gij->ij", share, voxels.covariance[rows]) + (share[:, None] * away).T @ away
    values, vectors = np.linalg.eigh(covariance)
    normal = vectors[:, 0]
    return Plane(normal, float(normal @ mean), float(np.sqrt(max(values[0], 0.0))), mean)


def distances_from(voxels: Voxels, rows: Integers, plane: Plane) -> Array:
    """Return the RMS distances (g,) m of the points of each of these voxels from a plane."""
    spread = np.einsum("i,gij,j->g", plane.normal, voxels.covariance[rows], plane.normal)
    return np.asarray(np.sqrt(np.maximum(spread, 0) + (voxels.mean_m[rows] @ plane.normal - plane.distance_m) ** 2))


def grown_regions(voxels: Voxels, limits: GrowthLimits) -> list[Integers]:
    """Return the rows of each plane's voxels, ascending; planes in the order of their seeds, the thinnest first."""
    if not len(voxels):
        return []
    values = np.linalg.eigvalsh(voxels.covariance)
    thickness = np.sqrt(np.maximum(values[:, 0], 0.0))
    flat = (voxels.count >= FEWEST) & (values[:, 1] > ELONGATED * values[:, 2]) & (thickness <= limits.thickness_m)
    seeds = np.flatnonzero(flat)
    free, tried, found = np.ones(len(voxels), dtype=bool), np.zeros(len(voxels), dtype=bool), list[Integers]()
    for seed in seeds[np.argsort(thickness[seeds], kind="stable")].tolist():
        if tried[seed]:
            continue
        rows = _grown(voxels, seed, free, limits.distance_m)
        tried[rows] = True  # what is too small from one seed is too small from its others
        if len(rows) >= limits.least_voxels:
            free[rows] = False
            found.append(rows)
    return found


def _grown(voxels: Voxels, seed: int, free: NDArray[np.bool_], distance_m: float) -> Integers:
    """Return the rows of the region of a seed, ascending; ``free`` (n,): the voxels that may join."""
    starts, others = voxels.neighbours
    plane = plane_of_voxels(voxels, np.array([seed]))
    for refitted in (True, False):
        may_join, rows, fitted = free.copy(), np.array([seed]), 1
        may_join[seed] = False
        ring = rows
        while len(ring):
            touching = np.unique(np.concatenate([others[starts[row] : starts[row + 1]] for row in ring]))
            touching = touching[may_join[touching]]
            ring = touching[distances_from(voxels, touching, plane) <= distance_m]
            may_join[ring] = False
            rows = np.concatenate([rows, ring])
            if refitted and len(rows) > GROWN * fitted:
                plane, fitted = plane_of_voxels(voxels, rows), len(rows)
        plane = plane_of_voxels(voxels, rows)
    return np.sort(rows)
