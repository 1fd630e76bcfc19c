"""Sums over one sensor's points on one surface between two INS records (an *interval*): a solution needs no more.

Between two records the body moves along one straight step, and all points of an interval (a ping's beams on the wall,
some hundred laser points on a block) are seen from one pose p, T = R_target_from_body. With r = X - p the vector from
the body to a point and α = t1 · r, β = t2 · r along the surface's tangents, the observation v = n · (X - c) - shift
changes

    with a pose error (δ, ω), X -> X + δ + ω × r:    n · δ + ω · (r × n),        r × n = β t1 - α t2
    with the mount (ε, λ), body axes:                ε · Tᵀ((r - T l) × n) + λ · Tᵀ n
    with the surface's turns and shift:              (α + t1 · (p - c), β + t2 · (p - c), -1)

All are linear in q = (1, α, β), with coefficients that are the same for the whole interval (t1 × t2 = n; the part of r
along n cancels). Other effects (an error of the ranges, of the sound speed) have features of their own:
q = (1, α, β, …), F in all. So Σ w q qᵀ (F, F), Σ w q v (F,) and Σ w v² contain the normal equations of every parameter,
whatever the number of points, and a stream is read once for each linearisation.

Within the interval the error of the pose goes from one record's to the next's, (1 - s) e_k + s e_{k+1}. In that time a
scanner's line crosses a wall from top to bottom, so that s grows with β, and 2 mm of white noise between two records
turn the wall by 0.02° in this interval. So sums with s and s² are needed as well, for the three features on which a
pose error acts. (With the mean of s instead, the mean normalised squared error of the mount parameters rose from 6-7 to
8.3.)
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
N_MOVED = 3  # number of the features on which a pose error acts: 1, α, β
BLOCK = 4096  # number of intervals whose matrices are computed at a time: some MB


class Intervals(Protocol):
    """Intervals of one sensor as :class:`IntervalSums`, in memory or in a file. What needs their sums reads some."""

    @property
    def record(self) -> Integers:
        """Return the last INS record (g,) before the points of each interval."""
        ...

    @property
    def surface(self) -> Integers:
        """Return the number (g,) of each interval's surface."""
        ...

    @property
    def features(self) -> int:
        """Return the number F of features."""
        ...

    def __len__(self) -> int: ...

    def selected(self, rows: Integers | slice) -> "IntervalSums":
        """Return the intervals in these rows."""
        ...

    def changed(self, change: Callable[["IntervalSums", Integers], "IntervalSums"]) -> "Intervals":
        """Return the intervals after a quick change of each alone; ``change`` gets some of them, and their numbers.

        Where they lie in a file, it is made whenever they are read.
        """
        ...

    def shifted(self, change: Array) -> "Intervals":
        """Return the intervals after v has changed by q · ``change`` (g, F)."""
        ...

    def stored(self, change: Callable[["IntervalSums"], "IntervalSums"]) -> "Intervals":
        """Return the intervals after a change of each alone, which is made at once; ``change`` gets some of them."""
        ...


@dataclass(frozen=True)
class IntervalSums:
    """Intervals of one sensor, ascending by record and surface.

    record (g,): the last INS record before the interval's points; surface (g,): number of the surface. With q₃ the
    first three features and s the time of a point between the two records, 0 to 1:

    normal (g, F, F) = Σ w q qᵀ, swept (g, 3, F) = Σ w s q₃ qᵀ, swept_twice (g, 3, 3) = Σ w s² q₃ q₃ᵀ,
    right (g, F) = Σ w q v, right_swept (g, 3) = Σ w s q₃ v, squares (g,) = Σ w v², count (g,) = Σ e and squared_count
    (g,) = Σ e² over points with a weight; e is 1, or the weight of a point near an edge.
    """

    record: Integers
    surface: Integers
    normal: Array
    swept: Array
    swept_twice: Array
    right: Array
    right_swept: Array
    squares: Array
    count: Array
    squared_count: Array

    def __len__(self) -> int:
        return len(self.record)

    @property
    def features(self) -> int:
        """Return the number F of features."""
        return int(self.normal.shape[-1])

    @property
    def share(self) -> Array:
        """Return the weighted mean of s in each interval (g,)."""
        return np.asarray(self.swept[:, 0, 0] / self.normal[:, 0, 0])

    def selected(self, rows: Integers | slice) -> "IntervalSums":
        """Return the intervals in these rows."""
        return IntervalSums(**{name: getattr(self, name)[rows] for name in self.__dataclass_fields__})

    def changed(self, change: Callable[["IntervalSums", Integers], "IntervalSums"]) -> "IntervalSums":
        """Return the intervals after a change of each alone; ``change`` gets them, and their numbers."""
        return change(self, np.arange(len(self)))

    def stored(self, change: Callable[["IntervalSums"], "IntervalSums"]) -> "IntervalSums":
        """Return the intervals after a change of each alone."""
        return change(self)

    def shifted(self, change: Array) -> "IntervalSums":
        """Return the sums of the same observations after v has changed by q · ``change`` (g, F).

        The points need not be read again. This is exact while the features q stay the same. They change a little when
        mount or surface turns. The error of v is then of second order: 5 µm for a turn of 1e-3 rad at 10 m.
        """
        shift = np.einsum("gij,gj->gi", self.normal, change)
        return replace(
            self,
            right=self.right + shift,
            right_swept=self.right_swept + np.einsum("gij,gj->gi", self.swept, change),
            squares=self.squares + np.einsum("gi,gi->g", change, 2 * self.right + shift),
        )


def blocks(sums: Intervals, rows: Integers | None = None) -> Iterator[IntervalSums]:
    """Yield the intervals in these rows (all by default), at most BLOCK at a time, so that memory stays small."""
    count = len(sums) if rows is None else len(rows)
    for start in range(0, count, BLOCK):
        some = slice(start, min(start + BLOCK, count))
        yield sums.selected(some if rows is None else rows[some])


@dataclass(frozen=True)
class Runs:
    """Runs of consecutive points that belong together: index of the first point, and number of points, (g,) each.

    Sums over neighbours cost a quarter of sums by number (bincount). A run's value is repeated, not looked up.
    """

    starts: Integers
    lengths: Integers

    @classmethod
    def of(cls, *keys: Integers) -> "Runs":
        """Return the runs of points with equal keys, (n,) each."""
        n = len(keys[0])
        new = np.ones(n, dtype=bool)
        if n:
            new[1:] = np.any([key[1:] != key[:-1] for key in keys], axis=0)
        starts = np.flatnonzero(new)
        return cls(starts, np.diff(starts, append=n))

    def total(self, values: Array) -> Array:
        """Return the sums (…, g) over each run of values (…, n)."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=-1))

    def spread(self, values: Array) -> Array:
        """Return the values (…, g) of the runs, repeated for each of their points (…, n)."""
        return np.asarray(np.repeat(values, self.lengths, axis=-1))


@dataclass(frozen=True)
class LinearisedPoints:
    """Points of one batch for :func:`interval_sums`.

    record, surface (n,): the last INS record before each point, and its surface; share (n,): its time s between that
    record and the next, 0 to 1; features (F, n): q; weight (n,): w; v_m (n,): distance from the surface;
    count (n,): e, as which part of a point each counts, None: each that has a weight as one.
    """

    record: Integers
    surface: Integers
    share: Array
    features: Array
    weight: Array
    v_m: Array
    count: Array | None = None


def interval_sums(points: LinearisedPoints) -> IntervalSums:
    """Return the sums of one batch; this is quickest if the points of an interval are consecutive."""
    q, weight, v_m = points.features, points.weight, points.v_m
    runs = Runs.of(points.record, points.surface)
    features, intervals, total = len(q), len(runs.starts), runs.total
    count = (weight > 0).astype(np.float64) if points.count is None else points.count
    normal, swept = np.empty((intervals, features, features)), np.empty((intervals, N_MOVED, features))
    swept_twice, right = np.empty((intervals, N_MOVED, N_MOVED)), np.empty((intervals, features))
    right_swept = np.empty((intervals, N_MOVED))
    for row in range(features):
        weighted = weight * q[row] if row else weight
        right[:, row] = total(weighted * v_m)
        for column in range(row + 1):
            normal[:, row, column] = normal[:, column, row] = total(weighted * q[column] if column else weighted)
    weighted = weight * points.share
    for row in range(N_MOVED):
        once = weighted * q[row] if row else weighted
        right_swept[:, row] = total(once * v_m)
        twice = once * points.share
        for column in range(row, features):
            swept[:, row, column] = total(once * q[column] if column else once)
            if column < N_MOVED:
                swept[:, column, row] = swept[:, row, column]
                swept_twice[:, row, column] = total(twice * q[column] if column else twice)
                swept_twice[:, column, row] = swept_twice[:, row, column]
    sums = IntervalSums(
        record=points.record[runs.starts],
        surface=points.surface[runs.starts],
        normal=normal,
        swept=swept,
        swept_twice=swept_twice,
        right=right,
        right_swept=right_swept,
        squares=total(weight * v_m**2),
        count=total(count),
        squared_count=total(count**2),
    )
    return merged([sums.selected(np.flatnonzero(normal[:, 0, 0] > 0))])


def merged(pieces: Iterable[IntervalSums]) -> IntervalSums:
    """Return the sums of all batches together, in order; an interval may be spread over several batches."""
    parts = list(pieces)
    together = {
        name: np.concatenate([getattr(piece, name) for piece in parts]) for name in IntervalSums.__dataclass_fields__
    }
    record, surface = together.pop("record"), together.pop("surface")
    order = np.lexsort((surface, record))
    first = Runs.of(record[order], surface[order]).starts
    sums = {name: np.add.reduceat(values[order], first) for name, values in together.items()}
    return IntervalSums(record=record[order[first]], surface=surface[order[first]], **sums)
