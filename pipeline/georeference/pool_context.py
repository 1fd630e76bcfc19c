"""The pool frame and the INS's trajectory in it. All points of a session are placed with them."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.geometry.trajectory import GeodeticPoses, Trajectory, poses_in_pool

Array = NDArray[np.float64]


def pool_frame_of(pool_frame: pd.DataFrame) -> PoolFrame:
    """Return the pool frame from its table (one row)."""
    origin = pool_frame.iloc[0]
    return PoolFrame.at(
        np.radians(origin["latitude_deg"]),
        np.radians(origin["longitude_deg"]),
        float(origin["height_m"]),
        np.radians(origin["azimuth_deg"]),
    )


@dataclass(frozen=True)
class PoolContext:
    """The pool frame, the trajectory in it, the passes, and the box round the target (pool frame)."""

    frame: PoolFrame
    trajectory: Trajectory
    starts_ns: NDArray[np.int64]
    ends_ns: NDArray[np.int64]
    box_low_m: Array
    box_high_m: Array

    @classmethod
    def of(
        cls, ins: pd.DataFrame, passes: pd.DataFrame, pool_frame: pd.DataFrame, box_m: tuple[Array, Array]
    ) -> "PoolContext":
        """Return the context of a session. It converts the INS records into poses in the pool frame.

        Parameters
        ----------
        ins
            Table trajectory.
        passes
            Table passes.
        pool_frame
            Table pool_frame (one row).
        box_m
            Lowest and highest corner (3,) of the box, pool frame.
        """
        frame = pool_frame_of(pool_frame)
        names = ("latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")
        positions, R_pool_from_body = poses_in_pool(
            frame, GeodeticPoses(**{name: ins[name].to_numpy() for name in names})
        )
        return cls(
            frame=frame,
            trajectory=Trajectory.build(ins["t_ns"].to_numpy(), positions, R_pool_from_body),
            starts_ns=passes["start_ns"].to_numpy(),
            ends_ns=passes["end_ns"].to_numpy(),
            box_low_m=box_m[0],
            box_high_m=box_m[1],
        )
