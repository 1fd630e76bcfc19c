"""Tests of single parameters: whether the points contradict the value that a parameter is fixed at, or known to have.

With S = -N_ff⁻¹ N_fh (:mod:`~pipeline.maths.adjustment.solution`): if one fixed parameter i were estimated together
with f, its value would be -(b_h + Sᵀ b_f)_i / M_ii with M = N_hh + N_hf S, and its sigma M_ii^(-1/2). Errors x_h of the
fixed parameters change the values by M x_h / M_ii. So if all a-priori errors hold, a value has the variance

    1 / M_ii + (M Q M)_ii / M_ii²,

which contains its own Q_ii. (An error of one parameter shows in the values of all that look alike. In a trial, ranges
seemed wrong by 7 mm because those on horizontal faces were, within their own sigma.)

Let parameters be estimated with values known beforehand, whose covariance is Q, P = Q⁻¹. The solution deviates by d
from these values, their misclosure, with the covariance Q - C. The test of one pseudo-observation (Baarda 1968, "A
testing procedure for use in geodetic networks") gives the error that value i would have if it alone were wrong, and
the variance of that if all a-priori errors hold:

    (P d)_i / W_ii,      1 / W_ii,      W = P (Q - C) P = P - P C P.

1 / P_ii of this variance is due to the value itself, the rest to the points and the other values. For independent
values with sigmas q, W_ii = (1 - C_ii / q²) / q², and the parameter would be d_i / (1 - C_ii / q²) without its prior
information: information adds up. Errors x_h of the fixed parameters change d by S x_h, and so this by (P S x_h)_i /
W_ii.

If that parameter is freed, the least sum of squares J, in which the values known beforehand count as observations,
falls by M_ii times the square of its value, or by W_ii times that. The root of this fall is the parameter's *strength*.
All falls are from the same J, so that strengths can be compared (Teunissen 2018, "Distributional theory for the DIA
method", 3.2). Fixed parameters count as exact there: a strength says how much an error explains, not how likely it was
before the measurements.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.solution import RANK_TOLERANCE, ConsiderErrors, Solution

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
KNOWN_SHARE = 1e-6  # least share of the information that counts


@dataclass(frozen=True)
class ParameterTest:
    """Value and sigma that a parameter would have without what is known of it: if it were not fixed, or had no prior.

    expected: standard deviation of the value if all a-priori errors hold; strength: root of the fall of J.
    """

    parameter: int
    value: float
    sigma: float
    expected: float
    strength: float


def single_parameter_tests(
    normal: Array, right: Array, solution: Solution, consider: ConsiderErrors
) -> list[ParameterTest]:
    """Return the single-parameter test of each fixed parameter.

    Parameters that the observations cannot determine beside the estimated ones are left out.

    Parameters
    ----------
    normal : (u, u) array
        Normal matrix N of all parameters.
    right : (u,) array
        Right side b.
    solution : Solution
        Solution of these normal equations.
    consider : ConsiderErrors
        A-priori errors of the fixed parameters.
    """
    fixed, S = solution.fixed, solution.sensitivity
    M = normal[np.ix_(fixed, fixed)] + normal[np.ix_(fixed, solution.estimated)] @ S
    values = -(right[fixed] + S.T @ right[solution.estimated])
    a_priori = np.einsum("ij,jk,ik->i", M, consider.covariance(fixed), M)
    tests = []
    for place, number in enumerate(fixed.tolist()):
        information = float(M[place, place])
        if information > RANK_TOLERANCE * max(float(normal[number, number]), 1e-300):
            value, variance = float(values[place]) / information, 1 / information
            expected = float(np.sqrt(variance + a_priori[place] / information**2))
            strength = abs(value) * float(np.sqrt(information))
            tests.append(ParameterTest(number, value, float(np.sqrt(variance)), expected, strength))
    return tests


def prior_parameter_tests(
    solution: Solution, deviation: Array, consider: ConsiderErrors, numbers: Integers
) -> list[ParameterTest]:
    """Return the single-parameter test of each estimated parameter with a value known beforehand.

    Parameters that the points cannot determine are left out.

    Parameters
    ----------
    solution : Solution
        Solution of the normal equations.
    deviation : (u,) array
        Deviations from the values known beforehand, after the solution's step.
    consider : ConsiderErrors
        A-priori errors of the fixed parameters.
    numbers : (k,) array
        All parameters with a value known beforehand.
    """
    places = np.searchsorted(solution.estimated, numbers)
    P, C = (matrix[np.ix_(places, places)] for matrix in (solution.prior, solution.covariance))
    W, misclosure = P - P @ C @ P, P @ deviation[numbers]
    effects = P @ solution.sensitivity_of(numbers)
    others = np.einsum("ij,jk,ik->i", effects, consider.covariance(solution.fixed), effects)
    tests = []
    for k, number in enumerate(numbers.tolist()):
        information, own = float(W[k, k]), float(P[k, k])
        if information > KNOWN_SHARE * own:
            expected = float(np.sqrt(1 / information + others[k] / information**2))
            sigma = float(np.sqrt(max(1 / information - 1 / own, 0.0)))
            value = float(misclosure[k]) / information
            tests.append(ParameterTest(number, value, sigma, expected, abs(value) * float(np.sqrt(information))))
    return tests
