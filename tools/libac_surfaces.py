"""Planes and spheres in LibAC's rows, and how those of two passes close.

Planes are found as those of a place that nobody has drawn are (:mod:`pipeline.finding.dry_planes`), by growing, with
limits at the scale of these targets: a voxel of the program's own 0.3 m is larger than a whole target. A sphere has no
place in the program. For a check alone, its centre c and radius r are those of the least sum of squares of the points'
distances from it, started at the algebraic fit |x|² = 2 c · x + r² - |c|², which is linear in c and r² - |c|² (with a
known radius: at that distance in the same direction).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pipeline.maths.geometry.planes import Plane, PlaneMoments, angle_between, fit_plane
from pipeline.maths.surfaces.flatness import Flatness, flatness, plane_axes
from pipeline.maths.surfaces.growing import GrowthLimits, grown_regions
from pipeline.maths.surfaces.voxels import voxels_of

Array = NDArray[np.float64]
VOXEL_M, CELL_M = 0.04, 0.03
GROWTH = GrowthLimits(thickness_m=0.003, distance_m=0.004, least_voxels=6)


@dataclass(frozen=True)
class FoundPlane:
    """A plane of one target and pass; rows (k,): its points, ascending; away_m (k,): their distances from it."""

    rows: NDArray[np.int64]
    plane: Plane
    flat: Flatness
    away_m: Array

    @property
    def turn_sigma_deg(self) -> float:
        """Return the larger sigma of the normal's two turns, for points with independent noise."""
        return float(np.degrees(np.sqrt(self.plane.covariance[:2, :2].diagonal().max())))


@dataclass(frozen=True)
class Sphere:
    """A sphere: centre (3,), radius, RMS of the points' distances from it, covariance (3, 3) of the centre, m."""

    centre_m: Array
    radius_m: float
    rms_m: float
    covariance_m2: Array


def planes_in(points_m: Array, boat_m: Array) -> list[FoundPlane]:
    """Return the planes among points (n, 3); the normals point toward the boat at ``boat_m`` (3,)."""
    voxels = voxels_of(points_m, VOXEL_M)
    code = voxels.code_of(points_m)
    regions = [np.flatnonzero(np.isin(code, voxels.code[region])) for region in grown_regions(voxels, GROWTH)]
    return [plane_through(points_m, rows, boat_m) for rows in regions]


def plane_through(points_m: Array, rows: NDArray[np.int64], boat_m: Array) -> FoundPlane:
    """Return the plane of the rows (k,) among points (n, 3), with equal errors in all directions, as the rows say."""
    on = points_m[rows]
    plane = fit_plane(PlaneMoments.of(on), boat_m - on.mean(axis=0))
    away = on @ plane.normal - plane.distance_m
    return FoundPlane(rows, plane, flatness(on @ plane_axes(plane.normal).T, away, CELL_M), away)


@dataclass(frozen=True)
class PlaneClosing:
    """The plane of the second pass against that of the first: angle, difference of how far they lean, distance.

    angle_sigma_deg: of independent noise, from both planes' larger sigmas.
    """

    angle_deg: float
    angle_sigma_deg: float
    lean_deg: float
    distance_m: float


def plane_closing(first: FoundPlane, second: FoundPlane) -> PlaneClosing:
    """Return how the planes of two passes close; the distance is that of the middles along the mean normal."""
    normal = first.plane.normal + second.plane.normal
    leans = [np.degrees(np.arcsin(one.plane.normal[2])) for one in (first, second)]
    apart = second.plane.centroid_m - first.plane.centroid_m
    return PlaneClosing(
        angle_deg=float(np.degrees(angle_between(first.plane.normal, second.plane.normal))),
        angle_sigma_deg=float(np.hypot(first.turn_sigma_deg, second.turn_sigma_deg)),
        lean_deg=float(leans[1] - leans[0]),
        distance_m=float(normal @ apart / np.linalg.norm(normal)),
    )


def sphere_through(points_m: Array, radius_m: float | None = None) -> Sphere:
    """Return the sphere of least squares through points (n, 3), with this radius; with None its radius is unknown."""
    middle = points_m.mean(axis=0)
    away = points_m - middle
    algebraic = np.linalg.lstsq(np.column_stack([2 * away, np.ones(len(away))]), np.sum(away**2, axis=1), rcond=None)[0]
    start = np.r_[algebraic[:3], np.sqrt(algebraic[3] + algebraic[:3] @ algebraic[:3])]
    if radius_m is not None:
        start = start[:3] / max(float(np.linalg.norm(start[:3])), 1e-9) * radius_m

    def distances(sphere: Array) -> Array:
        radius = sphere[3] if radius_m is None else radius_m
        return np.asarray(np.linalg.norm(away - sphere[:3], axis=1) - radius)

    found = least_squares(distances, start, xtol=1e-12, ftol=1e-12)
    variance = 2 * found.cost / (len(points_m) - len(start))
    return Sphere(
        centre_m=middle + found.x[:3],
        radius_m=float(found.x[3]) if radius_m is None else radius_m,
        rms_m=float(np.sqrt(2 * found.cost / len(points_m))),
        covariance_m2=(variance * np.linalg.inv(found.jac.T @ found.jac))[:3, :3],
    )
