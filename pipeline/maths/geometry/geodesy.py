"""Geodetic, earth-centred and pool coordinates, on the ellipsoid of WGS 84 (GRS 80 and CGCS2000: within 0.12 mm)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import rotation_z

Array = NDArray[np.float64]

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)


def ecef_from_geodetic(latitude_rad: Array, longitude_rad: Array, height_m: Array) -> Array:
    """Return earth-centred, earth-fixed coordinates (n, 3) m.

    X = (N + h) cos φ cos λ, Y = (N + h) cos φ sin λ, Z = (N (1 - e²) + h) sin φ, N = a / √(1 - e² sin² φ)
    (e.g. Torge, Geodesy, 4.1.3). Rounding at the earth's radius is 1e-9 m.

    Parameters
    ----------
    latitude_rad, longitude_rad
        Geodetic latitude and longitude (n,).
    height_m
        Ellipsoidal height (n,).

    >>> ecef_from_geodetic(np.zeros(1), np.zeros(1), np.zeros(1))[0]
    array([6378137.,       0.,       0.])
    """
    sin_lat, cos_lat = np.sin(latitude_rad), np.cos(latitude_rad)
    n = SEMI_MAJOR_M / np.sqrt(1 - ECCENTRICITY_SQUARED * sin_lat**2)
    horizontal = (n + height_m) * cos_lat
    return np.stack(
        [
            horizontal * np.cos(longitude_rad),
            horizontal * np.sin(longitude_rad),
            (n * (1 - ECCENTRICITY_SQUARED) + height_m) * sin_lat,
        ],
        -1,
    )


def geodetic_from_ecef(point_ecef_m: Array) -> tuple[float, float, float]:
    """Return latitude and longitude (rad) and ellipsoidal height (m) of a point (3,) in ECEF, near the earth's surface.

    Fixed point of tan φ = (Z + e² N sin φ) / p, p = √(X² + Y²): each step divides the error by 1 / e² or more, so that
    twelve leave less than rounding.

    >>> geodetic_from_ecef(ecef_from_geodetic(np.array(0.6), np.array(2.1), np.array(12.0)))
    (0.6, 2.1, 12.000...)
    """
    x, y, z = point_ecef_m.tolist()
    p = float(np.hypot(x, y))
    latitude = float(np.arctan2(z, p * (1 - ECCENTRICITY_SQUARED)))
    for _ in range(12):
        n = SEMI_MAJOR_M / np.sqrt(1 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2)
        latitude = float(np.arctan2(z + ECCENTRICITY_SQUARED * n * np.sin(latitude), p))
    n = SEMI_MAJOR_M / np.sqrt(1 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2)
    height = p * np.cos(latitude) + z * np.sin(latitude) - n * (1 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2)
    return latitude, float(np.arctan2(y, x)), float(height)


def rotation_ecef_from_level(latitude_rad: Array, longitude_rad: Array) -> Array:
    """Return ``R_ecef_from_level`` (n, 3, 3) at places (n,): its columns are east, north, up."""
    sin_lat, cos_lat = np.sin(latitude_rad), np.cos(latitude_rad)
    sin_lon, cos_lon = np.sin(longitude_rad), np.cos(longitude_rad)
    zero = np.zeros_like(sin_lat + sin_lon)
    east = np.stack([-sin_lon + zero, cos_lon + zero, zero], -1)
    north = np.stack([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat + zero], -1)
    up = np.stack([cos_lat * cos_lon, cos_lat * sin_lon, sin_lat + zero], -1)
    return np.stack([east, north, up], -1)


@dataclass(frozen=True)
class PoolFrame:
    """The ``pool`` frame: the configured origin, z up at the origin, y at an azimuth (clockwise from true north).

    Coordinates are differences in ECEF, rotated into the frame. So the earth's curvature within the pool, millimetres,
    is exact.
    """

    origin_ecef_m: Array
    R_pool_from_ecef: Array

    @classmethod
    def at(cls, latitude_rad: float, longitude_rad: float, height_m: float, azimuth_rad: float) -> "PoolFrame":
        """Return the pool frame with this origin and azimuth.

        Parameters
        ----------
        latitude_rad, longitude_rad
            Geodetic latitude and longitude of the origin.
        height_m
            Ellipsoidal height of the origin.
        azimuth_rad
            Direction of the y axis, clockwise from true north.
        """
        latitude, longitude = np.array(latitude_rad), np.array(longitude_rad)
        # Level to pool: y of the pool lies at azimuth A, so coordinates turn by +A about z.
        R_pool_from_level = rotation_z(azimuth_rad)
        return cls(
            ecef_from_geodetic(latitude, longitude, np.array(height_m)),
            R_pool_from_level @ rotation_ecef_from_level(latitude, longitude).T,
        )

    def points_from_ecef(self, points_ecef_m: Array) -> Array:
        """Return the pool coordinates (n, 3) m of points (n, 3) m in ECEF."""
        return (points_ecef_m - self.origin_ecef_m) @ self.R_pool_from_ecef.T

    def points_to_ecef(self, points_pool_m: Array) -> Array:
        """Return the coordinates (n, 3) m in ECEF of points (n, 3) m in the pool frame."""
        return points_pool_m @ self.R_pool_from_ecef + self.origin_ecef_m
