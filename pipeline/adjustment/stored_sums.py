"""Sums by interval that lie in a temporary file, so that an hour's session needs no more memory than a minute's.

A session of half an hour has half a million intervals with 400 to 600 bytes of sums each. The adjustment goes through
them surface by surface, in blocks. In memory are their numbers alone.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.row_file import RowFile
from pipeline.maths.adjustment.interval_sums import BLOCK, N_MOVED, IntervalSums, Runs, blocks

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Change = Callable[[IntervalSums, Integers], IntervalSums]  # of some intervals, and their numbers


@dataclass(frozen=True)
class StoredSums:
    """Intervals of one sensor, ascending by record and surface, whose sums lie in a file.

    record, surface (g,): as in :class:`IntervalSums`; features: number F; file, row (g,): where the sums are; changes:
    what is done to sums that are read, in this order.
    """

    record: Integers
    surface: Integers
    features: int
    file: RowFile
    row: Integers
    changes: tuple[Change, ...] = ()

    @classmethod
    def of(cls, pieces: Iterable[IntervalSums], features: int) -> "StoredSums":
        """Store the sums of batches, one after the other; an interval may be spread over several batches."""
        file = RowFile(sum(map(prod, _shapes(features).values())))
        keys = [np.empty((2, 0), dtype=np.int64)]
        for piece in pieces:
            by_surface = piece.selected(np.lexsort((piece.record, piece.surface)))  # as they are read
            file.append(_rows(by_surface))
            keys.append(np.array([by_surface.record, by_surface.surface]))
        record, surface = np.concatenate(keys, axis=1)
        order = np.lexsort((surface, record))
        runs = Runs.of(record[order], surface[order])
        row = order[runs.starts]
        spread = np.flatnonzero(runs.lengths > 1)
        row[spread] = len(order) + np.arange(len(spread))
        for added in _added(file, order, runs, spread):
            file.append(added)
        return cls(record[order[runs.starts]], surface[order[runs.starts]], features, file, row)

    def __len__(self) -> int:
        return len(self.record)

    def selected(self, rows: Integers | slice) -> IntervalSums:
        """Return the intervals in these rows."""
        numbers = np.arange(len(self))[rows] if isinstance(rows, slice) else rows
        columns, start, fields = self.file.read(self.row[numbers]), 0, {}
        for name, shape in _shapes(self.features).items():
            stop = start + prod(shape)
            fields[name] = np.ascontiguousarray(columns[:, start:stop]).reshape(-1, *shape)
            start = stop
        sums = IntervalSums(record=self.record[numbers], surface=self.surface[numbers], **fields)
        for change in self.changes:
            sums = change(sums, numbers)
        return sums

    def changed(self, change: Change) -> "StoredSums":
        """Return the intervals with one more change, which is made whenever they are read."""
        return replace(self, changes=(*self.changes, change))

    def shifted(self, change: Array) -> "StoredSums":
        """Return the intervals after v has changed by q · ``change`` (g, F). Of several changes the sum is kept."""
        *before, last = self.changes or (None,)
        if isinstance(last, _Shift):
            return replace(self, changes=(*before, _Shift(last.change + change)))
        return replace(self, changes=(*self.changes, _Shift(change)))

    def stored(self, change: Callable[[IntervalSums], IntervalSums]) -> "StoredSums":
        """Return the intervals after a change of each alone, which is made at once."""
        return StoredSums.of(map(change, blocks(self)), self.features)


@dataclass(frozen=True)
class _Shift:
    """Change of v by q · ``change`` (g, F)."""

    change: Array

    def __call__(self, sums: IntervalSums, numbers: Integers) -> IntervalSums:
        return sums.shifted(self.change[numbers])


def _shapes(features: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of each of an interval's sums, in the order in which a row of the file has them."""
    return {
        "normal": (features, features),
        "swept": (N_MOVED, features),
        "swept_twice": (N_MOVED, N_MOVED),
        "right": (features,),
        "right_swept": (N_MOVED,),
        "squares": (),
        "count": (),
        "squared_count": (),
    }


def _rows(sums: IntervalSums) -> Array:
    """Return the rows (g, …) of intervals, for the file."""
    shapes, count = _shapes(sums.features), len(sums)
    return np.concatenate([getattr(sums, name).reshape(count, prod(shape)) for name, shape in shapes.items()], axis=1)


def _added(file: RowFile, order: Integers, runs: Runs, spread: Integers) -> Iterator[Array]:
    """Yield the sums of intervals that are spread over several rows: runs ``spread`` of the rows ``order``."""
    for start in range(0, len(spread), BLOCK):
        block = spread[start : start + BLOCK]
        lengths = runs.lengths[block]
        ends = np.cumsum(lengths)
        within = np.arange(ends[-1]) - np.repeat(ends - lengths, lengths)
        rows = order[np.repeat(runs.starts[block], lengths) + within]
        yield np.add.reduceat(file.read(rows), ends - lengths)
