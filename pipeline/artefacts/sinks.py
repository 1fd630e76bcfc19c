"""Where the rows of output streams go: folders of Parquet parts, or memory."""

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
    """Takes the rows that one input part gives to the output streams."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *error: Any) -> None: ...
    def add(self, stream: str, batch: Batch) -> None: ...
    def written(self) -> Written: ...


class Sink(Protocol):
    """Opens the output for input part ``number``; ``empty`` stands in for a stream that got no row at all."""

    def open(self, number: int) -> PartSink: ...
    def empty(self, stream: str) -> tuple[Part, ...]: ...


@dataclass(frozen=True)
class FolderSink:
    """Streams as folders of Parquet parts in ``folder``."""

    folder: Path
    streams: Mapping[str, Artefact]

    def open(self, number: int) -> PartSink:
        return _FolderPart(self, number)

    def empty(self, stream: str) -> tuple[Part, ...]:
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
    """Streams in memory: simulated campaigns and tests."""

    streams: Mapping[str, Artefact]

    def open(self, number: int) -> PartSink:
        return _MemoryPart(self, number)

    def empty(self, stream: str) -> tuple[Part, ...]:
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
