"""White noise of the INS's records, eliminated from the normal equations epoch by epoch.

Knots lie at records. Within an interval between two knots the noise w_k of its records forms a chain: each epoch
touches two neighbours. They are eliminated one after the other (block Thomas), all intervals side by side; what is
left, the Schur complement, touches the unknowns x and the interval's two knots. The record at a knot counts as two, one
in each interval: one record in a hundred.

The observed value v stands in as a last column: of the normal equations' matrix [A v]ᵀ P [A v] every Schur complement
carries along the right side and Σ p v², as what is left of it by least squares.

    v = A x + B w,  w ~ N(0, I) after scaling:    -2 log L = vᵀ V⁻¹ v + log det V + const,   V = P⁻¹ + B Bᵀ,
    vᵀ V⁻¹ v the last element's Schur complement, log det V = log det P⁻¹ + Σ log det of the eliminated blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import MOVING, EpochSums
from pipeline.maths.adjustment.parameters import SIX
from pipeline.maths.adjustment.pose_errors import Knots

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIDE_BY_SIDE = 64  # intervals


@dataclass(frozen=True)
class Observed:
    """A sensor's epochs on one surface: sums; C (g, F, m) of the unknowns ``columns`` (m,); K (3, 6) of pose errors."""

    sums: EpochSums
    design: Array
    columns: Integers
    pose: Array


class Source(Protocol):
    """All epochs of one sensor on one surface, ascending by ``record`` (g,), each record once."""

    @property
    def record(self) -> Integers: ...

    def observed(self, rows: slice) -> Observed:
        """Some of them: made when they are needed, for together their designs are many times the sums."""
        ...


@dataclass(frozen=True)
class Reduced:
    """Of each interval: normal (j, u + 13, u + 13) of x, the knots before and after, and v; log det of what went."""

    normal: Array
    log_determinant: float

    @property
    def unknowns(self) -> int:
        return int(self.normal.shape[1] - 2 * SIX - 1)


def reduce_white(sources: Sequence[Source], unknowns: int, knots: Knots, seconds: Array, white: Array) -> Reduced:
    """Normal equations by interval, the noise ``white`` (6,) of single records eliminated."""
    intervals = len(knots.record) - 1
    normal = np.zeros((intervals, unknowns + 2 * SIX + 1, unknowns + 2 * SIX + 1))
    placed = [(one, knots.interval_of(one.record)) for one in sources]
    log_determinant = 0.0
    for first in range(0, intervals, SIDE_BY_SIDE):
        last = min(first + SIDE_BY_SIDE, intervals)
        chain = _Chain.empty(first, last, unknowns, knots, bool(np.any(white > 0)))
        for one, interval in placed:
            low, high = np.searchsorted(interval, [first, last])
            if high > low:
                chain.add(one.observed(slice(int(low), int(high))), interval[low:high], knots, seconds)
        log_determinant += chain.eliminate(white)
        normal[first:last] = chain.normal
    return Reduced(normal, log_determinant)


@dataclass(frozen=True)
class _Chain:
    """Intervals side by side (j), their records one after another (l); y = (x, knot before, knot after, v).

    normal (j, y, y); own (j, l, 6, 6): a record's own block, ahead (j, l, 6, 6): with its successor, border
    (j, l, 6, y): with y.
    """

    first: int
    normal: Array
    own: Array
    ahead: Array
    border: Array

    @classmethod
    def empty(cls, first: int, last: int, unknowns: int, knots: Knots, with_records: bool) -> "_Chain":
        width, count = unknowns + 2 * SIX + 1, last - first
        steps = np.diff(knots.record[first : last + 1])[knots.inner[first:last]]
        length = int(steps.max(initial=0)) + 1 if with_records else 0
        return cls(
            first,
            np.zeros((count, width, width)),
            np.zeros((count, length, SIX, SIX)),
            np.zeros((count, length, SIX, SIX)),
            np.zeros((count, length, SIX, width)),
        )

    def add(self, one: Observed, interval: Integers, knots: Knots, seconds: Array) -> None:
        """Epochs of one sensor and surface, so that no record comes twice, each in its interval."""
        sums, design, K = one.sums, one.design, one.pose
        width = self.normal.shape[1]
        columns = np.concatenate([one.columns, np.arange(width - 2 * SIX - 1, width)])
        record, share = sums.record, sums.share
        t = seconds[record] + share * (seconds[record + 1] - seconds[record])
        after = (t - knots.seconds[interval]) / (knots.seconds[interval + 1] - knots.seconds[interval])
        whole = np.zeros((len(record), design.shape[1], len(columns) - 1))  # by the features: of x and both knots
        m = len(one.columns)
        whole[:, :, :m] = design
        whole[:, :MOVING, m : m + SIX] = (1 - after)[:, None, None] * K
        whole[:, :MOVING, m + SIX :] = after[:, None, None] * K
        normal, right = sums.normal, sums.right[:, :, None]
        pulled = np.concatenate([normal @ whole, right], axis=2)  # of features and (x, knots, v)
        by_unknown = np.swapaxes(whole, 1, 2)
        of_v = np.concatenate([by_unknown @ right, sums.squares[:, None, None]], axis=1)
        square = np.concatenate([by_unknown @ pulled[:, :, :-1], np.swapaxes(of_v[:, :-1], 1, 2)], axis=1)
        square = np.concatenate([square, of_v], axis=2)
        starts = np.flatnonzero(np.diff(interval, prepend=-1))
        j = interval - self.first
        self.normal[np.ix_(j[starts], columns, columns)] += np.add.reduceat(square, starts, axis=0)
        if not self.own.shape[1]:
            return
        later = np.concatenate([sums.swept @ whole, sums.right_swept[:, :, None]], axis=2)
        sooner = pulled[:, :MOVING] - later
        swept, twice = sums.swept[:, :, :MOVING], sums.swept_twice
        count, length = self.own.shape[:2]
        place, KT = j * length + record - knots.record[interval], K.T
        in_line = [part.reshape(count * length, SIX, -1) for part in (self.own, self.ahead, self.border)]
        for offset, border, own in (
            (0, sooner, normal[:, :MOVING, :MOVING] - 2 * swept + twice),  # of (1 - s)²
            (1, later, twice),  # of s²
        ):
            in_line[0][place + offset] += KT @ own @ K
            spread = np.zeros((len(record), SIX, width))
            spread[:, :, columns] = KT @ border
            in_line[2][place + offset] += spread
        in_line[1][place] += KT @ (swept - twice) @ K  # of (1 - s) s

    def eliminate(self, white: Array) -> float:
        """Take the records out of ``normal``; log det of their blocks.

        With w = √W u, u ~ N(0, 1), the prior is the unit matrix, and W = 0 no exception.
        """
        both, total = white[:, None] * white, 0.0
        carried_own: Array | None = None
        carried_border: Array | None = None
        for step in range(self.own.shape[1]):
            block = self.own[:, step] * both + np.eye(SIX)
            border = self.border[:, step] * white[:, None]
            if carried_own is not None and carried_border is not None:
                block, border = block - carried_own, border - carried_border
            total += float(np.sum(np.linalg.slogdet(block)[1]))
            ahead = self.ahead[:, step] * both
            solved = np.linalg.solve(block, np.concatenate([ahead, border], axis=2))
            back = np.swapaxes(ahead, 1, 2)
            carried_own, carried_border = back @ solved[:, :, :SIX], back @ solved[:, :, SIX:]
            self.normal[...] -= np.swapaxes(border, 1, 2) @ solved[:, :, SIX:]
        return total
