"""Means of residuals by bin, differences of two means, and the standard deviation of each.

Observations close in time share the INS's white noise and the timing. So a mean's sigma comes from the scatter of
*slots*, short equal stretches of time, not of points. A mean is M = Σ S_m / P over slots m with P_m = Σ p, S_m = Σ p v,
P = Σ P_m, and

    sigma² = max( Σ (S_m - P_m M)² / P² · n / (n - 1),  1 / P ),   n = P² / Σ P_m²

n is the number of equally heavy slots with the same information (Kish 1965, "Survey sampling"), n - 1 the degrees of
freedom. 1 / P is the variance from the observations' own noise alone, without errors that a slot shares. A few slots
that agree by chance are no better than that.

Where n - 1 < 8, Student's quantile at the levels of interest is so large that nothing would be rejected. There the
bin's scatter is combined with the scatter of all slots of the surface, which has the weight of 8 degrees of freedom
(Smyth 2004, "Linear models and empirical Bayes methods for assessing differential expression"):

    sigma² = (8 u² + (n - 1) sigma_own²) / (8 + n - 1),   u² = 1 / P + c² / n,
    c² = max(0, Σ ((S_m - P_m M)² - P_m) / Σ P_m²) over all bins of the surface, with 8 + n - 1 degrees of freedom.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import block
from pipeline.maths.kernels.residual_bins import add_residuals

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SPARSE = 10  # cells (bins times slots) per point above which only cells with points get a number
FEW = 8.0  # degrees of freedom below which the surface's other slots are used as well
ALONE = 1.001  # largest effective number of slots of a mean without scatter
FEWEST, FEWEST_SLOTS, FEWEST_DOF = 30, 5, 8.0  # least points, slots and degrees of freedom of a mean that is tested
REACH = 4  # number of bins on either side of a step
Comparison = Literal["bins", "rest", "steps"]


@dataclass(frozen=True)
class BinnedResiduals:
    """Residuals of one batch, (n,) each.

    first, second: the two numbers of the bin; slot: number of the slot of time; weight: weight p = 1 / σ²; v_m:
    residual; normalised: |v| / σ, zero if the robust weight is zero.
    """

    first: Integers
    second: Integers
    slot: Integers
    weight: Array
    v_m: Array
    normalised: Array


@dataclass(frozen=True)
class ResidualSums:
    """Sums of one sensor's residuals by bin (two numbers) and slot of time.

    key (m, 3) ascending; sums (m, 4): Σ p, Σ p v, number of points, Σ v²; largest (m,): largest |v| / σ among the
    points that have a weight.
    """

    key: Integers
    sums: Array
    largest: Array


def residual_sums(residuals: BinnedResiduals) -> ResidualSums:
    """Return the sums of one batch."""
    weight, v_m = residuals.weight, residuals.v_m
    if not len(v_m):
        return ResidualSums(np.empty((0, 3), dtype=np.int64), np.empty((0, 4)), np.empty(0))
    code, lows, spans = _codes((residuals.first, residuals.second, residuals.slot))
    length = int(np.prod(spans))
    codes = None
    if length > SPARSE * len(code):
        codes, code = np.unique(code, return_inverse=True)
        length = len(codes)
    sums, largest = np.zeros((length, 4)), np.zeros(length)
    add_residuals(block(code), block(weight), block(v_m), block(residuals.normalised), sums, largest)
    filled = np.flatnonzero(sums[:, 2])
    return ResidualSums(_keys(filled if codes is None else codes[filled], lows, spans), sums[filled], largest[filled])


def merged_residual_sums(pieces: Iterable[ResidualSums]) -> ResidualSums:
    """Return the sums of all batches together, in order."""
    parts = [part for part in pieces if len(part.key)]
    if not parts:
        return ResidualSums(np.empty((0, 3), dtype=np.int64), np.empty((0, 4)), np.empty(0))
    code, lows, spans = _codes(np.concatenate([part.key for part in parts]).T)
    order = np.argsort(code, kind="stable")
    first = np.flatnonzero(np.diff(code[order], prepend=-1))
    sums = np.add.reduceat(np.concatenate([part.sums for part in parts])[order], first)
    largest = np.maximum.reduceat(np.concatenate([part.largest for part in parts])[order], first)
    return ResidualSums(_keys(code[order[first]], lows, spans), sums, largest)


def _codes(columns: Sequence[Integers] | Integers) -> tuple[Integers, list[int], list[int]]:
    """Return one number (n,) for the three of each key, in their order, and the lowest and the span of each of them."""
    lows = [int(column.min()) for column in columns]
    spans = [int(column.max()) - low + 1 for column, low in zip(columns, lows, strict=True)]
    shifted = [column - low for column, low in zip(columns, lows, strict=True)]
    return (shifted[0] * spans[1] + shifted[1]) * spans[2] + shifted[2], lows, spans


def _keys(codes: Integers, lows: Sequence[int], spans: Sequence[int]) -> Integers:
    """Return the keys (m, 3) of these numbers (m,)."""
    return np.column_stack(np.unravel_index(codes, spans)) + lows


@dataclass(frozen=True)
class BinMean:
    """Mean residual of one sensor in one bin, or the difference of two means.

    key: the two numbers of the bin; count, slots: number of points and of slots of time (for a difference, the smaller
    numbers of the two means); dof: degrees of freedom of sigma_mean_m; largest: largest |v| / σ.
    """

    key: tuple[int, int]
    count: int
    slots: int
    mean_m: float
    rms_m: float
    sigma_mean_m: float
    dof: float
    largest: float


@dataclass(frozen=True)
class _SlotSums:
    """Slots of one bin or several: their numbers, ascending, with Σ p and Σ p v, (k,) each; mean; number of points."""

    slots: Integers
    weight: Array
    weighted: Array
    mean: float
    count: int

    @classmethod
    def of(cls, rows: tuple[Integers, Array]) -> "_SlotSums":
        slots, sums = rows
        numbers, inverse = np.unique(slots, return_inverse=True)
        p, pv = np.zeros((2, len(numbers)))
        np.add.at(p, inverse, sums[:, 0])
        np.add.at(pv, inverse, sums[:, 1])
        return cls(numbers, p, pv, float(pv.sum() / p.sum()), int(sums[:, 2].sum()))

    @property
    def effective(self) -> float:
        """Return the effective number of slots: of equally heavy slots with the same information."""
        return float(self.weight.sum() ** 2 / (self.weight @ self.weight))

    @property
    def parts(self) -> Array:
        """Return each slot's contribution (k,) to the error of the mean, corrected for the mean's degree of freedom."""
        n = self.effective
        unbiased = np.sqrt(n / (n - 1)) if n > ALONE else 1.0
        return np.asarray((self.weighted - self.weight * self.mean) / self.weight.sum()) * unbiased

    @property
    def least_variance(self) -> float:
        """Return the variance of the mean from the noise of the points alone."""
        return float(1 / self.weight.sum())


def bin_means(sums: ResidualSums) -> list[BinMean]:
    """Return the mean of each bin."""
    bins = [(key, rows, _SlotSums.of(_slots(sums, rows))) for key, rows in _bins(sums)]
    of_surface: dict[int, list[_SlotSums]] = {}
    for key, _, slots in bins:
        of_surface.setdefault(key[0], []).append(slots)
    common = {surface: _common_variance(slots) for surface, slots in of_surface.items()}
    means = []
    for key, rows, slots in bins:
        squares, n = float(sums.sums[rows, 3].sum()) / slots.count, slots.effective
        variance, dof = (float(slots.parts @ slots.parts), n - 1) if n > ALONE else (0.0, 0.0)
        if dof < FEW:
            usual = slots.least_variance + common[key[0]] / n
            variance, dof = (FEW * usual + dof * variance) / (FEW + dof), FEW + dof
        means.append(
            BinMean(
                key=key,
                count=slots.count,
                slots=len(slots.slots),
                mean_m=slots.mean,
                rms_m=float(np.sqrt(squares)),
                sigma_mean_m=float(np.sqrt(max(variance, slots.least_variance))),
                dof=dof,
                largest=float(sums.largest[rows].max()),
            )
        )
    return means


def tested_means(sums: ResidualSums, compared: Comparison) -> list[BinMean]:
    """Return the means to test: each bin's mean, or its difference from the rest, or the steps between bins.

    Means of too few points, slots or degrees of freedom are left out.
    """
    if compared == "rest":
        means = differences_from_rest(sums)
    else:
        means = step_differences(sums, REACH) if compared == "steps" else bin_means(sums)
    return [mean for mean in means if mean.count >= FEWEST and mean.slots >= FEWEST_SLOTS and mean.dof >= FEWEST_DOF]


def _common_variance(bins: list[_SlotSums]) -> float:
    """Return the variance c² of the error that a slot's points share, from the slots' scatter about the bins' means."""
    scatter = sum(float(np.sum((slots.weighted - slots.weight * slots.mean) ** 2 - slots.weight)) for slots in bins)
    return max(0.0, scatter / sum(float(slots.weight @ slots.weight) for slots in bins))


def differences_from_rest(sums: ResidualSums) -> list[BinMean]:
    """Return each bin's mean minus the mean of all other bins with the same first number, if there are others."""
    differences = []
    for key, rows in list(_bins(sums)):
        rest = sums.key[:, 0] == key[0]
        rest[rows] = False
        if rest.any():
            differences.append(_difference(key, _slots(sums, rows), (sums.key[rest, 2], sums.sums[rest])))
    return differences


def step_differences(sums: ResidualSums, reach: int) -> list[BinMean]:
    """Return for each border between bins the mean of the ``reach`` bins after it minus that of the bins before it.

    The key's second number is the bin that begins at the border.
    """
    differences = []
    for first in np.unique(sums.key[:, 0]).tolist():
        low, high = np.searchsorted(sums.key[:, 0], [first, first + 1]).tolist()
        second = sums.key[low:high, 1]
        for border in range(int(second[0]) + 1, int(second[-1]) + 1) if len(second) else ():
            start, at, stop = (low + np.searchsorted(second, [border - reach, border, border + reach])).tolist()
            if start < at < stop:
                above, below = _slots(sums, slice(at, stop)), _slots(sums, slice(start, at))
                differences.append(_difference((first, border), above, below))
    return differences


def _bins(sums: ResidualSums) -> Iterator[tuple[tuple[int, int], slice]]:
    """Yield each bin's two numbers and its rows."""
    bins, starts = np.unique(sums.key[:, :2], axis=0, return_index=True)
    ends = np.append(starts[1:], len(sums.key))
    for (first, second), start, end in zip(bins.tolist(), starts.tolist(), ends.tolist(), strict=True):
        yield (int(first), int(second)), slice(start, end)


def _slots(sums: ResidualSums, rows: slice) -> tuple[Integers, Array]:
    return sums.key[rows, 2], sums.sums[rows]


def _difference(key: tuple[int, int], rows: tuple[Integers, Array], reference: tuple[Integers, Array]) -> BinMean:
    """Return the mean of ``rows`` minus the mean of ``reference``.

    A slot in both shares its noise, so its two contributions are subtracted before they are squared. Degrees of
    freedom: Welch 1947, "The generalization of Student's problem".
    """
    first, second = _SlotSums.of(rows), _SlotSums.of(reference)
    difference = BinMean(
        key=key,
        count=min(first.count, second.count),
        slots=min(len(first.slots), len(second.slots)),
        mean_m=first.mean - second.mean,
        rms_m=np.nan,
        sigma_mean_m=np.inf,
        dof=0.0,
        largest=np.nan,
    )
    if min(first.effective, second.effective) <= ALONE:
        return difference
    slots = np.union1d(first.slots, second.slots)
    parts = np.zeros(len(slots))
    parts[np.searchsorted(slots, first.slots)] = first.parts
    parts[np.searchsorted(slots, second.slots)] -= second.parts
    sides = (first, second)
    variances = [max(float(side.parts @ side.parts), side.least_variance) for side in sides]
    dof = sum(variances) ** 2 / sum(v**2 / (side.effective - 1) for v, side in zip(variances, sides, strict=True))
    variance = max(float(parts @ parts), first.least_variance + second.least_variance)
    return replace(difference, sigma_mean_m=float(np.sqrt(variance)), dof=dof)
