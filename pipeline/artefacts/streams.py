"""Streams: tables too long for memory, which are read part by part and batch by batch.

A *batch* is a dict of equally long one-dimensional arrays. A *part* is the unit of work of a worker: a Parquet file, a
stretch of a raw file, or (in series of simulated sessions, and in tests) a batch in memory. A *stream* is an ordered
tuple of parts that can be read any number of times.
"""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import ArtefactError

Batch = Mapping[str, np.ndarray]
BATCH_ROWS = 131_072
_T = TypeVar("_T")


def columns_of(table: pa.Table) -> dict[str, np.ndarray]:
    """Return a table's columns as arrays; float32 becomes float64."""
    arrays = {name: table[name].to_numpy() for name in table.column_names}
    return {name: a.astype(np.float64) if a.dtype == np.float32 else a for name, a in arrays.items()}


def point_array(batch: Batch, suffix: str, rows: Any = slice(None)) -> np.ndarray:
    """Return points (n, 3) from the columns ``x_<suffix>``, ``y_…`` and ``z_…``. In memory they lie axis by axis.

    Parameters
    ----------
    batch : Batch
        Rows of a stream.
    suffix : str
        Frame and unit, such as "pool_m".
    rows : index
        Rows to take; default: all.
    """
    return np.array([batch[f"{axis}_{suffix}"][rows] for axis in "xyz"]).T


@dataclass(frozen=True)
class Chunk:
    """A batch of a part's rows, the counts of rows left out, and, from an INS, its stated sigmas and filter states.

    undrawn: number of usable rows that are left out because a sample alone is wanted.
    """

    columns: Batch  # usable rows
    dropped: Mapping[str, int] = field(default_factory=dict)  # rows left out, by reason
    sigmas: Batch = field(default_factory=dict)  # columns of the table ins_sigmas, with their own times
    states: Batch = field(default_factory=dict)  # of the INS's filter, by usable row (readers/novatel.py: STATES)
    undrawn: int = 0


class Part(Protocol):
    """The unit of work of a worker. Parts are picklable and have no open file."""

    @property
    def name(self) -> str:
        """Name of the part, unique in its stream."""
        ...

    def chunks(self) -> Iterator[Chunk]:
        """Yield the rows, at most BATCH_ROWS at a time."""
        ...


@runtime_checkable
class DividedPart(Part, Protocol):
    """A part of which some columns, or some rows, can be read alone."""

    def only(self, columns: tuple[str, ...]) -> Part:
        """Return the part with these columns alone."""
        ...

    def pieces(self) -> Sequence[Part]:
        """Return the part in pieces of consecutive rows."""
        ...


def only(part: Part, columns: tuple[str, ...]) -> Part:
    """Return a part with these columns alone, if it can be read so; else as it is."""
    return part.only(columns) if isinstance(part, DividedPart) else part


def pieces(part: Part) -> Sequence[Part]:
    """Return a part in pieces, if it can be read so; else as it is."""
    return part.pieces() if isinstance(part, DividedPart) else [part]


@dataclass(frozen=True)
class ParquetPart:
    """One Parquet file of a stream in a run folder."""

    path: Path
    columns: tuple[str, ...] | None = None  # columns to read; None: all
    group: int | None = None  # row group to read; None: all

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.path.name

    def only(self, columns: tuple[str, ...]) -> "ParquetPart":
        """Return the part with these columns alone."""
        return replace(self, columns=columns)

    def pieces(self) -> list["ParquetPart"]:
        """Return the row groups."""
        with self._opened() as file:
            return [replace(self, group=group) for group in range(file.num_row_groups)]

    def chunks(self) -> Iterator[Chunk]:
        """Yield the rows, at most BATCH_ROWS at a time."""
        for table in self._groups():
            for start in range(0, table.num_rows, BATCH_ROWS):
                yield Chunk(columns_of(table.slice(start, BATCH_ROWS)))

    def _groups(self) -> Iterator[pa.Table]:
        columns = None if self.columns is None else list(self.columns)
        with self._opened() as file:
            for group in range(file.num_row_groups) if self.group is None else [self.group]:
                yield file.read_row_group(group, columns=columns, use_threads=False)

    @contextlib.contextmanager
    def _opened(self) -> Iterator[pq.ParquetFile]:
        try:
            with pq.ParquetFile(self.path) as file:
                yield file
        except (OSError, pa.ArrowException) as error:
            raise ArtefactError(f"{self.path}: cannot be read ({error}); delete its folder and run again") from error


@dataclass(frozen=True)
class ChangedPart:
    """A part whose batches a picklable function changes: it may leave out rows, and change columns."""

    part: Part
    change: Callable[[Batch], Batch]

    @property
    def name(self) -> str:
        """Name of the part."""
        return self.part.name

    def only(self, columns: tuple[str, ...]) -> "ChangedPart":
        """Return the part with these columns alone, which must contain those that the function needs."""
        return replace(self, part=only(self.part, columns))

    def pieces(self) -> list["ChangedPart"]:
        """Return the part in pieces of consecutive rows."""
        return [replace(self, part=piece) for piece in pieces(self.part)]

    def chunks(self) -> Iterator[Chunk]:
        """Yield the rows that are left; no chunk is empty."""
        for chunk in self.part.chunks():
            columns = self.change(chunk.columns)
            if len(next(iter(columns.values()))):
                yield replace(chunk, columns=columns)


@dataclass(frozen=True)
class MemoryPart:
    """A batch in memory, for series of simulated sessions and for tests."""

    name: str
    columns: Batch

    def chunks(self) -> Iterator[Chunk]:
        """Yield the rows, at most BATCH_ROWS at a time."""
        rows = len(next(iter(self.columns.values())))
        for start in range(0, rows, BATCH_ROWS):
            yield Chunk({name: values[start : start + BATCH_ROWS] for name, values in self.columns.items()})


class Mapper(Protocol):
    """A callable that applies a function to many items. ``run/workers.py`` has one that works in parallel."""

    def __call__(self, function: Callable[..., _T], /, *items: Iterable[object]) -> Iterable[_T]:
        """Return the function's results for all items, in the order of the items."""
        ...


def serial(function: Callable[..., _T], *items: Iterable[object]) -> Iterable[_T]:
    """Apply a function to one item after another, in this process."""
    return map(function, *items)


@dataclass(frozen=True)
class Stream:
    """An ordered sequence of parts that can be read repeatedly, and the mapper that spreads the work on them."""

    parts: tuple[Part, ...]
    mapper: Mapper = serial
    here: Mapper = serial  # spreads work on the memory of this process

    def only(self, columns: Sequence[str]) -> "Stream":
        """Return the stream with these columns alone, where it is read from files."""
        return replace(self, parts=tuple(only(part, tuple(columns)) for part in self.parts))

    def changed(self, change: Callable[[Batch], Batch]) -> "Stream":
        """Return the stream whose batches a picklable function changes (:class:`ChangedPart`)."""
        return replace(self, parts=tuple(ChangedPart(part, change) for part in self.parts))

    def batches(self) -> Iterator[Batch]:
        """Yield all rows in order, batch by batch, with one batch in memory."""
        for part in self.parts:
            for chunk in part.chunks():
                yield chunk.columns

    def fold(self, function: Callable[..., _T], *arguments: object) -> Iterator[_T]:
        """Yield ``function(batch, *arguments)`` for every batch, in order. The mapper may work on parts in parallel.

        Take the results one by one: together they may not fit in memory. (On this machine the parts are read in pieces,
        so that few results wait. To a cluster the arguments are sent with every part, which costs more.)

        Parameters
        ----------
        function : callable
            Function of a batch and ``arguments``.
        *arguments
            Further arguments of the function.
        """
        parts = [piece for part in self.parts for piece in pieces(part)] if self.mapper == self.here else self.parts
        work = [(part, function, arguments) for part in parts]
        for results in self.mapper(_fold_part, work):
            yield from results


EMPTY_STREAM = Stream(())


def _fold_part(work: tuple[Part, Callable[..., _T], tuple[object, ...]]) -> list[_T]:
    part, function, arguments = work
    return [function(chunk.columns, *arguments) for chunk in part.chunks()]


@dataclass(frozen=True)
class BatchResult:
    """Result of a stage's ``run_batch`` on one chunk: rows for its output streams, and a small partial result."""

    streams: Mapping[str, Batch]
    partial: object
