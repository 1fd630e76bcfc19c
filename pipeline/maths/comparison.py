"""Two estimates of one mount, and an estimate against the truth: the difference, tested against its errors.

With R_true = Exp(ε_A) R_A = Exp(ε_B) R_B, and d = Log(R_B R_Aᵀ), to first order d = ε_A - ε_B; likewise the lever arms,
l_B - l_A = ε_A - ε_B. So if the mount has not moved, the six differences have mean zero. ε consists of noise with the
covariance C, and of what the errors e of fixed parameters do to it, S e (S: sensitivity, (6, h)). In d are

* the noise of both sessions, independent: C_A + C_B;
* errors that each session has to itself, drawn anew every day (the sound speed, the clocks), with the covariance Q_s;
* errors e_c that both share (the laser's mount, the target as built), with the covariance Q_c. They enter as
  (S_A - S_B) e_c: only what the two geometries make different of one error does not cancel.

The sessions are independent but for the last. So the covariance of d is

    C = C_A + C_B + S_A Q_s,A S_Aᵀ + S_B Q_s,B S_Bᵀ + (S_A - S_B) Q_c (S_A - S_B)ᵀ.

Each Q is taken apart into independent errors of variance one, Q = G Gᵀ, whose *effects* are the columns of E = S G
(6, n): S Q Sᵀ = E Eᵀ. With all of them side by side, F = [E_A, E_B, E_c,A - E_c,B], C = C_A + C_B + F Fᵀ. Then

    T = dᵀ C⁻¹ d

is chi-square with six degrees of freedom. This is one test of all six parameters at one level; six separate tests would
give six times as many false alarms.

People read a mount as pitch, roll and yaw. So the difference is expressed in these: each session's C becomes J C Jᵀ and
each E becomes J E, J = ∂(pitch, roll, yaw)/∂ε (:func:`pipeline.maths.geometry.rotations.mount_partials`). Each z_i =
d_i / root(C_ii) is standard normal. For a mount with a yaw near zero these are the rotations about body x, y, z. With a
yaw near 90° pitch and roll change places.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from pipeline.maths.geometry.rotations import mount_from_rotation, mount_partials, rotation_error

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MountEstimate:
    """R_body_from_sensor (3, 3), lever arm (3,) m, covariance (6, 6) of (ε rad, lever arm m) from noise, body axes.

    own (6, p), common (6, n): effects on (ε, lever arm) of independent errors of variance one, which the session has to
    itself, or shares with the session that it is compared with. The errors that both share have the same order.
    """

    R_body_from_sensor: Array
    lever_arm_m: Array
    covariance: Array
    own: Array = field(default_factory=lambda: np.zeros((6, 0)))
    common: Array = field(default_factory=lambda: np.zeros((6, 0)))


@dataclass(frozen=True)
class MountDifference:
    """Difference of two estimates, second minus first.

    Parameters
    ----------
    difference
        Pitch, roll, yaw (rad) and lever arm (m) in one vector (6,).
    covariance, sigma
        Covariance (6, 6) of the difference, and its sigmas (6,).
    effects
        Part F (6, p + q + n) of the covariance that is not noise, F Fᵀ: a column for each error of its own of the
        first estimate, of the second, and for each that both share.
    z
        Differences divided by their sigmas (6,).
    statistic, probability
        The joint statistic T, and the probability of a T as large if the mount has not moved.
    """

    difference: Array
    covariance: Array
    sigma: Array
    effects: Array
    z: Array
    statistic: float
    probability: float

    def significant(self, level: float) -> list[int]:
        """Return the indices of the parameters that have changed; none if the joint test shows no change.

        They are the parameters with |z| above a limit. With probability ``level`` at least one of six independent
        values exceeds this limit by chance (Šidák). If none exceeds it, the one is returned whose movement alone
        explains most of T. Estimated from d, a movement δ of parameter k has δ = (C⁻¹ d)_k / (C⁻¹)_kk, and T without it
        is less by w_k² = (C⁻¹ d)_k² / (C⁻¹)_kk (Baarda's w-test; d and C in pitch, roll, yaw and lever arm).
        """
        if self.probability >= level:
            return []
        limit = -float(ndtri((1 - (1 - level) ** (1 / 6)) / 2))
        beyond = np.flatnonzero(np.abs(self.z) > limit).tolist()
        inverse = np.linalg.inv(self.covariance / np.outer(self.sigma, self.sigma))
        return beyond or [int(np.argmax((inverse @ self.z) ** 2 / np.diag(inverse)))]


def compare_estimates(first: MountEstimate, second: MountEstimate) -> MountDifference:
    """Compute the second estimate minus the first, and test it.

    >>> estimate = MountEstimate(np.eye(3), np.zeros(3), np.eye(6) * 1e-6)
    >>> compare_estimates(estimate, estimate).probability
    1.0
    """
    rotation = rotation_error(second.R_body_from_sensor, first.R_body_from_sensor)
    lever_arm = second.lever_arm_m - first.lever_arm_m
    unturned, _ = _covariance_and_effects((first, second), (np.eye(6), np.eye(6)))
    statistic = _mahalanobis_squared(np.concatenate([rotation, lever_arm]), unturned)
    first_angles, second_angles = (_pitch_roll_yaw(estimate.R_body_from_sensor) for estimate in (first, second))
    angles = np.mod(second_angles - first_angles + np.pi, 2 * np.pi) - np.pi
    difference = np.concatenate([angles, lever_arm])
    partials = _partials_of_settings(first), _partials_of_settings(second)
    covariance, effects = _covariance_and_effects((first, second), partials)
    sigma = np.sqrt(np.diag(covariance))
    return MountDifference(
        difference=difference,
        covariance=covariance,
        sigma=sigma,
        effects=effects,
        z=difference / sigma,
        statistic=statistic,
        probability=float(chdtrc(6, statistic)),
    )


def mount_error(R_true: Array, lever_arm_true_m: Array, R_found: Array, lever_arm_found_m: Array) -> Array:
    """Return the error (6,) of an estimated mount, true minus estimated: ε of R_true = Exp(ε) R_found, lever arm.

    Parameters
    ----------
    R_true, R_found
        R_body_from_sensor (3, 3).
    lever_arm_true_m, lever_arm_found_m
        Lever arms (3,), body axes.

    Returns
    -------
    Rotation vector in rad, lever arm in m, body axes.
    """
    return np.concatenate([rotation_error(R_true, R_found), lever_arm_true_m - lever_arm_found_m])


def _mahalanobis_squared(d: Array, covariance: Array) -> float:
    """Return dᵀ C⁻¹ d. C is scaled to correlations first, because rad and m differ in size."""
    sigma = np.sqrt(np.diag(covariance))
    z = d / sigma
    return float(z @ np.linalg.solve(covariance / np.outer(sigma, sigma), z))


def _pitch_roll_yaw(R_body_from_sensor: Array) -> Array:
    roll, pitch, yaw = mount_from_rotation(R_body_from_sensor)
    return np.array([pitch, roll, yaw])


def _partials_of_settings(estimate: MountEstimate) -> Array:
    """Return the derivatives (6, 6) of (pitch, roll, yaw, lever arm) by (ε, lever arm)."""
    partials = np.eye(6)
    partials[:3, :3] = mount_partials(estimate.R_body_from_sensor)
    return partials


def _covariance_and_effects(
    estimates: tuple[MountEstimate, MountEstimate], partials: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Return the covariance (6, 6) of the difference and its part F, each session's J (6, 6) applied."""
    (first, second), (J_first, J_second) = estimates, partials
    noise = J_first @ first.covariance @ J_first.T + J_second @ second.covariance @ J_second.T
    shared = J_first @ first.common - J_second @ second.common
    effects = np.hstack([J_first @ first.own, J_second @ second.own, shared])
    return noise + effects @ effects.T, effects
