"""How well the mount of one way fits values that may have been entered: the tolerances, and what the data hide."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.ways import Way
from pipeline.maths.geometry.rotations import rotation_error
from pipeline.mount import Mounted

Array = NDArray[np.float64]
TOLERANCE_DEG, TOLERANCE_M = 0.01, 0.005
NAMED_DEG = 0.006  # of a mistake with known numbers: they were rounded to 0.01 degrees
SIGMAS = 3.0
SPARE, SPARE_M = 1.3, 0.0005  # variance of the rounding by this factor, and this squared, are no excess
HIDDEN = 3.0  # a mount may be wrong by so many times the excess without being noticed
MOST_Z_M = 0.1  # three sigmas of z where any height will do
MOST_EXCESS_M = TOLERANCE_M / 2  # beyond, nothing is called right
CLEARLY = 3.0


def excess_of(scatter_m: float, rounding_m: float) -> float:
    """Return what the scatter of a coordinate has beyond rounding to steps of 2 h, whose variance is h² / 3."""
    return float(np.sqrt(max(scatter_m**2 - SPARE * rounding_m**2 / 3 - SPARE_M**2, 0.0)))


@dataclass(frozen=True)
class Judge:
    """Compares the mount of one way with values that may have been entered."""

    way: Way
    angle_limit_deg: Array
    lever_limit_m: Array
    excess_m: float

    @classmethod
    def of(cls, way: Way, rounding_m: float, range_m: float) -> "Judge":
        """Return the judge of a way; ``range_m``: of most soundings."""
        excess_m = excess_of(max(way.fitted.scatter_m, way.fitted.left_out_m), rounding_m)
        sigma = np.sqrt(np.diag(way.fitted.covariance))
        angles = SIGMAS * sigma[:3] + HIDDEN * excess_m / range_m
        return cls(way, np.degrees(angles), SIGMAS * sigma[3:6] + HIDDEN * excess_m, excess_m)

    @property
    def mount(self) -> Mounted:
        """The found mount."""
        return Mounted(self.way.fitted.R_body_from_mbes, self.way.fitted.lever_arm_m)

    def turn_deg(self, R: Array) -> Array:
        """Return the rotation vector (3,) from a rotation to the found one, degrees, body axes."""
        return np.asarray(np.degrees(rotation_error(self.way.fitted.R_body_from_mbes, R)))

    def turned_attitudes(self, R: Array) -> Array:
        """Return the turn D (3, 3) of all attitudes by which D R is the found rotation."""
        return np.asarray(self.way.fitted.R_body_from_mbes @ R.T)

    def is_rotation(self, R: Array, tolerance_deg: float = NAMED_DEG) -> bool:
        """Whether a rotation may have been entered: about each axis."""
        return bool(np.all(np.abs(self.turn_deg(R)) <= tolerance_deg + self.angle_limit_deg))

    def is_lever(self, lever_arm_m: Array) -> bool:
        """Whether a lever arm may have been entered."""
        return bool(np.all(np.abs(self.way.fitted.lever_arm_m - lever_arm_m) <= TOLERANCE_M + self.lever_limit_m))

    def differs_clearly(self, value: Array, right: Array) -> bool:
        """Whether an entered rotation or lever arm is so far from the right one that hardly any lies in between."""
        if value.ndim == 2:
            off, allowed = np.degrees(np.abs(rotation_error(value, right))), TOLERANCE_DEG + self.angle_limit_deg
        else:
            off, allowed = np.abs(value - right), TOLERANCE_M + self.lever_limit_m
        return bool(np.any(off > CLEARLY * allowed))

    def proves(self, R: Array, lever_arm_m: Array) -> bool:
        """Whether it is certain that a mount was entered; z is known within MOST_Z_M if any height will do."""
        angle = float(np.abs(self.turn_deg(R)).max())
        sigma = SIGMAS * np.sqrt(np.diag(self.way.fitted.covariance))[:6]
        off = np.abs(self.way.fitted.lever_arm_m - lever_arm_m)
        most = np.array([TOLERANCE_M, TOLERANCE_M, MOST_Z_M if self.way.any_height else TOLERANCE_M])
        near = angle <= TOLERANCE_DEG and bool((off <= most).all())
        close = np.degrees(sigma[:3].max()) <= TOLERANCE_DEG and bool((sigma[3:] <= most).all())
        return near and bool(close) and self.excess_m <= MOST_EXCESS_M
