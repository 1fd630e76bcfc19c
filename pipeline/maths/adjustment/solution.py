"""Solution of the normal equations N x + b = 0: step, rank, covariance; effects of fixed parameters, and their tests.

Some parameters are *estimated* (f), the others *fixed* (h) at their values. With S = -N_ff⁻¹ N_fh,

    x_f = -N_ff⁻¹ b_f,     C = N_ff⁻¹,     dx_f = S x_h for an error x_h of the fixed ones,
    C_total = C + S Q Sᵀ,  Q the covariance of the consider parameters (Gelb 1974, 7.5 "consider" filter).

If one fixed parameter i were estimated together with f, its value would be -(b_h + Sᵀ b_f)_i / M_ii with
M = N_hh + N_hf S, and its sigma M_ii^(-1/2). Errors x_h of the fixed parameters change the values by M x_h / M_ii. So
if all a-priori errors hold, a value has the variance

    1 / M_ii + (M Q M)_ii / M_ii²,

which contains its own Q_ii. (An error of one parameter shows in the values of all that look alike. In a trial, ranges
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
VAGUE = 10.0  # rad or m: prior sigma that stands for no prior information
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

    step (u,), zero for the fixed ones; covariance C (f, f); sensitivity S (f, h); condition number of the scaled normal
    matrix; deficiency: number of directions that the data do not determine.
    """

    estimated: Integers
    fixed: Integers
    step: Array
    covariance: Array
    sensitivity: Array
    condition: float
    deficiency: int

    def total_covariance(self, consider: ConsiderErrors, numbers: Integers | None = None) -> Array:
        """Return the covariance (k, k) with the errors of the fixed parameters.

        Parameters
        ----------
        consider : ConsiderErrors
            Errors of the fixed parameters.
        numbers : (k,) array, optional
            Parameters, estimated or fixed; all estimated ones by default. A fixed parameter has its consider error
            alone; this error correlates the estimated parameters with it.
        """
        chosen = self.estimated if numbers is None else np.asarray(numbers)
        Q = consider.covariance(self.fixed)
        sensitivity, noise = self.sensitivity_of(chosen), np.zeros((len(chosen), len(chosen)))
        estimated = np.flatnonzero(np.isin(chosen, self.estimated))
        place = np.searchsorted(self.estimated, chosen[estimated])
        noise[np.ix_(estimated, estimated)] = self.covariance[np.ix_(place, place)]
        total = noise + sensitivity @ Q @ sensitivity.T
        return np.asarray((total + total.T) / 2)

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


def solve(normal: Array, right: Array, estimated: Sequence[int]) -> Solution:
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
        condition=float(largest / values[0]) if values[0] > 0 else np.inf,
        deficiency=int(is_open.sum()),
    )


@dataclass(frozen=True)
class ParameterTest:
    """Value and sigma that a fixed parameter would have if it were estimated as well.

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


def parameters_to_fix(normal: Array, estimated: Sequence[int], required: Array) -> dict[int, float]:
    """Return the mount parameters to fix, and the sigma that each would have had if it were estimated.

    The worst parameter is fixed, and the rest is solved again: without one of a correlated pair the second can usually
    be estimated.

    Parameters
    ----------
    normal : (u, u) array
        Normal matrix of all parameters.
    estimated : sequence of int
        Parameters that are to be estimated.
    required : (6,) array
        Sigmas required of the mount parameters.
    """
    fixed: dict[int, float] = {}
    while len(fixed) < N_MOUNT:
        left = [number for number in estimated if number not in fixed]
        prior = np.zeros(len(normal))
        prior[left] = VAGUE**-2
        solution = solve(normal + np.diag(prior), np.zeros(len(normal)), left)
        mount = [k for k in range(N_MOUNT) if k not in fixed]
        sigma = np.sqrt(np.diag(solution.covariance))[: len(mount)]
        worst = int(np.argmax(sigma / required[mount]))
        if sigma[worst] <= required[mount[worst]]:
            break
        fixed[mount[worst]] = float(sigma[worst])
    return fixed


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
