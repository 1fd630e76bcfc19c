"""From tables back to trajectories."""

import numpy as np
import pandas as pd

from pipeline.maths.geometry.rotations import rotation_from_quaternion
from pipeline.maths.geometry.trajectory import Trajectory


def trajectory_in_pool(poses: pd.DataFrame) -> Trajectory:
    """The trajectory in the pool frame from georeference's table ``poses``."""
    return Trajectory.build(
        poses["t_ns"].to_numpy(),
        poses[["x_pool_m", "y_pool_m", "z_pool_m"]].to_numpy(),
        rotation_from_quaternion(poses[["qw", "qx", "qy", "qz"]].to_numpy()),
    )


def trajectory_in_target(poses: pd.DataFrame, target_pose: pd.DataFrame) -> Trajectory:
    """The trajectory in the target frame: x_target = R_target_from_pool (x_pool - origin)."""
    row = target_pose.iloc[0]
    R_target_from_pool = np.array(row["R_target_from_pool"], dtype=np.float64).reshape(3, 3)
    origin = row[[f"origin_{axis}_pool_m" for axis in "xyz"]].to_numpy(dtype=np.float64)
    return trajectory_in_pool(poses).moved(R_target_from_pool, -R_target_from_pool @ origin)
