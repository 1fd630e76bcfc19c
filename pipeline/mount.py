"""The mount of a sensor: rotation matrix and lever arm, and their settings in degrees and metres."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.mount import Mount
from pipeline.maths.geometry.rotations import exp_so3, mount_from_rotation, mount_partials, rotation_from_mount
from pipeline.maths.mount_parameters import PARAMETERS

Array = NDArray[np.float64]

WITHIN_95 = 1.959964  # half width of the 95 % interval, in sigmas


@dataclass(frozen=True)
class Mounted:
    """The mount of a sensor: R_body_from_sensor (3, 3) and lever_arm_body_m (3,)."""

    R_body_from_sensor: Array
    lever_arm_body_m: Array

    def settings(self) -> dict[str, float]:
        """Return the mount's settings by name, as in session.yaml: pitch within ±90°, roll and yaw within ±180°."""
        names = ("roll_deg", "pitch_deg", "yaw_deg")
        angles = (round(float(np.degrees(angle)), 12) for angle in mount_from_rotation(self.R_body_from_sensor))
        lever = (float(value) for value in self.lever_arm_body_m)
        return dict(zip(names, angles, strict=True)) | dict(zip(("x_m", "y_m", "z_m"), lever, strict=True))

    def sigmas(self, covariance: Array) -> dict[str, float]:
        """Return the sigmas of the six settings, degrees and m, from the covariance (6, 6), rad and m, body axes."""
        partials = mount_partials(self.R_body_from_sensor)
        angles = np.degrees(np.sqrt(np.diag(partials @ covariance[:3, :3] @ partials.T)))
        sigmas = [*angles, *np.sqrt(np.diag(covariance)[3:])]
        return {key: float(sigmas[place]) for _, place, key, _ in PARAMETERS}


def corrected_mount(mount: Mount, rotation_vector_deg: Array) -> Mounted:
    """Return a mount with its rotation corrected by a rotation vector (3,), body axes. The lever arm stays the same."""
    coarse = mount_of(mount)
    return Mounted(exp_so3(np.radians(rotation_vector_deg)) @ coarse.R_body_from_sensor, coarse.lever_arm_body_m)


def mount_of(mount: Mount) -> Mounted:
    """Return the rotation matrix and the lever arm of a mount's settings."""
    angles = np.radians([mount.roll_deg, mount.pitch_deg, mount.yaw_deg])
    return Mounted(rotation_from_mount(*map(float, angles)), np.array([mount.x_m, mount.y_m, mount.z_m]))


def parameters_of(block: Mapping[str, Sequence[float] | None] | None) -> list[float]:
    """Return a block of calibration.json, a correction or a sigma, as a list of six numbers.

    They are the rotation about body x, y, z (degrees) and the lever arm (m); all are NaN if the block has no values.
    """
    parts = [] if block is None else [block["rotation_vector_deg"], block["lever_arm_m"]]
    return [float(value) for part in parts if part is not None for value in part] or [float("nan")] * 6


def setting_change(total: Mapping[str, float], coarse: Mapping[str, float], key: str) -> float:
    """Return the calibrated minus the coarse value of one setting. The change of an angle is within ±180°.

    Parameters
    ----------
    total, coarse
        Settings of the calibrated and of the coarse mount, degrees and metres.
    key
        Name of the setting.
    """
    change = total[key] - coarse[key]
    return change - 360.0 * round(change / 360.0) if key.endswith("_deg") else change


