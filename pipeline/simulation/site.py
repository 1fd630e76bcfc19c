"""Target frame <-> WGS 84, positions by pyproj. The local level at the INS differs from that at the target's origin."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pyproj import Transformer
from scipy.spatial.transform import Rotation

from pipeline.config.target import Origin

Floats = NDArray[np.float64]


def R_ecef_from_level(latitude_rad: Floats, longitude_rad: Floats) -> Floats:
    """Return the rotations (..., 3, 3) whose columns are east, north and up at points, in ECEF."""
    sin_lat, cos_lat, sin_lon, cos_lon = (f(x) for x in (latitude_rad, longitude_rad) for f in (np.sin, np.cos))
    east = [-sin_lon, cos_lon, np.zeros_like(sin_lon)]
    north = [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat]
    up = [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat]
    return np.stack([np.stack(axis, axis=-1) for axis in (east, north, up)], axis=-1)


@dataclass(frozen=True)
class Site:
    """Place of the target: its origin, and the direction of its +y axis, clockwise from true north."""

    origin: Origin
    azimuth_deg: float

    @property
    def R_level_from_target(self) -> Rotation:
        """Rz(-azimuth): y_target = (sin azimuth, cos azimuth, 0) in east, north, up."""
        return Rotation.from_euler("Z", -self.azimuth_deg, degrees=True)

    @property
    def R_ecef_from_target(self) -> Floats:
        """Rotation (3, 3) from the target frame to ECEF."""
        latitude_rad, longitude_rad = np.radians([self.origin.latitude_deg, self.origin.longitude_deg])
        R_level_from_target: Floats = self.R_level_from_target.as_matrix()
        return R_ecef_from_level(latitude_rad, longitude_rad) @ R_level_from_target

    def geodetic_from_target(self, points_target: Floats) -> tuple[Floats, Floats, Floats]:
        """Return latitude (rad), longitude (rad), ellipsoidal height (m) of (n, 3) points in the target frame."""
        east, north, up = self.R_level_from_target.apply(points_target).T
        longitude_rad, latitude_rad, height_m = _to_geodetic(self.origin).transform(east, north, up, radians=True)
        return np.asarray(latitude_rad), np.asarray(longitude_rad), np.asarray(height_m)

    def R_target_from_level(self, latitude_rad: Floats, longitude_rad: Floats) -> Floats:
        """Return the rotations (n, 3, 3) from the local level at points to the target frame."""
        return self.R_ecef_from_target.T @ R_ecef_from_level(latitude_rad, longitude_rad)


@lru_cache(maxsize=8)
def _to_geodetic(origin: Origin) -> Transformer:
    """Return the transformation of east, north, up at an origin to longitude, latitude, height.

    The PROJ string is made of plain floats: numpy's repr in it would give wrong numbers without an error.
    """
    return Transformer.from_pipeline(
        "+proj=pipeline +step +inv +proj=topocentric +ellps=WGS84 "
        f"+lat_0={origin.latitude_deg!r} +lon_0={origin.longitude_deg!r} +h_0={origin.height_m!r} "
        "+step +inv +proj=cart +ellps=WGS84"
    )
