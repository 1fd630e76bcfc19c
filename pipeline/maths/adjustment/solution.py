"""Solution of the normal equations N x + b = 0: step, rank, covariance; effects of fixed parameters.

Some parameters are *estimated* (f), the others *fixed* (h) at their values. With S = -N_ff⁻¹ N_fh,

    x_f = -N_ff⁻¹ b_f,     C = N_ff⁻¹,     dx_f = S x_h for an error x_h of the fixed ones,
    C_total = C + S Q Sᵀ,  Q the covariance of the consider parameters (Gelb 1974, 7.5 "consider" filter).

N contains prior information as well (:mod:`~pipeline.maths.adjustment.pseudo_observations`): N = N_points + P. Of the
covariance C, the part C P C is due to errors of the prior information, so that the noise of the points alone gives
C - C P C. Let parameters have values known beforehand, with the covariance Q, P = Q⁻¹. Errors h of these values change
the parameters by C P h. With any F for which F Fᵀ = P, C F Fᵀ C is their part C P C of the covariance: the columns of
C F are effects of independent errors. Here F = D R^(1/2), D the roots of the diagonal of P and D R D = P; without
correlations, this is the effect C_·i / q of one sigma q of each value.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.mount_parameters import MOUNT_WORDS, N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
RANK_TOLERANCE = 1e-12  # eigenvalue of the scaled normal matrix, relative to the largest
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
        noise = C - C @ self.prior @ C
        return self._among((noise + noise.T) / 2, self.estimated if numbers is None else np.asarray(numbers))

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

    def group_effects(self, numbers: Integers, group: Integers) -> Array:
        """Return k changes (k, k) of parameters (k,) by independent errors in the prior information of a group.

        They are the columns of the symmetric root of E = (C P C)_kk, P restricted to the group, in units of the
        parameters' sigmas. Of all roots of E it is the one that changes least with E. So effects of two sessions with
        the same prior information and nearly the same geometry are nearly equal, column by column.

        Parameters
        ----------
        numbers : (k,) array
            Estimated parameters.
        group : (g,) array
            Estimated parameters, whose prior information is not connected with that of others.
        """
        rows, places = np.searchsorted(self.estimated, numbers), np.searchsorted(self.estimated, group)
        sigma = np.sqrt(np.diag(self.covariance)[rows])
        by_group = self.covariance[np.ix_(rows, places)] / sigma[:, None]
        values, vectors = np.linalg.eigh(by_group @ self.prior[np.ix_(places, places)] @ by_group.T)
        return np.asarray(sigma[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)

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
        return f"no correlation of two reaches {CORRELATION_LIMIT:.2f}; the least certain are {first} and {second}"
    row, column, rho = pair
    times = 1 / np.sqrt(max(1 - rho**2, 1e-6))
    return (
        f"{MOUNT_WORDS[row]} and {MOUNT_WORDS[column]} move together (correlation {rho:+.3f}): if one were known, the "
        f"other's sigma would be {times:.1f} times smaller"
    )
