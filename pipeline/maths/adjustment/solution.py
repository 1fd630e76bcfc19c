"""Solving the normal equations N x + b = 0: step, rank, covariance; what held unknowns do to it, and tests of them.

Of all unknowns some are *free* (f), the others held (h) at their values. With S = -N_ff⁻¹ N_fh,

    x_f = -N_ff⁻¹ b_f,     C = N_ff⁻¹,     dx_f = S x_h for an error x_h of what is held,
    C_total = C + S Q Sᵀ,  Q the covariance of what is considered (Gelb 1974, 7.5 "consider" filter).

A held unknown's own value, were it freed alone: -(b_h + Sᵀ b_f) / M with M = N_hh + N_hf S, its sigma M^(-1/2).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.parameters import SIX

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
RANK_TOLERANCE = 1e-12  # eigenvalue of the scaled normal matrix, relative to the largest


@dataclass(frozen=True)
class Solution:
    """Of the unknowns ``free`` (f,): step (u,) with zeros for those held, covariance (f, f), sensitivity S (f, u - f);
    condition number of the scaled normal matrix; directions left open."""

    free: Integers
    held: Integers
    step: Array
    covariance: Array
    sensitivity: Array
    condition: float
    deficiency: int

    def total(self, sigmas: Array, *blocks: tuple[Integers, Array]) -> Array:
        """Covariance with considered errors: sigmas (u,) of the held ones, independent; ``blocks`` of them (numbers
        among all unknowns, covariance) that are not."""
        return self.covariance_of(self.free, sigmas, *blocks)

    def covariance_of(self, numbers: Integers, sigmas: Array, *blocks: tuple[Integers, Array]) -> Array:
        """The same of any unknowns (k,): those that are held have their considered error alone, through which those
        that are free depend on them."""
        Q = np.diag(sigmas[self.held] ** 2)
        for among, covariance in blocks:
            place = np.searchsorted(self.held, among)
            Q[np.ix_(place, place)] = covariance
        owed, noise = self.depends(numbers), np.zeros((len(numbers), len(numbers)))
        free = np.flatnonzero(np.isin(numbers, self.free))
        place = np.searchsorted(self.free, np.asarray(numbers)[free])
        noise[np.ix_(free, free)] = self.covariance[np.ix_(place, place)]
        found = noise + owed @ Q @ owed.T
        return np.asarray((found + found.T) / 2)

    def depends(self, numbers: Integers) -> Array:
        """By how much unknowns (k,) change with the errors of those held, (k, u - f): S, or they themselves."""
        rows = np.zeros((len(numbers), len(self.held)))
        for row, number in enumerate(np.asarray(numbers).tolist()):
            if number in self.free:
                rows[row] = self.sensitivity[int(np.searchsorted(self.free, number))]
            else:
                rows[row, int(np.searchsorted(self.held, number))] = 1.0
        return rows


def solve(normal: Array, right: Array, free: Sequence[int]) -> Solution:
    """Least squares step of the free unknowns, through the eigenvalues of D N D, D = diag(N)^(-1/2).

    Directions with an eigenvalue below rounding get no step; they are counted, not repaired.
    """
    chosen = np.array(sorted(free), dtype=np.int64)
    held = np.setdiff1d(np.arange(len(right)), chosen)
    N, b = normal[np.ix_(chosen, chosen)], right[chosen]
    diagonal = np.diag(N)
    scale = np.where(diagonal > 0, 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), 0.0)
    values, vectors = np.linalg.eigh(N * np.outer(scale, scale))
    largest = max(float(values[-1]), 1e-300)
    open_ = values <= RANK_TOLERANCE * largest
    inverted = np.where(open_, 0.0, 1 / np.where(open_, 1.0, values))
    half = vectors * np.sqrt(inverted) * scale[:, None]
    covariance = half @ half.T
    covariance = (covariance + covariance.T) / 2  # to the last bit
    step = np.zeros(len(right))
    step[chosen] = -covariance @ b
    condition = float(largest / values[0]) if values[0] > 0 else np.inf
    sensitivity = -covariance @ normal[np.ix_(chosen, held)]
    return Solution(chosen, held, step, covariance, sensitivity, condition, int(open_.sum()))


@dataclass(frozen=True)
class Freed:
    """A held unknown's estimate and sigma, had it alone been freed."""

    unknown: int
    value: float
    sigma: float


def freed(normal: Array, right: Array, solution: Solution) -> list[Freed]:
    """Every held unknown, freed by itself; those on which nothing depends are left out."""
    found = []
    for place, number in enumerate(solution.held.tolist()):
        S = solution.sensitivity[:, place]
        information = float(normal[number, number] + normal[number, solution.free] @ S)
        if information > RANK_TOLERANCE * max(float(normal[number, number]), 1e-300):
            value = -float(right[number] + S @ right[solution.free]) / information
            found.append(Freed(number, value, information**-0.5))
    return found


TOGETHER = float(np.sqrt(0.75))  # a correlation that doubles both sigmas
WORDS = ("pitch", "roll", "yaw", "lever arm x", "lever arm y", "lever arm z")


def together(covariance: Array) -> tuple[int, int, float] | None:
    """The two of the six in (6, 6) that are hardest to tell apart, and their correlation ρ; None if no two are.

    With the other one known, the sigma of each would be √(1 - ρ²) of what it is: half of it at ρ = √3/2 = 0.866. From
    there on two are said to move together. A weaker correlation costs less than another pass.
    """
    sigma = np.sqrt(np.diag(covariance))
    above = np.triu(covariance / np.outer(sigma, sigma), 1)
    row, column = divmod(int(np.argmax(np.abs(above))), SIX)
    rho = float(above[row, column])
    return (row, column, rho) if abs(rho) >= TOGETHER else None


def weakest_direction(covariance: Array) -> str:
    """The two of the six that are hardest to tell apart, in words."""
    sigma, pair = np.sqrt(np.diag(covariance)), together(covariance)
    if pair is None:
        worst = int(np.argmax(sigma[:3])), 3 + int(np.argmax(sigma[3:]))
        return f"no two are hard to tell apart; least sure are {WORDS[worst[0]]} and {WORDS[worst[1]]}"
    row, column, rho = pair
    times = 1 / np.sqrt(max(1 - rho**2, 1e-6))
    return (
        f"{WORDS[row]} and {WORDS[column]} move together (correlation {rho:+.3f}): if one were known, the other's "
        f"sigma would be {times:.1f} times smaller"
    )
