"""Points placed by numpy: the oracle of the compiled loop."""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.geometry.trajectory import Trajectory

Array = NDArray[np.float64]


def placed_by_numpy(trajectory: Trajectory, t_ns: NDArray[np.int64], body_m: Array) -> Array:
    """Return the points (n, 3) m in the trajectory's frame, from those in the body frame at times (n,)."""
    record, share = trajectory.interval_of(t_ns)
    step = trajectory.positions_m[record + 1] - trajectory.positions_m[record]
    R = trajectory.R_frame_from_body[record] @ exp_so3(trajectory.steps_rad[record] * share[:, None])
    turned: Array = np.einsum("nij,nj->ni", R, body_m)
    return trajectory.positions_m[record] + share[:, None] * step + turned
