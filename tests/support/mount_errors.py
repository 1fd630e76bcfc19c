"""Errors of an estimated mount against the truth, by scipy: independent of the program's own rotations."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation


def rotation_error(R_true: Any, R_found: Any) -> np.ndarray:
    """ε (3,) rad of R_true = Exp(ε) R_found."""
    return np.asarray((Rotation.from_matrix(R_true) * Rotation.from_matrix(R_found).inv()).as_rotvec())


def mount_error(block: Mapping[str, Any], truth: Mapping[str, Any], sensor: str = "mbes") -> np.ndarray:
    """(6,) true minus found, of a method's block of calibration.json: rotation vector (rad), lever arm (m)."""
    true, name = truth[sensor], f"R_body_from_{sensor}"
    rotation = rotation_error(true[name], block[name])
    return np.concatenate([rotation, np.subtract(true["lever_arm_m"], block["lever_arm_m"])])
