"""What the residuals say together: their means by any bin, which must be zero but for noise.

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


@dataclass(frozen=True)
class Moments:
    """One sensor's observations by bin (two numbers) and slot of time: key (m, 3) ascending; sums (m, 4): Σ p, Σ p v,
    how many, Σ v²; largest (m,): |v| / σ of those that the weights did not cut."""

    key: Integers
    sums: Array
    largest: Array


def moments_of(first: Integers, second: Integers, slot: Integers, weight: Array, v_m: Array, size: Array) -> Moments:
    """Of one batch: bin and slot, plain weight p = 1 / σ², v, and |v| / σ, zero for what was cut; (n,) each."""
    if not len(v_m):
        return Moments(np.empty((0, 3), dtype=np.int64), np.empty((0, 4)), np.empty(0))
    columns = (first, second, slot)
    lows = [int(column.min()) for column in columns]
    spans = [int(column.max()) - low + 1 for column, low in zip(columns, lows, strict=True)]
    code = np.ravel_multi_index([column - low for column, low in zip(columns, lows, strict=True)], spans)
    length = int(np.prod(spans))
    count = np.bincount(code, minlength=length)
    found = np.flatnonzero(count)
    parts = (np.bincount(code, weights=part, minlength=length)[found] for part in (weight, weight * v_m, v_m**2))
    p, pv, squares = parts
    largest = np.zeros(length)
    np.maximum.at(largest, code, size)
    key = np.column_stack(np.unravel_index(found, spans)) + lows
    return Moments(key, np.column_stack([p, pv, count[found], squares]), largest[found])


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
    """Mean residual of one sensor in one bin, how far it lies from zero, and the largest residual."""

    key: tuple[int, int]
    count: int
    moments: int
    mean_m: float
    rms_m: float
    sigma_mean_m: float
    normalised: float
    largest: float


def cells_of(moments: Moments, tolerance_m: float) -> list[Cell]:
    """Weighted means Σ p v / Σ p; their sigma from the scatter of the moments, Σ (S_m - P_m mean)² / P².

    Normalised by root(sigma² + tolerance²): with a million points a systematic error far below what matters is
    significant; one below ``tolerance_m`` is not held against a session.
    """
    found = []
    bins, starts = np.unique(moments.key[:, :2], axis=0, return_index=True)
    ends = np.append(starts[1:], len(moments.key))
    for (first, second), start, end in zip(bins.tolist(), starts, ends, strict=True):
        table = moments.sums[start:end]
        p, pull, count, squares = table.sum(axis=0)
        mean = pull / p
        variance = float(np.sum((table[:, 1] - table[:, 0] * mean) ** 2)) / p**2
        normalised = mean / np.sqrt(variance + tolerance_m**2) if variance + tolerance_m > 0 else 0.0
        found.append(
            Cell(
                (first, second),
                int(count),
                end - start,
                float(mean),
                float(np.sqrt(squares / count)),
                float(np.sqrt(variance)),
                float(normalised),
                float(moments.largest[start:end].max()),
            )
        )
    return found


def consistency_limit(cells: int, level: float) -> float:
    """Upper limit of Σ normalised² over so many cells: the chi-square quantile (conservative: nothing subtracted)."""
    return float(chdtri(max(cells, 1), level))
