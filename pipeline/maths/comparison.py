"""Two calibrations of one mount: is what differs more than their noise?

With R_true = Exp(ε_A) R_A = Exp(ε_B) R_B, and d = Log(R_B R_Aᵀ), to first order d = ε_A - ε_B; likewise the lever arms,
l_B - l_A = ε_A - ε_B. So where the mount has not moved, the six differences have mean zero and, the two sessions being
independent, the covariance C = C_A + C_B. Then

    T = dᵀ C⁻¹ d

is chi-square with six degrees of freedom: one test of all six at one level, where six separate ones would give six
times as many false alarms. (Errors that both sessions share, the laser's mount above all, cancel in d.)

People read a mount as pitch, roll, yaw, so what differs is named by these: their differences, with the covariance
J_A C_A J_Aᵀ + J_B C_B J_Bᵀ, J = ∂(pitch, roll, yaw)/∂ε (:func:`pipeline.maths.geometry.rotations.mount_partials`); each
z_i = d_i / root(C_ii) is standard normal. For a head near zero yaw these are the rotations about body x, y, z; for one
turned by 90° pitch and roll are the other way round.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from pipeline.maths.geometry.rotations import log_so3, mount_from_rotation, mount_partials

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """R_body_from_sensor (3, 3), lever arm (3,) m, covariance (6, 6) of (ε rad, lever arm m), body axes."""

    R_body_from_sensor: Array
    lever_arm_m: Array
    covariance: Array


@dataclass(frozen=True)
class Comparison:
    """Second minus first: pitch, roll, yaw (rad) and lever arm (m) in one vector (6,); its sigmas and z (6,) each; the
    joint statistic T and its probability if nothing has moved."""

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
    lever_arm = second.lever_arm_m - first.lever_arm_m
    statistic = _squared(np.concatenate([rotation, lever_arm]), first.covariance + second.covariance)
    one, other = (_settings(estimate.R_body_from_sensor) for estimate in (first, second))
    angles = np.mod(other - one + np.pi, 2 * np.pi) - np.pi
    difference = np.concatenate([angles, lever_arm])
    covariance = _turned(first) + _turned(second)
    sigma = np.sqrt(np.diag(covariance))
    return Comparison(difference, covariance, sigma, difference / sigma, statistic, float(chdtrc(6, statistic)))


def _squared(d: Array, covariance: Array) -> float:
    """dᵀ C⁻¹ d, scaled first: rad and m are of different size."""
    sigma = np.sqrt(np.diag(covariance))
    z = d / sigma
    return float(z @ np.linalg.solve(covariance / np.outer(sigma, sigma), z))


def _settings(R_body_from_sensor: Array) -> Array:
    """Pitch, roll, yaw."""
    roll, pitch, yaw = mount_from_rotation(R_body_from_sensor)
    return np.array([pitch, roll, yaw])


def _turned(estimate: Estimate) -> Array:
    """The covariance of (pitch, roll, yaw, lever arm)."""
    turn = np.eye(6)
    turn[:3, :3] = mount_partials(estimate.R_body_from_sensor)
    return np.asarray(turn @ estimate.covariance @ turn.T)
