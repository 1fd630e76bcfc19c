"""The least movement of a mount that the joint test of a difference finds.

The difference d (6,) of two estimates has the covariance C. If the mount has moved by m between the sessions, d has the
mean m. Then with C = L Lᵀ, T = dᵀ C⁻¹ d is the squared length of L⁻¹ d, six independent normal values of variance one
and mean L⁻¹ m: T has the non-central chi-square distribution with six degrees of freedom and λ = mᵀ C⁻¹ m. The test at
the level α sees the movement where T exceeds the limit χ²(6; 1 - α), with a probability (the *power*) that grows with
λ alone. Let λ0 be the λ at which it is the wanted power: 27.0 for α = 1 % and a power of 95 % (Baarda 1968, A testing
procedure for use in geodetic networks, with six in place of one degree of freedom).

Of one parameter k two least movements follow.

* *Alone*: the other five stay, m = δ e_k. Then λ = δ² (C⁻¹)_kk, and δ = √(λ0 / (C⁻¹)_kk).
* *Surely*: the other five may move too, and hide as much of it as they can. The least λ of all m with m_k = δ: by
  Lagrange 2 C⁻¹ m = μ e_k, so m = C e_k δ / C_kk and λ = δ² / C_kk. So δ = √(λ0 C_kk): a movement whose component k is
  at least δ has at least the power, whatever the others do.

C_kk (C⁻¹)_kk ≥ 1, so that the first is never the larger. They differ where an error resembles a movement: a gradient of
the sound speed looks like a roll together with a fall of the sonar.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, chndtrinc

Array = NDArray[np.float64]
POWER = 0.95  # probability with which a detectable movement is found


@dataclass(frozen=True)
class DetectableMovement:
    """The least movements (n,) of each parameter that the test finds: ``alone`` and ``surely``, in their units."""

    alone: Array
    surely: Array


def detectable_movement(covariance: Array, level: float, power: float = POWER) -> DetectableMovement:
    """Return the least movements that the joint test finds.

    Parameters
    ----------
    covariance
        Covariance C (n, n) of the difference; its parameters may have different units.
    level
        Level α of the test: the probability of a false alarm.
    power
        Probability with which a movement of this size is to be found.

    >>> found = detectable_movement(np.diag([4.0, 1.0, 1.0, 1.0, 1.0, 1.0]), 0.01)
    >>> found.surely.round(1).tolist()
    [10.4, 5.2, 5.2, 5.2, 5.2, 5.2]
    """
    n = len(covariance)
    length = float(np.sqrt(chndtrinc(chdtri(n, level), n, 1 - power)))  # √λ0
    sigma = np.sqrt(np.diag(covariance))
    information = np.diag(np.linalg.inv(covariance / np.outer(sigma, sigma)))
    return DetectableMovement(alone=length * sigma / np.sqrt(information), surely=length * sigma)
