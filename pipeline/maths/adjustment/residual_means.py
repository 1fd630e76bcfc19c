"""What the residuals say together: their means by any bin, how they differ between bins, and how sure each is.

Observations of one moment share the INS's white noise and the timing, so that a mean's sigma comes from the scatter of
the moments, not of the points. A mean is M = Σ S_m / P over moments m with P_m = Σ p, S_m = Σ p v, P = Σ P_m, and

    sigma² = max( Σ (S_m - P_m M)² / P² · n / (n - 1),  1 / P ),   n = P² / Σ P_m²

n is the number of equally heavy moments that would tell as much (Kish 1965, "Survey sampling"), n - 1 the degrees of
freedom. 1 / P is what the observations' own noise leaves where moments share nothing: a few moments that lie close
together by chance are no better than that.

Where n - 1 < 8, Student's quantile at the levels of interest is so large that nothing would be found; there the scatter
is taken together with what the surface's moments have everywhere, as if that were 8 moments' own (Smyth 2004, "Linear
models and empirical Bayes methods for assessing differential expression"):

    sigma² = (8 u² + (n - 1) sigma_own²) / (8 + n - 1),   u² = 1 / P + c² / n,
    c² = max(0, Σ ((S_m - P_m M)² - P_m) / Σ P_m²) over all bins of the surface, with 8 + n - 1 degrees of freedom.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SPARSE = 10  # bins and slots, as a multiple of the points, that are not counted out one by one
FEW = 8.0  # degrees of freedom below which the surface's other moments are asked as well
ALONE = 1.001  # equal moments, at most, of what has no scatter


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
    codes = np.arange(length)
    if length > SPARSE * len(code):
        codes, code = np.unique(code, return_inverse=True)
        length = len(codes)
    count = np.bincount(code, minlength=length)
    found = np.flatnonzero(count)
    parts = (np.bincount(code, weights=part, minlength=length)[found] for part in (weight, weight * v_m, v_m**2))
    p, pv, squares = parts
    largest = np.zeros(length)
    np.maximum.at(largest, code, size)
    key = np.column_stack(np.unravel_index(codes[found], spans)) + lows
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
    """Mean residual of one sensor in one bin, or how much two means differ; its sigma, with which degrees of freedom;
    how many points and moments it has (of two the fewer), and the largest residual."""

    key: tuple[int, int]
    count: int
    moments: int
    mean_m: float
    rms_m: float
    sigma_mean_m: float
    dof: float
    largest: float


@dataclass(frozen=True)
class _Side:
    """Moments of one bin, or of several: slots ascending (k,), Σ p, Σ p v of each (k,); mean, how many points."""

    slots: Integers
    weight: Array
    pull: Array
    mean: float
    count: int

    @classmethod
    def of(cls, slots: Integers, sums: Array) -> "_Side":
        found, inverse = np.unique(slots, return_inverse=True)
        p, pv = np.zeros((2, len(found)))
        np.add.at(p, inverse, sums[:, 0])
        np.add.at(pv, inverse, sums[:, 1])
        return cls(found, p, pv, float(pv.sum() / p.sum()), int(sums[:, 2].sum()))

    @property
    def equal(self) -> float:
        """How many equally heavy moments tell as much."""
        return float(self.weight.sum() ** 2 / (self.weight @ self.weight))

    @property
    def parts(self) -> Array:
        """What each moment adds to the error of the mean (k,), freed of what the mean itself took from the scatter."""
        free = np.sqrt(self.equal / (self.equal - 1)) if self.equal > ALONE else 1.0
        return np.asarray((self.pull - self.weight * self.mean) / self.weight.sum()) * free

    @property
    def least(self) -> float:
        """The mean's variance, were the noise of the points all there is."""
        return float(1 / self.weight.sum())


def cells_of(moments: Moments) -> list[Cell]:
    """Each bin's mean."""
    found = []
    bins = [(key, start, end, _Side.of(*_rows(moments, start, end))) for key, start, end in _bins(moments)]
    of_surface: dict[int, list[_Side]] = {}
    for key, _, _, one in bins:
        of_surface.setdefault(key[0], []).append(one)
    shared = {first: _shared(sides) for first, sides in of_surface.items()}
    for key, start, end, one in bins:
        squares = float(moments.sums[start:end, 3].sum()) / one.count
        variance, dof = (float(one.parts @ one.parts), one.equal - 1) if one.equal > ALONE else (0.0, 0.0)
        if dof < FEW:
            usual = one.least + shared[key[0]] / one.equal
            variance, dof = (FEW * usual + dof * variance) / (FEW + dof), FEW + dof
        found.append(
            Cell(
                key,
                one.count,
                len(one.slots),
                one.mean,
                float(np.sqrt(squares)),
                float(np.sqrt(max(variance, one.least))),
                dof,
                float(moments.largest[start:end].max()),
            )
        )
    return found


def _shared(sides: list[_Side]) -> float:
    """Variance c² of what the points of a moment share, from the scatter of all moments about their bins' means."""
    scatter = sum(float(np.sum((one.pull - one.weight * one.mean) ** 2 - one.weight)) for one in sides)
    return max(0.0, scatter / sum(float(one.weight @ one.weight) for one in sides))


def against_others(moments: Moments) -> list[Cell]:
    """How much each bin's mean differs from that of all other bins with the same first number; none without others."""
    found = []
    bins = list(_bins(moments))
    for (first, second), start, end in bins:
        same = moments.key[:, 0] == first
        same[start:end] = False
        if same.any():
            others = moments.key[same, 2], moments.sums[same]
            found.append(_difference((first, second), _rows(moments, start, end), others))
    return found


def steps_of(moments: Moments, reach: int) -> list[Cell]:
    """How much the mean of the ``reach`` bins from each border on differs from that of as many before it.

    The key's second number is the bin that begins at the border.
    """
    found = []
    for first in np.unique(moments.key[:, 0]).tolist():
        low, high = np.searchsorted(moments.key[:, 0], [first, first + 1]).tolist()
        second = moments.key[low:high, 1]
        for border in range(int(second[0]) + 1, int(second[-1]) + 1) if len(second) else ():
            before, at, after = (low + np.searchsorted(second, [border - reach, border, border + reach])).tolist()
            if before < at < after:
                found.append(_difference((first, border), _rows(moments, at, after), _rows(moments, before, at)))
    return found


def _bins(moments: Moments) -> Iterator[tuple[tuple[int, int], int, int]]:
    bins, starts = np.unique(moments.key[:, :2], axis=0, return_index=True)
    ends = np.append(starts[1:], len(moments.key))
    for (first, second), start, end in zip(bins.tolist(), starts.tolist(), ends.tolist(), strict=True):
        yield (int(first), int(second)), start, end


def _rows(moments: Moments, start: int, end: int) -> tuple[Integers, Array]:
    return moments.key[start:end, 2], moments.sums[start:end]


def _difference(key: tuple[int, int], of: tuple[Integers, Array], against: tuple[Integers, Array]) -> Cell:
    """Mean of one less that of the other. Moments that both have share their noise: its parts are taken from each
    other before they are squared. Degrees of freedom: Welch 1947, "The generalization of Student's problem"."""
    one, other = _Side.of(*of), _Side.of(*against)
    count, moments = min(one.count, other.count), min(len(one.slots), len(other.slots))
    found = Cell(key, count, moments, one.mean - other.mean, np.nan, np.inf, 0.0, np.nan)
    if min(one.equal, other.equal) <= ALONE:
        return found
    slots = np.union1d(one.slots, other.slots)
    parts = np.zeros(len(slots))
    parts[np.searchsorted(slots, one.slots)] = one.parts
    parts[np.searchsorted(slots, other.slots)] -= other.parts
    variances = [max(float(side.parts @ side.parts), side.least) for side in (one, other)]
    free = sum(variances) ** 2 / sum(v**2 / (side.equal - 1) for v, side in zip(variances, (one, other), strict=True))
    variance = max(float(parts @ parts), one.least + other.least)
    return replace(found, sigma_mean_m=float(np.sqrt(variance)), dof=free)
