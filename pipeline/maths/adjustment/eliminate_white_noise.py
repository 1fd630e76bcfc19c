"""White noise of the INS's records, eliminated from the normal equations interval by interval.

Knots (of the drift) lie at records. Within a span between two knots the noise w_k of the records forms a chain, because
each interval between two records depends on two neighbours only. The records are eliminated one after the other (block
Thomas), all spans side by side. The Schur complement, which remains, depends on the parameters x and the span's two
knots. The record at a knot counts as two, one in each span: one record in a hundred.

The observed value v is a last column. So every Schur complement of the matrix [A v]ᵀ P [A v] contains the right side of
the normal equations too, and the Σ p v² that remains after least squares.

    v = A x + B w,  w ~ N(0, I) after scaling:    -2 log L = vᵀ V⁻¹ v + log det V + const,   V = P⁻¹ + B Bᵀ,
    vᵀ V⁻¹ v the last element's Schur complement, log det V = log det P⁻¹ + Σ log det of the eliminated blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import N_MOVED, IntervalSums
from pipeline.maths.adjustment.pose_errors import N_POSE, Knots

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIDE_BY_SIDE = 32  # number of spans that are eliminated together: 15 MB of blocks; more are no quicker


@dataclass(frozen=True)
class LinearisedIntervals:
    """Intervals of one sensor on one surface, with their designs.

    sums: those of g intervals; design C (g, F, m) of the parameters ``columns`` (m,); pose K (3, 6): design of pose
    errors.
    """

    sums: IntervalSums
    design: Array
    columns: Integers
    pose: Array


class IntervalSource(Protocol):
    """All intervals of one sensor on one surface, ascending by ``record`` (g,), each record once."""

    @property
    def record(self) -> Integers:
        """Return the last INS record (g,) before each interval's points."""
        ...

    def linearised(self, rows: slice) -> LinearisedIntervals:
        """Return the intervals in these rows; all designs at once would need many times the memory of the sums."""
        ...


@dataclass(frozen=True)
class TimeAxis:
    """Times (n,) s of all INS records, and the knots of the drift among them."""

    seconds: Array
    knots: Knots


@dataclass(frozen=True)
class ReducedIntervals:
    """Normal equations of all spans between two knots, without the records' noise.

    spans (j, 12, u + 13): of each span, the rows of its knot before and its knot after; their columns are x, the knot
    before, the knot after, and v. others (u + 1, u + 1): the blocks of x and v, sums over all spans. log_determinant of
    the eliminated blocks.
    """

    spans: Array
    others: Array
    log_determinant: float


@dataclass(frozen=True)
class ReducedGroups:
    """As :class:`ReducedIntervals`, with the sums by group of spans, so that each group can be left out.

    group (j,): number of each span's group; others (h, u + 1, u + 1) and log_determinant (h,) by group.
    """

    spans: Array
    others: Array
    log_determinant: Array
    group: Integers

    def of(self, groups: Sequence[int]) -> ReducedIntervals:
        """Return the normal equations of the spans in these groups alone."""
        numbers = np.asarray(groups, dtype=np.int64)
        inside = np.isin(self.group, numbers)
        spans = self.spans if inside.all() else np.where(inside[:, None, None], self.spans, 0.0)
        return ReducedIntervals(spans, self.others[numbers].sum(axis=0), float(self.log_determinant[numbers].sum()))


def eliminate_white_noise(
    sources: Sequence[IntervalSource], n_parameters: int, times: TimeAxis, white: Array, group: Integers
) -> ReducedGroups:
    """Return the normal equations, with the white noise of single records eliminated span by span.

    Parameters
    ----------
    sources : sequence of IntervalSource
        All intervals, by sensor and surface.
    n_parameters : int
        Number u of parameters.
    times : TimeAxis
        Times of the INS records, and knots.
    white : (6,) array
        Standard deviations of a record's noise, m and rad.
    group : (j,) array
        Number of the group of each span, from 0.
    """
    knots = times.knots
    spans, groups = len(group), int(group.max(initial=0)) + 1
    width = n_parameters + 2 * N_POSE + 1
    rows, sides = slice(n_parameters, width - 1), [*range(n_parameters), width - 1]  # the knots; x and v
    by_span, others = np.zeros((spans, 2 * N_POSE, width)), np.zeros((groups, n_parameters + 1, n_parameters + 1))
    located = [(source, knots.interval_of(source.record)) for source in sources]
    log_determinant = np.zeros(groups)
    seen = np.unique(np.concatenate([span for _, span in located]))  # spans with an interval; the others add nothing
    for first in range(0, len(seen), SIDE_BY_SIDE):
        together = seen[first : first + SIDE_BY_SIDE]
        chain = _RecordChain.empty(together, width, knots, bool(np.any(white > 0)))
        for source, span in located:
            low, high = np.searchsorted(span, [together[0], together[-1] + 1])
            if high > low:
                chain.add(source.linearised(slice(int(low), int(high))), span[low:high], times)
        of_blocks = chain.eliminate(white)
        by_span[together] = chain.normal[:, rows]
        for number in np.unique(group[together]).tolist():
            inside = group[together] == number
            log_determinant[number] += of_blocks[inside].sum()
            others[number] += chain.normal[inside].sum(axis=0)[np.ix_(sides, sides)]
    return ReducedGroups(by_span, others, log_determinant, group)


@dataclass(frozen=True)
class _RecordChain:
    """Normal equations of spans side by side (j) and their records in order (l); y = (x, knot before, knot after, v).

    spans (j,): their numbers, ascending; normal (j, y, y); blocks of a record: own (j, l, 6, 6): with itself, ahead
    (j, l, 6, 6): with the next record, border (j, l, 6, y): with y.
    """

    spans: Integers
    normal: Array
    own: Array
    ahead: Array
    border: Array

    @classmethod
    def empty(cls, spans: Integers, width: int, knots: Knots, with_records: bool) -> "_RecordChain":
        count, steps = len(spans), (knots.record[spans + 1] - knots.record[spans])[knots.inner[spans]]
        length = int(steps.max(initial=0)) + 1 if with_records else 0
        return cls(
            spans=spans,
            normal=np.zeros((count, width, width)),
            own=np.zeros((count, length, N_POSE, N_POSE)),
            ahead=np.zeros((count, length, N_POSE, N_POSE)),
            border=np.zeros((count, length, N_POSE, width)),
        )

    def add(self, intervals: LinearisedIntervals, span: Integers, times: TimeAxis) -> None:
        """Add intervals of one sensor on one surface, in which no record comes twice; span (g,): number of the span."""
        sums, K = intervals.sums, intervals.pose
        width = self.normal.shape[1]
        columns = np.concatenate([intervals.columns, np.arange(width - 2 * N_POSE - 1, width)])
        whole = _with_knots(intervals, span, times)
        normal = sums.normal
        by_feature = np.concatenate([normal @ whole, sums.right[:, :, None]], axis=2)  # features by (x, knots, v)
        starts = np.flatnonzero(np.diff(span, prepend=-1))
        j = np.searchsorted(self.spans, span)
        square = np.zeros((len(starts), len(columns), len(columns)))
        square[:, :-1] = _sum_of_products(whole, by_feature, starts)
        square[:, -1, :-1] = square[:, :-1, -1]
        square[:, -1, -1] = np.add.reduceat(sums.squares, starts)
        self.normal[np.ix_(j[starts], columns, columns)] += square
        if not self.own.shape[1]:
            return
        later = np.concatenate([sums.swept @ whole, sums.right_swept[:, :, None]], axis=2)
        sooner = by_feature[:, :N_MOVED] - later
        swept, twice = sums.swept[:, :, :N_MOVED], sums.swept_twice
        count, length = self.own.shape[:2]
        place, KT = j * length + sums.record - times.knots.record[span], K.T
        own_line, ahead_line, border_line = (
            part.reshape(count * length, N_POSE, -1) for part in (self.own, self.ahead, self.border)
        )
        for offset, border, own in (
            (0, sooner, normal[:, :N_MOVED, :N_MOVED] - 2 * swept + twice),  # sums with 1 - s and (1 - s)²
            (1, later, twice),  # sums with s and s²
        ):
            own_line[place + offset] += KT @ own @ K
            spread = np.zeros((len(place), N_POSE, width))
            spread[:, :, columns] = KT @ border
            border_line[place + offset] += spread
        ahead_line[place] += KT @ (swept - twice) @ K  # sums with (1 - s) s

    def eliminate(self, white: Array) -> Array:
        """Eliminate the white noise of the records from ``normal``, in place; return the spans' log det (j,).

        The unknowns are the noise divided by its standard deviations ``white``. So their prior is the unit matrix, and
        a standard deviation of zero is no special case.
        """
        count, length, _, width = self.border.shape
        if not length:
            return np.zeros(count)
        own, ahead = (blocks * (white[:, None] * white) for blocks in (self.own, self.ahead))
        own += np.eye(N_POSE)
        border = self.border * white[:, None]
        solved = np.empty_like(border)
        for step in range(length):
            inverse = np.linalg.inv(own[:, step])
            solved[:, step] = inverse @ border[:, step]
            if step + 1 < length:
                back = np.swapaxes(ahead[:, step], 1, 2)
                own[:, step + 1] -= back @ inverse @ ahead[:, step]
                border[:, step + 1] -= back @ solved[:, step]
        lines = (count, length * N_POSE, width)  # one product for all records of a span
        self.normal[...] -= np.swapaxes(border.reshape(lines), 1, 2) @ solved.reshape(lines)
        return np.asarray(np.sum(np.linalg.slogdet(own)[1], axis=1))


def _sum_of_products(left: Array, right: Array, starts: Integers) -> Array:
    """Return Σ leftᵀ right (s, a, b) over each run of matrices (g, F, a) and (g, F, b); starts (s,) of the runs.

    The matrices of a run stand one below the other, so that there is one product a run: it needs a third of the time of
    one product a matrix and their sums.
    """
    count, features = left.shape[:2]
    lengths = np.diff(starts, append=count)
    longest = int(lengths.max(initial=0))
    run = np.repeat(np.arange(len(starts)), lengths)
    place = run * longest + np.arange(count) - starts[run]
    stacked = []
    for matrices in (left, right):
        filled = np.zeros((len(starts) * longest, features, matrices.shape[2]))
        filled[place] = matrices
        stacked.append(filled.reshape(len(starts), longest * features, -1))
    return np.asarray(np.swapaxes(stacked[0], 1, 2) @ stacked[1])


def _with_knots(intervals: LinearisedIntervals, span: Integers, times: TimeAxis) -> Array:
    """Return the design (g, F, m + 12) of the parameters and of the knots before and after each interval."""
    sums, K = intervals.sums, intervals.pose
    record, seconds, knots = sums.record, times.seconds, times.knots
    t = seconds[record] + sums.share * (seconds[record + 1] - seconds[record])
    after = (t - knots.seconds[span]) / (knots.seconds[span + 1] - knots.seconds[span])
    m = len(intervals.columns)
    whole = np.zeros((len(record), intervals.design.shape[1], m + 2 * N_POSE))
    whole[:, :, :m] = intervals.design
    whole[:, :N_MOVED, m : m + N_POSE] = (1 - after)[:, None, None] * K
    whole[:, :N_MOVED, m + N_POSE :] = after[:, None, None] * K
    return whole
