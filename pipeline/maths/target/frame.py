"""The ``target`` frame as it lies in the pool."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.trajectory import Trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TargetFrame:
    """Rotation R_target_from_pool (3, 3), and the origin of the target in the pool frame (3,) m."""

    R_target_from_pool: Array
    origin_pool_m: Array

    @property
    def shift_m(self) -> Array:
        """Return the origin of the pool in the target frame, (3,) m."""
        return -self.R_target_from_pool @ self.origin_pool_m

    def points_from_pool(self, points_pool_m: Array) -> Array:
        """Return points (n, 3) m of the pool frame in the target frame."""
        return np.asarray((self.R_target_from_pool @ (points_pool_m - self.origin_pool_m).T).T)

    def trajectory_from_pool(self, trajectory: Trajectory) -> Trajectory:
        """Return a trajectory of the pool frame in the target frame."""
        return trajectory.transformed(self.R_target_from_pool, self.shift_m)
