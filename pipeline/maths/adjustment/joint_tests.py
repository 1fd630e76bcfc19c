"""Tests of several parameters at once: how far the least sum of squares J falls if all of them are freed.

A single-parameter test (:mod:`~pipeline.maths.adjustment.parameter_tests`) asks whether one error explains the
residuals. Some errors are many at once: all wet faces are bowed. Then each single parameter explains a part, and
another one that is not wrong may explain more than any of them.

Let h be fixed parameters, and k estimated ones with values known beforehand, all to be freed. To free k is to add to
each of these values an unknown error β, fixed at zero before. The normal equations of h and β, with the parameters f
that remain estimated eliminated (C, S, P, d as there), are M y + r = 0 with

    M_hh = N_hh + N_hf S,     M_hβ = -S_khᵀ P,     M_ββ = P - P C P (rows and columns k),
    r_h = b_h + Sᵀ b_f,       r_β = -(P d)_k,

because β enters d - β alone: its normal matrix is P, and its columns with f are -P. J falls by T = rᵀ M⁺ r. Without an
error T is chi-squared with ν = rank M degrees of freedom. Directions of y that the points do not determine, like the
common shift of all faces of a surface, are no part of the rank. For one parameter T is the square of its strength.

The more parameters are free, the more J falls without any error. So that T can be compared with the strength of a
single parameter, it becomes the normal deviate u with the same probability (Teunissen 2018, "Distributional theory for
the DIA method", 3.2, on alternatives with different degrees of freedom: the least probable T is chosen):

    2 (1 - Φ(u)) = P(χ²_ν > T).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.solution import Solution

Array = NDArray[np.float64]
DETERMINED = 1e-6  # least share of a direction's information that the points must have for it to count
LEAST_PROBABILITY = 1e-280  # below it the probability comes from its series
TERMS = 60  # of the series, at most


@dataclass(frozen=True)
class JointTest:
    """Test of several parameters: the fall T of J if all are freed, and its degrees of freedom ν."""

    fall: float
    dof: int

    @property
    def strength(self) -> float:
        """Return the normal deviate u that is as improbable as this fall."""
        return normal_deviate_of(self.fall, self.dof)


def joint_test(
    normal: Array, right: Array, solution: Solution, deviation: Array, numbers: Sequence[int]
) -> JointTest:
    """Return the test of several parameters.

    Parameters
    ----------
    normal : (u, u) array
        Normal matrix N of all parameters.
    right : (u,) array
        Right side b.
    solution : Solution
        Solution of these normal equations.
    deviation : (u,) array
        Deviations from the values known beforehand, after the solution's step.
    numbers : sequence of int
        The parameters: fixed, or estimated with a value known beforehand.
    """
    freed = np.array(sorted(numbers), dtype=np.int64)
    fixed, known = freed[np.isin(freed, solution.fixed)], freed[np.isin(freed, solution.estimated)]
    places, columns = np.searchsorted(solution.estimated, known), np.searchsorted(solution.fixed, fixed)
    S, P, C = solution.sensitivity[:, columns], solution.prior, solution.covariance
    from_fixed = normal[np.ix_(fixed, fixed)] + normal[np.ix_(fixed, solution.estimated)] @ S
    across = -(S.T @ P)[:, places]
    from_known = (P - P @ C @ P)[np.ix_(places, places)]
    M = np.block([[from_fixed, across], [across.T, from_known]])
    r = np.concatenate(
        [
            right[fixed] + S.T @ right[solution.estimated],
            -(P @ deviation[solution.estimated])[places],
        ]
    )
    information = np.concatenate([np.diag(normal)[fixed], np.diag(P)[places]])
    scale = np.divide(1.0, np.sqrt(information), out=np.zeros_like(information), where=information > 0)
    values, vectors = np.linalg.eigh(M * np.outer(scale, scale))
    determined = values > DETERMINED
    along = vectors.T @ (scale * r)
    return JointTest(float(np.sum(along[determined] ** 2 / values[determined])), int(determined.sum()))


def normal_deviate_of(fall: float, dof: int) -> float:
    """Return the normal deviate u, without sign, that is as improbable as a chi-squared variable above ``fall``.

    >>> round(normal_deviate_of(9.0, 1), 6), round(normal_deviate_of(3600.0, 1), 6), normal_deviate_of(0.0, 3)
    (3.0, 60.0, 0.0)
    """
    from scipy.special import chdtrc, ndtri_exp

    if dof == 0 or fall <= 0:
        return 0.0
    probability = float(chdtrc(dof, fall))
    logarithm = np.log(probability) if probability > LEAST_PROBABILITY else _log_tail(fall, dof)
    return max(0.0, -float(ndtri_exp(logarithm - np.log(2.0))))


def _log_tail(fall: float, dof: int) -> float:
    """Return log P(χ²_ν > T) for large T.

    With a = ν / 2, x = T / 2 it is the incomplete gamma function Γ(a, x) / Γ(a), and for x > a

        Γ(a, x) = x^(a-1) e^(-x) (1 + (a-1)/x + (a-1)(a-2)/x² + ...)

    (Abramowitz & Stegun 1964, 6.5.32), whose terms are summed as long as they fall.
    """
    from scipy.special import gammaln

    a, x = dof / 2, fall / 2
    total = term = 1.0
    for k in range(1, TERMS):
        smaller = term * (a - k) / x
        if abs(smaller) >= abs(term) or smaller == 0.0:
            break
        term = smaller
        total += term
    return float(-x + (a - 1) * np.log(x) - gammaln(a) + np.log(total))
