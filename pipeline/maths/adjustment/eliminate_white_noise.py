"""White noise of the INS's records, eliminated from the normal equations interval by interval.

Knots (of the drift) lie at records. Within a span between two knots the noise w_k of the records forms a chain, because
each interval between two records depends on two neighbours only. The records are eliminated one after the other (block
Thomas), all spans side by side. The Schur complement, which remains, depends on the parameters x and the span's two
knots. The record at a knot counts as two, one in each span: one record in ten at 100 a second.

The observed value v is a last column. So every Schur complement of the matrix [A v]ᵀ P [A v] contains the right side of
the normal equations too, and the Σ p v² that remains after least squares.

    v = A x + B w,  w ~ N(0, I) after scaling:    -2 log L = vᵀ V⁻¹ v + log det V + const,   V = P⁻¹ + B Bᵀ,
    vᵀ V⁻¹ v the last element's Schur complement, log det V = log det P⁻¹ + Σ log det of the eliminated blocks.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import IntervalSums
from pipeline.maths.adjustment.pose_errors import N_POSE, Knots
from pipeline.maths.kernels.record_chain import add_intervals, add_records, chain_scratch, eliminate_records

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIDE_BY_SIDE = 1000  # number of records that are eliminated together: 2 to 4 MB of blocks


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
    sources: Sequence[IntervalSource],
    n_parameters: int,
    times: TimeAxis,
    white: Array,
    group: Integers,
    mapper: Callable[..., Iterable[Any]] = map,
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
    mapper : callable
        Like ``map``; it may work in parallel.
    """
    knots = times.knots
    spans, groups = len(group), int(group.max(initial=0)) + 1
    by_span = np.zeros((spans, 2 * N_POSE, n_parameters + 2 * N_POSE + 1))
    others, log_determinant = np.zeros((groups, n_parameters + 1, n_parameters + 1)), np.zeros(groups)
    located = [(source, knots.interval_of(source.record)) for source in sources]
    seen = np.unique(np.concatenate([span for _, span in located]))  # spans with an interval; the others add nothing
    length = int((knots.record[seen + 1] - knots.record[seen]).max(initial=0)) + 1
    count = max(1, SIDE_BY_SIDE // length)
    work = [
        _SpansTogether(seen[start : start + count], located, times, white, length if np.any(white > 0) else 0)
        for start in range(0, len(seen), count)
    ]
    for together, of_spans in zip(work, mapper(_SpansTogether.eliminated, work), strict=True):
        x = of_spans.columns
        inner, sides = slice(len(x), len(x) + 2 * N_POSE), [*range(len(x)), len(x) + 2 * N_POSE]  # the knots; x and v
        y = np.r_[x, n_parameters + np.arange(2 * N_POSE + 1)]
        by_span[np.ix_(together.spans, np.arange(2 * N_POSE), y)] = of_spans.normal[:, inner]
        numbers, x_and_v = group[together.spans], np.r_[x, n_parameters]
        for number in np.unique(numbers).tolist():
            inside = numbers == number
            log_determinant[number] += of_spans.log_determinant[inside].sum()
            others[number][np.ix_(x_and_v, x_and_v)] += of_spans.normal[inside].sum(axis=0)[np.ix_(sides, sides)]
    return ReducedGroups(by_span, others, log_determinant, group)


@dataclass(frozen=True)
class _EliminatedSpans:
    """Normal equations (j, y, y) of spans side by side; y = (x of ``columns``, knot before, knot after, v).

    log_determinant (j,). In the rows of x and v the columns of the knots mean nothing.
    """

    columns: Integers
    normal: Array
    log_determinant: Array


@dataclass(frozen=True)
class _SpansTogether:
    """Spans (j,), ascending, to be eliminated side by side; ``length``: most records in a span, 0 without white noise.

    located: each source, and the span (g,) of each of its intervals.
    """

    spans: Integers
    located: Sequence[tuple[IntervalSource, Integers]]
    times: TimeAxis
    white: Array
    length: int

    def eliminated(self) -> _EliminatedSpans:
        """Return the normal equations without white noise, with the columns of parameters that these spans see."""
        pieces = []
        for source, span in self.located:
            low, high = np.searchsorted(span, [self.spans[0], self.spans[-1] + 1])
            if high > low:
                pieces.append((source.linearised(slice(int(low), int(high))), span[low:high]))
        columns = np.unique(np.concatenate([intervals.columns for intervals, _ in pieces]))
        chain = _RecordChain.empty(self.spans, len(columns) + 2 * N_POSE + 1, self.length)
        for intervals, span in pieces:
            chain.add(replace(intervals, columns=np.searchsorted(columns, intervals.columns)), span, self.times)
        return _EliminatedSpans(columns, chain.normal, chain.eliminate(self.white))


@dataclass(frozen=True)
class _RecordChain:
    """Normal equations of spans side by side (j) and their records in order (l); y = (x, knot before, knot after, v).

    spans (j,): their numbers, ascending; normal (j, y, y): in the rows of x and v without the columns of the knots;
    blocks of a record: own (j, l, 6, 6): with itself, ahead (j, l, 6, 6): with the next record, border (j, l, 6, y):
    with y.
    """

    spans: Integers
    normal: Array
    own: Array
    ahead: Array
    border: Array

    @classmethod
    def empty(cls, spans: Integers, width: int, length: int) -> "_RecordChain":
        lines = (len(spans), length, N_POSE)
        return cls(
            spans=spans,
            normal=np.zeros((len(spans), width, width)),
            own=np.zeros((*lines, N_POSE)),
            ahead=np.zeros((*lines, N_POSE)),
            border=np.zeros((*lines, width)),
        )

    def add(self, intervals: LinearisedIntervals, span: Integers, times: TimeAxis) -> None:
        """Add intervals of one sensor on one surface, in which no record comes twice; span (g,): number of the span."""
        sums, width = intervals.sums, self.normal.shape[1]
        j, sides = np.searchsorted(self.spans, span), np.r_[intervals.columns, width - 1]
        design, pose = np.ascontiguousarray(intervals.design), np.ascontiguousarray(intervals.pose)
        by_knot = _knot_shares(sums, span, times)
        linear = (sides, design, pose, by_knot, sums.normal, sums.right)
        memory = chain_scratch(*design.shape[1:])
        add_intervals(self.normal, j, *linear, sums.squares, memory)
        if self.own.shape[1]:
            record, swept = sums.record - times.knots.record[span], (sums.swept, sums.right_swept, sums.swept_twice)
            add_records(self.own, self.ahead, self.border, j, record, *linear, *swept, memory)

    def eliminate(self, white: Array) -> Array:
        """Eliminate the white noise of the records from ``normal``, in place; return the spans' log det (j,)."""
        log_determinant = np.zeros(len(self.spans))
        if self.own.shape[1]:
            eliminate_records(self.own, self.ahead, self.border, white, self.normal, log_determinant)
        return log_determinant


def _knot_shares(sums: IntervalSums, span: Integers, times: TimeAxis) -> Array:
    """Return the shares (g, 2) of the drift at the knots before and after in that of each interval."""
    record, seconds, knots = sums.record, times.seconds, times.knots
    t = seconds[record] + sums.share * (seconds[record + 1] - seconds[record])
    after = (t - knots.seconds[span]) / (knots.seconds[span + 1] - knots.seconds[span])
    return np.stack([1 - after, after], axis=1)
