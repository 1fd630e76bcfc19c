"""Solution of the normal equations N x + b = 0: step, rank, covariance; effects of fixed parameters, and their tests.

Some parameters are *estimated* (f), the others *fixed* (h) at their values. With S = -N_ff⁻¹ N_fh,

    x_f = -N_ff⁻¹ b_f,     C = N_ff⁻¹,     dx_f = S x_h for an error x_h of the fixed ones,
    C_total = C + S Q Sᵀ,  Q the covariance of the consider parameters (Gelb 1974, 7.5 "consider" filter).

If one fixed parameter i were estimated together with f, its value would be -(b_h + Sᵀ b_f)_i / M_ii with
M = N_hh + N_hf S, and its sigma M_ii^(-1/2). Errors x_h of the fixed parameters change the values by M x_h / M_ii. So
if all a-priori errors hold, a value has the variance

    1 / M_ii + (M Q M)_ii / M_ii²,

which contains its own Q_ii.

N contains prior information as well (:mod:`~pipeline.maths.adjustment.pseudo_observations`): N = N_points + P. Of the
covariance C, the part C P C is due to errors of the prior information, so that the noise of the points alone gives
C - C P C. Let parameters have values known beforehand, with the covariance Q, P = Q⁻¹. Errors h of these values change
the parameters by C P h. With any F for which F Fᵀ = P, C F Fᵀ C is their part C P C of the covariance: the columns of
C F are effects of independent errors. Here F = D R^(1/2), D the roots of the diagonal of P and D R D = P; without
correlations, this is the effect C_·i / q of one sigma q of each value.

The solution deviates by d from these values, which is their misclosure. It has the covariance Q - C, and the test of
one pseudo-observation (Baarda 1968, "A testing procedure for use in geodetic networks") gives the error that value i
would have if it alone were wrong, with its variance if all a-priori errors hold:

    (P d)_i / W_ii,      1 / W_ii,      W = P (Q - C) P = P - P C P.

1 / P_ii of this variance are due to the value itself, the rest to the points and the other values. For independent
values, W_ii = (1 - C_ii / q²) / q², and the parameter would be d_i / (1 - C_ii / q²) without its prior information.
Errors x_h of the fixed parameters change d by S x_h, and so this value by (P S x_h)_i / W_ii.

(An error of one parameter shows in the values of all that look alike. In a trial, ranges
seemed wrong by 7 mm because those on horizontal faces were, within their own sigma.)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.mount_parameters import MOUNT_WORDS, N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
RANK_TOLERANCE = 1e-12  # eigenvalue of the scaled normal matrix, relative to the largest
KNOWN_SHARE = 1e-6  # least share of the information that counts
CORRELATION_LIMIT = float(np.sqrt(0.75))  # a correlation that doubles both sigmas


@dataclass(frozen=True)
class ConsiderErrors:
    """A-priori errors of the parameters; only those of the fixed parameters are used.

    sigmas (u,): standard deviations of independent parameters; blocks: places (k,) of parameters that are not
    independent, and their covariance (k, k), which replaces their sigmas.
    """

    sigmas: Array
    blocks: Sequence[tuple[Integers, Array]] = ()

    def covariance(self, fixed: Integers) -> Array:
        """Return the covariance Q (h, h) of the fixed parameters (h,), ascending."""
        Q = np.diag(self.sigmas[fixed] ** 2)
        for numbers, covariance in self.blocks:
            inside = np.flatnonzero(np.isin(numbers, fixed))
            place = np.searchsorted(fixed, numbers[inside])
            Q[np.ix_(place, place)] = covariance[np.ix_(inside, inside)]
        return Q


@dataclass(frozen=True)
class Solution:
    """Solution for the parameters ``estimated`` (f,), the others ``fixed`` (h,).

    step (u,), zero for the fixed ones; covariance C (f, f); sensitivity S (f, h); prior information P (f, f) that the
    normal matrix contains; condition number of the scaled normal matrix; deficiency: number of directions that the data
    do not determine.
    """

    estimated: Integers
    fixed: Integers
    step: Array
    covariance: Array
    sensitivity: Array
    prior: Array
    condition: float
    deficiency: int

    def total_covariance(self, consider: ConsiderErrors, numbers: Integers | None = None) -> Array:
        """Return the covariance (k, k) with the errors of the fixed parameters and of the prior information.

        Parameters
        ----------
        consider : ConsiderErrors
            Errors of the fixed parameters.
        numbers : (k,) array, optional
            Parameters, estimated or fixed; all estimated ones by default. A fixed parameter has its consider error
            alone; this error correlates the estimated parameters with it.
        """
        chosen = self.estimated if numbers is None else np.asarray(numbers)
        sensitivity = self.sensitivity_of(chosen)
        total = self._among(self.covariance, chosen) + sensitivity @ consider.covariance(self.fixed) @ sensitivity.T
        return np.asarray((total + total.T) / 2)

    def noise_covariance(self, numbers: Integers | None = None) -> Array:
        """Return the covariance (k, k) C - C P C due to the noise of the points; zero for fixed parameters."""
        C = self.covariance
        return self._among(C - C @ self.prior @ C, self.estimated if numbers is None else np.asarray(numbers))

    def prior_effects(self, numbers: Integers, known: Integers) -> Array:
        """Return the change C F (k, m) of parameters by independent errors, of one sigma, of values known beforehand.

        Parameters
        ----------
        numbers : (k,) array
            Parameters, estimated.
        known : (m,) array
            All parameters with a value known beforehand, estimated.
        """
        rows, columns = (np.searchsorted(self.estimated, chosen) for chosen in (numbers, known))
        P = self.prior[np.ix_(columns, columns)]
        scale = np.sqrt(np.diag(P))
        values, vectors = np.linalg.eigh(P / np.outer(scale, scale))
        root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
        return np.asarray(self.covariance[np.ix_(rows, columns)] @ (scale[:, None] * root))

    def _among(self, covariance: Array, chosen: Integers) -> Array:
        """Return the part (k, k) of a covariance (f, f) of the estimated parameters; zero for fixed ones."""
        part = np.zeros((len(chosen), len(chosen)))
        estimated = np.flatnonzero(np.isin(chosen, self.estimated))
        place = np.searchsorted(self.estimated, chosen[estimated])
        part[np.ix_(estimated, estimated)] = covariance[np.ix_(place, place)]
        return part

    def sensitivity_of(self, numbers: Integers) -> Array:
        """Return the sensitivity (k, h) of parameters (k,) to errors of the fixed ones.

        The row of an estimated parameter is its row of S; the row of a fixed one is its row of the unit matrix.
        """
        rows = np.zeros((len(numbers), len(self.fixed)))
        for row, number in enumerate(np.asarray(numbers).tolist()):
            if number in self.estimated:
                rows[row] = self.sensitivity[int(np.searchsorted(self.estimated, number))]
            else:
                rows[row, int(np.searchsorted(self.fixed, number))] = 1.0
        return rows


def solve(normal: Array, right: Array, estimated: Sequence[int], prior: Array | None = None) -> Solution:
    """Return the least squares step of the estimated parameters, through the eigenvalues of D N D, D = diag(N)^(-1/2).

    Directions with an eigenvalue below rounding get no step; they are counted, not repaired.

    Parameters
    ----------
    normal : (u, u) array
        Normal matrix N of all parameters.
    right : (u,) array
        Right side b.
    estimated : sequence of int
        The parameters to estimate.
    prior : (u, u) array, optional
        The part of N that is due to prior information; none by default.
    """
    chosen = np.array(sorted(estimated), dtype=np.int64)
    fixed = np.setdiff1d(np.arange(len(right)), chosen)
    N, b = normal[np.ix_(chosen, chosen)], right[chosen]
    diagonal = np.diag(N)
    scale = np.where(diagonal > 0, 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), 0.0)
    values, vectors = np.linalg.eigh(N * np.outer(scale, scale))
    largest = max(float(values[-1]), 1e-300)
    is_open = values <= RANK_TOLERANCE * largest
    inverted = np.where(is_open, 0.0, 1 / np.where(is_open, 1.0, values))
    half = vectors * np.sqrt(inverted) * scale[:, None]
    covariance = half @ half.T
    covariance = (covariance + covariance.T) / 2  # symmetric to the last bit
    step = np.zeros(len(right))
    step[chosen] = -covariance @ b
    return Solution(
        estimated=chosen,
        fixed=fixed,
        step=step,
        covariance=covariance,
        sensitivity=-covariance @ normal[np.ix_(chosen, fixed)],
        prior=np.zeros_like(N) if prior is None else prior[np.ix_(chosen, chosen)],
        condition=float(largest / values[0]) if values[0] > 0 else np.inf,
        deficiency=int(is_open.sum()),
    )


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
            tests.append(ParameterTest(number, float(misclosure[k]) / information, sigma, expected))
    return tests


def correlated_pair(covariance: Array) -> tuple[int, int, float] | None:
    """Return the most strongly correlated two mount parameters in (6, 6) and their correlation ρ, or None.

    If one of them were known, the sigma of the second would be smaller by the factor √(1 - ρ²): half at
    ρ = √3/2 = 0.866. From this limit on, two parameters are said to move together. A weaker correlation costs less than
    another pass.
    """
    sigma = np.sqrt(np.diag(covariance))
    above = np.triu(covariance / np.outer(sigma, sigma), 1)
    row, column = divmod(int(np.argmax(np.abs(above))), N_MOUNT)
    rho = float(above[row, column])
    return (row, column, rho) if abs(rho) >= CORRELATION_LIMIT else None


def weakest_direction(covariance: Array) -> str:
    """Return a text that names the two mount parameters in (6, 6) that are hardest to tell apart."""
    sigma, pair = np.sqrt(np.diag(covariance)), correlated_pair(covariance)
    if pair is None:
        worst = int(np.argmax(sigma[:3])), 3 + int(np.argmax(sigma[3:]))
        first, second = (MOUNT_WORDS[k] for k in worst)
        return f"no two are strongly correlated; the least certain are {first} and {second}"
    row, column, rho = pair
    times = 1 / np.sqrt(max(1 - rho**2, 1e-6))
    return (
        f"{MOUNT_WORDS[row]} and {MOUNT_WORDS[column]} move together (correlation {rho:+.3f}): if one were known, the "
        f"other's sigma would be {times:.1f} times smaller"
    )
