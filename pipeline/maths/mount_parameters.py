"""The six mount parameters: their order in every vector and covariance, their names, and the words for them in text."""

import numpy as np
from numpy.typing import NDArray

MOUNT_NAMES = ("rotation_x", "rotation_y", "rotation_z", "lever_arm_x", "lever_arm_y", "lever_arm_z")  # body axes
MOUNT_WORDS = ("pitch", "roll", "yaw", "lever arm x", "lever arm y", "lever arm z")  # in the same order
N_MOUNT = len(MOUNT_NAMES)

PARAMETERS = (  # in the order of reports: name, index in MOUNT_NAMES, key in YAML, unit
    ("roll", 1, "roll_deg", "deg"),
    ("pitch", 0, "pitch_deg", "deg"),
    ("yaw", 2, "yaw_deg", "deg"),
    ("x", 3, "x_m", "m"),
    ("y", 4, "y_m", "m"),
    ("z", 5, "z_m", "m"),
)


SETTINGS = tuple(key for *_, key, _ in PARAMETERS)

SIGNIFICANT = 3.0  # sigmas by which a correction must exceed a limit


def too_far(correction: NDArray[np.float64], sigma: NDArray[np.float64], limits: NDArray[np.float64]) -> list[int]:
    """Return the places of those components (6,) of a mount's correction that exceed their limits, not by chance.

    A component that the data leave open may come to lie anywhere, but has a sigma as large.
    """
    return np.flatnonzero(np.abs(correction) - SIGNIFICANT * sigma > limits).tolist()
