"""Two calibrations of one mount: is what differs more than their noise?

With R_true = Exp(ε_A) R_A = Exp(ε_B) R_B, and d = Log(R_B R_Aᵀ), to first order d = ε_A - ε_B; likewise the lever arms,
l_B - l_A = ε_A - ε_B. So where the mount has not moved, the six differences have mean zero and, the two sessions being
independent, the covariance C = C_A + C_B. Then each z_i = d_i / root(C_ii) is standard normal, and

    T = dᵀ C⁻¹ d

is chi-square with six degrees of freedom: one test of all six at one level, where six separate ones would give six
times as many false alarms. (Errors that both sessions share, the laser's mount above all, cancel in d.)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from pipeline.maths.rotations import log_so3

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """R_body_from_sensor (3, 3), lever arm (3,) m, covariance (6, 6) of (ε rad, lever arm m), body axes."""

    R_body_from_sensor: Array
    lever_arm_m: Array
    covariance: Array


@dataclass(frozen=True)
class Comparison:
    """Second minus first: rotation vector about body x, y, z (rad) and lever arm (m) in one vector (6,); its sigmas
    and z (6,) each; the joint statistic T and its probability if nothing has moved."""

    difference: Array
    covariance: Array
    sigma: Array
    z: Array
    statistic: float
    probability: float

    def moved(self, level: float) -> list[int]:
        """Which of the six stand out, where the joint test says that something does: |z| beyond the limit that six
        values exceed together with probability ``level`` (Šidák), the largest at least."""
        if self.probability >= level:
            return []
        limit = -float(ndtri((1 - (1 - level) ** (1 / 6)) / 2))
        size = np.abs(self.z)
        found = np.flatnonzero(size > limit).tolist()
        return found or [int(np.argmax(size))]


def compare(first: Estimate, second: Estimate) -> Comparison:
    """The second minus the first.

    >>> one = Estimate(np.eye(3), np.zeros(3), np.eye(6) * 1e-6)
    >>> compare(one, one).probability
    1.0
    """
    rotation = log_so3(second.R_body_from_sensor @ first.R_body_from_sensor.T)
    difference = np.concatenate([rotation, second.lever_arm_m - first.lever_arm_m])
    covariance = first.covariance + second.covariance
    sigma = np.sqrt(np.diag(covariance))
    scaled = covariance / np.outer(sigma, sigma)  # rad and m are of different size
    z = difference / sigma
    statistic = float(z @ np.linalg.solve(scaled, z))
    return Comparison(difference, covariance, sigma, z, statistic, float(chdtrc(6, statistic)))
