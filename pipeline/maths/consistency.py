"""What the residuals say together: noise common to a moment, and means by surface and pass.

Observations of one moment share the INS's white noise and the timing; treating them as independent makes the sigmas too
small by half (2 mm and 0.002° common to a ping against 27 000 soundings). So the covariance is the sandwich

    N⁻¹ (Σ_m g_m g_mᵀ) N⁻¹,      g_m = Σ over the observations of moment m of p a v,

which needs no model of what is common (White 1980; Arellano 1987 for clusters), corrected by m / (m - u).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from pipeline.maths.adjustment import COMMON, Rows, State, weights_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
CellKey = tuple[str, int, int]  # sensor, surface, pass


@dataclass(frozen=True)
class Scores:
    """For the covariance and the consistency test: sums over moments of time.

    moment (m,) numbers ascending; scores (m, k): Σ p v a over the observations of that moment;
    cells: by (sensor, surface, pass) arrays over the same moments of Σ p and Σ p v, and totals count, Σ v².
    """

    scores: Mapping[int, Array]
    cells: Mapping[tuple[str, int, int], Mapping[int, Array]]  # moment -> (Σ p, Σ p v, count, Σ v²)


def scores_of(state: State, rows: Rows, sensor: str, number: Integers, moment: Integers) -> Scores:
    """One chunk's scores by moment and its cells; ``number``: pass, ``moment``: index of the time slot, (n,) each."""
    _, full = weights_of(state, rows)
    _, plain = weights_of(replace(state, robust=None), rows)  # a whole cell off must show, not be cut away
    pull = full * rows.residual_m
    found, inverse = np.unique(moment, return_inverse=True)
    scores = np.zeros((len(found), state.size))
    cells: dict[tuple[str, int, int], dict[int, Array]] = {}
    for surface in np.unique(rows.surface).tolist():
        inside = rows.surface == surface
        slot, columns, design = inverse[inside], state.columns(surface), rows.local[inside]
        if rows.common is not None:
            design, columns = np.hstack([rows.common[inside], design]), [*range(COMMON), *columns]
        for column, values in zip(columns, design.T, strict=True):
            scores[:, column] += np.bincount(slot, weights=values * pull[inside], minlength=len(found))
        for one in np.unique(number[inside]).tolist():
            use = inside & (number == one)
            slots, where = np.unique(inverse[use], return_inverse=True)
            residual = rows.residual_m[use]
            parts = (plain[use], plain[use] * residual, np.ones(len(residual)), residual**2)
            sums = np.column_stack([np.bincount(where, weights=part, minlength=len(slots)) for part in parts])
            cells[(sensor, surface, one)] = dict(zip(found[slots].tolist(), sums, strict=True))
    return Scores(dict(zip(found.tolist(), scores, strict=True)), cells)


def merge_scores(pieces: Iterable[Scores]) -> Scores:
    """All chunks together, in order."""
    scores: dict[int, Array] = {}
    cells: dict[tuple[str, int, int], dict[int, Array]] = {}
    for piece in pieces:
        for moment, values in piece.scores.items():
            scores[moment] = scores[moment] + values if moment in scores else values
        for key, moments in piece.cells.items():
            cell = cells.setdefault(key, {})
            for moment, values in moments.items():
                cell[moment] = cell[moment] + values if moment in cell else values
    return Scores(dict(sorted(scores.items())), dict(sorted(cells.items())))


def clustered_covariance(inverse: Array, scores: Scores) -> Array | None:
    """The sandwich from N⁻¹ (k, k); None with fewer than ten moments an unknown, where it would be noise itself."""
    table = np.array(list(scores.scores.values())).reshape(-1, len(inverse))
    moments = len(table)
    if moments < 10 * len(inverse):
        return None
    pulled = table @ inverse
    return np.asarray(pulled.T @ pulled * (moments / (moments - len(inverse))))


@dataclass(frozen=True)
class Cell:
    """Mean residual of one sensor on one surface in one pass, and how far it lies from zero."""

    count: int
    mean_m: float
    rms_m: float
    sigma_mean_m: float
    normalised: float


def cells_of(scores: Scores, tolerance_m: float) -> dict[CellKey, Cell]:
    """Weighted means Σ p v / Σ p; their sigma from the scatter of the moments, Σ (S_m - P_m mean)² / P².

    Normalised by root(sigma² + tolerance²): with a million points a systematic error far below what matters is
    significant; one below ``tolerance_m`` is not held against a session.
    """
    found = {}
    for key, moments in scores.cells.items():
        table = np.array(list(moments.values()))
        p, pull, count, squares = table.sum(axis=0)
        mean = pull / p
        variance = float(np.sum((table[:, 1] - table[:, 0] * mean) ** 2)) / p**2
        normalised = mean / np.sqrt(variance + tolerance_m**2) if variance + tolerance_m > 0 else 0.0
        found[key] = Cell(
            int(count), float(mean), float(np.sqrt(squares / count)), float(np.sqrt(variance)), normalised
        )
    return found


def consistency_limit(cells: int, level: float) -> float:
    """Upper limit of Σ normalised² over so many cells: the chi-square quantile (conservative: nothing subtracted)."""
    return float(chdtri(max(cells, 1), level))
