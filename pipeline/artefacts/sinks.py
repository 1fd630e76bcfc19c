"""Destinations of the rows of output streams: folders of Parquet parts, or memory."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np

from pipeline.artefacts.parquet import PartWriter, to_arrow, write_empty_part
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import Batch, MemoryPart, ParquetPart, Part, columns_of

Written = Mapping[str, tuple[Part, ...]]


class PartSink(Protocol):
    """Destination of the output rows that a stage makes from one input part."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *error: Any) -> None: ...

    def add(self, stream: str, batch: Batch) -> None:
        """Append the rows of a batch to an output stream."""
        ...

    def written(self) -> Written:
        """Return the parts that were written, by stream."""
        ...


class Sink(Protocol):
    """Destination of all output streams."""

    def open(self, number: int) -> PartSink:
        """Open the destination for the rows of input part ``number``."""
        ...

    def empty(self, stream: str) -> tuple[Part, ...]:
        """Return the parts of a stream that has no rows."""
        ...


@dataclass(frozen=True)
class FolderSink:
    """Destination that writes each stream to a folder of Parquet parts in ``folder``."""

    folder: Path
    streams: Mapping[str, Artefact]

    def open(self, number: int) -> PartSink:
        """Open the destination for the rows of input part ``number``."""
        return _FolderPart(self, number)

    def empty(self, stream: str) -> tuple[Part, ...]:
        """Write a file without rows for a stream, and return it as a part."""
        artefact = self.streams[stream]
        return (ParquetPart(write_empty_part(self.folder / artefact.name, artefact)),)


@dataclass
class _FolderPart:
    sink: FolderSink
    number: int
    writers: dict[str, PartWriter] = field(default_factory=dict)

    def add(self, stream: str, batch: Batch) -> None:
        if stream not in self.writers:
            artefact = self.sink.streams[stream]
            self.writers[stream] = PartWriter(self.sink.folder / artefact.name, artefact, self.number)
        self.writers[stream].add(batch)

    def written(self) -> Written:
        return {name: tuple(map(ParquetPart, writer.paths)) for name, writer in self.writers.items()}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        for writer in self.writers.values():
            writer.__exit__(*error)


@dataclass(frozen=True)
class MemorySink:
    """Destination that keeps streams in memory, for series of simulated sessions and for tests."""

    streams: Mapping[str, Artefact]

    def open(self, number: int) -> PartSink:
        """Open the destination for the rows of input part ``number``."""
        return _MemoryPart(self, number)

    def empty(self, stream: str) -> tuple[Part, ...]:
        """Return an empty tuple: in memory a stream without rows has no parts."""
        return ()


@dataclass
class _MemoryPart:
    sink: MemorySink
    number: int
    batches: dict[str, list[dict[str, np.ndarray]]] = field(default_factory=dict)

    def add(self, stream: str, batch: Batch) -> None:
        table = to_arrow(batch, self.sink.streams[stream])
        if table.num_rows:
            self.batches.setdefault(stream, []).append(columns_of(table))

    def written(self) -> Written:
        parts: dict[str, tuple[Part, ...]] = {}
        for name, batches in self.batches.items():
            joined = {column: np.concatenate([batch[column] for batch in batches]) for column in batches[0]}
            parts[name] = (MemoryPart(f"part-{self.number:05d}-000", joined),)
        return parts

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        return None
