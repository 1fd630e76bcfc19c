"""What the residuals say together: their means by surface and pass, which must be zero but for noise.

Observations of one moment share the INS's white noise and the timing, so that a mean's sigma comes from the scatter of
the moments, not of the points.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
CellKey = tuple[int, int]  # surface, pass


@dataclass(frozen=True)
class Moments:
    """One sensor's observations by surface, pass and slot of time: key (m, 3) ascending; sums (m, 4): Σ p, Σ p v, how
    many, Σ v²; largest (m,): |v| / σ of those that the weights did not cut."""

    key: Integers
    sums: Array
    largest: Array


def moments_of(key: Integers, weight: Array, v_m: Array, normalised: Array) -> Moments:
    """Of one batch: key (n, 3), plain weight p = 1 / σ², v and |v| / σ, zero for what was cut; (n,) each."""
    found, inverse = np.unique(key, axis=0, return_inverse=True)
    place = inverse.ravel()
    parts = (weight, weight * v_m, np.ones(len(v_m)), v_m**2)
    sums = [np.bincount(place, weights=part, minlength=len(found)) for part in parts]
    largest = np.zeros(len(found))
    np.maximum.at(largest, place, normalised)
    return Moments(found.reshape(-1, 3), np.column_stack(sums), largest)


def merged_moments(pieces: Iterable[Moments]) -> Moments:
    """All batches together, in order."""
    parts = list(pieces)
    found, inverse = np.unique(np.concatenate([one.key for one in parts]), axis=0, return_inverse=True)
    sums, largest = np.zeros((len(found), 4)), np.zeros(len(found))
    np.add.at(sums, inverse.ravel(), np.concatenate([one.sums for one in parts]))
    np.maximum.at(largest, inverse.ravel(), np.concatenate([one.largest for one in parts]))
    return Moments(found.reshape(-1, 3), sums, largest)


@dataclass(frozen=True)
class Cell:
    """Mean residual of one sensor on one surface in one pass, how far it lies from zero, and the largest residual."""

    count: int
    mean_m: float
    rms_m: float
    sigma_mean_m: float
    normalised: float
    largest: float


def cells_of(moments: Moments, tolerance_m: float) -> dict[CellKey, Cell]:
    """Weighted means Σ p v / Σ p; their sigma from the scatter of the moments, Σ (S_m - P_m mean)² / P².

    Normalised by root(sigma² + tolerance²): with a million points a systematic error far below what matters is
    significant; one below ``tolerance_m`` is not held against a session.
    """
    found: dict[CellKey, Cell] = {}
    for surface, number in np.unique(moments.key[:, :2], axis=0).tolist():
        rows = (moments.key[:, 0] == surface) & (moments.key[:, 1] == number)
        table = moments.sums[rows]
        p, pull, count, squares = table.sum(axis=0)
        mean = pull / p
        variance = float(np.sum((table[:, 1] - table[:, 0] * mean) ** 2)) / p**2
        normalised = mean / np.sqrt(variance + tolerance_m**2) if variance + tolerance_m > 0 else 0.0
        found[(surface, number)] = Cell(
            int(count),
            float(mean),
            float(np.sqrt(squares / count)),
            float(np.sqrt(variance)),
            float(normalised),
            float(moments.largest[rows].max()),
        )
    return found


def consistency_limit(cells: int, level: float) -> float:
    """Upper limit of Σ normalised² over so many cells: the chi-square quantile (conservative: nothing subtracted)."""
    return float(chdtri(max(cells, 1), level))
