"""Solving the normal equations: step, rank, covariance, variance components, the weakest direction in words."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment import COMMON, Sums
from pipeline.maths.robust import LEAST_SCALE

Array = NDArray[np.float64]
RANK_TOLERANCE = 1e-12  # eigenvalue of the scaled normal matrix, relative to the largest


@dataclass(frozen=True)
class Solution:
    """step (k,), inverse (k, k) of the normal matrix, condition number of the scaled one, directions left open."""

    step: Array
    inverse: Array
    condition: float
    deficiency: int


def solve(sums: Sums) -> Solution:
    """Least squares step of Σ_g N_g x = Σ_g b_g, through the eigenvalues of D N D, D = diag(N)^(-1/2).

    Directions with an eigenvalue below rounding get no step; they are counted, not repaired.
    """
    normal = np.sum([group.normal for group in sums.groups.values()], axis=0)
    right = np.sum([group.right for group in sums.groups.values()], axis=0)
    diagonal = np.diag(normal)
    scale = np.where(diagonal > 0, 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), 0.0)
    values, vectors = np.linalg.eigh(normal * np.outer(scale, scale))
    largest = max(float(values[-1]), 1e-300)
    open_ = values <= RANK_TOLERANCE * largest
    inverted = np.where(open_, 0.0, 1 / np.where(open_, 1.0, values))
    inverse = (vectors * inverted) @ vectors.T * np.outer(scale, scale)
    condition = float(largest / values[0]) if values[0] > 0 else np.inf
    return Solution(inverse @ right, inverse, condition, int(open_.sum()))


def redundancies(sums: Sums, inverse: Array) -> dict[str, float]:
    """Redundancy by group: Σ weights - tr(N⁻¹ N_g) (Förstner 1979)."""
    return {name: group.weights - float(np.sum(inverse * group.normal)) for name, group in sums.groups.items()}


def variance_factors(sums: Sums, inverse: Array, current: Mapping[str, float]) -> dict[str, float]:
    """Estimated / expected variance by group: Σ w v² / σ² over the redundancy; unchanged where there is none."""
    free = redundancies(sums, inverse)
    return {
        name: max(sums.groups[name].squares / free[name], LEAST_SCALE**2) if name in free and free[name] > 1 else value
        for name, value in current.items()
    }


TOGETHER = 0.5  # a weaker correlation is not worth a word
WORDS = ("pitch", "roll", "yaw", "lever arm x", "lever arm y", "lever arm z")


def weakest_direction(covariance: Array) -> str:
    """The two of the six that are hardest to tell apart, in words: the strongest correlation of (6, 6)."""
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    above = np.triu(correlation, 1)
    row, column = divmod(int(np.argmax(np.abs(above))), COMMON)
    rho = above[row, column]
    if abs(rho) < TOGETHER:
        worst = int(np.argmax(sigma[:3])), 3 + int(np.argmax(sigma[3:]))
        return f"no two are hard to tell apart; least sure are {WORDS[worst[0]]} and {WORDS[worst[1]]}"
    return f"{WORDS[row]} and {WORDS[column]} move together (correlation {rho:+.3f})"
