"""Tests of single parameters: whether the points contradict the value that a parameter is fixed at, or known to have.

With S = -N_ff⁻¹ N_fh (:mod:`~pipeline.maths.adjustment.solution`): if one fixed parameter i were estimated together
with f, its value would be -(b_h + Sᵀ b_f)_i / M_ii with M = N_hh + N_hf S, and its sigma M_ii^(-1/2). Errors x_h of the
fixed parameters change the values by M x_h / M_ii. So if all a-priori errors hold, a value has the variance

    1 / M_ii + (M Q M)_ii / M_ii²,

which contains its own Q_ii. (An error of one parameter shows in the values of all that look alike. In a trial, ranges
seemed wrong by 7 mm because those on horizontal faces were, within their own sigma.)

A parameter i that is estimated with a value known beforehand, sigma q, has the estimate x_i and the variance C_ii.
Without that prior information they would be

    x_i / (1 - C_ii / q²),      C_ii / (1 - C_ii / q²),

for information adds up: 1 / C_ii is that of the points, and 1 / q². This value is compared with 0 ± q; the errors of
the fixed parameters add (S Q Sᵀ)_ii / (1 - C_ii / q²)² to its variance.
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

    expected: standard deviation of the value if all a-priori errors hold.
    """

    parameter: int
    value: float
    sigma: float
    expected: float


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
            tests.append(ParameterTest(number, value, float(np.sqrt(variance)), expected))
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
        A-priori errors of the fixed parameters, and of these.
    numbers : (k,) array
        The parameters; the values known beforehand are independent.
    """
    S = solution.sensitivity_of(numbers)
    others = np.einsum("ij,jk,ik->i", S, consider.covariance(solution.fixed), S)
    places, tests = np.searchsorted(solution.estimated, numbers), []
    for number, place, of_others in zip(numbers.tolist(), places.tolist(), others.tolist(), strict=True):
        variance, information = float(solution.covariance[place, place]), float(solution.prior[place, place])
        share = 1 - variance * information  # of the information on it that is due to the points
        if share > KNOWN_SHARE:
            expected = float(np.sqrt(variance / share + 1 / information + of_others / share**2))
            value = float(deviation[number]) / share
            tests.append(ParameterTest(number, value, float(np.sqrt(variance / share)), expected))
    return tests
