"""Read a stage's inputs from the run folder and the raw files, and write its outputs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.artefacts import parquet
from pipeline.artefacts.schema import Artefact, Document, OfFurtherHeads, Provenance, RawFiles
from pipeline.artefacts.streams import EMPTY_STREAM, Chunk, ParquetPart, Part, Stream, only, pieces
from pipeline.atomic_files import write_text, writing
from pipeline.readers import dispatch
from pipeline.run import manifest, provenance
from pipeline.run.freshness import Run, all_raw
from pipeline.run.stage_protocol import Marker, declared, is_stream, sources
from pipeline.run.workers import Stopped


def make_folders(partial: Path, stage: ModuleType) -> dict[str, Artefact]:
    """Make the folders of a stage's streams in its partial folder; return the streams' artefacts by field."""
    streams = {n: m for n, m in declared(stage.Outputs).items() if isinstance(m, Artefact) and is_stream(m)}
    with writing(partial):
        partial.mkdir()
        for marker in streams.values():
            (partial / marker.name).mkdir()
    return streams


def rows_to_map(this: Run, stage: ModuleType) -> int | None:
    """Return the number of rows of the streams that are mapped; None if one of them comes from raw files."""
    markers = declared(stage.Inputs)
    total = 0
    for source in sources(stage):
        marker = markers[source]
        owner = manifest.read_manifest(this.folder(marker.owner)) if isinstance(marker, Artefact) else None
        if owner is None or not isinstance(marker, Artefact):
            return None
        total += owner.rows.get(marker.name, 0)
    return total


def read_input(this: Run, marker: Marker) -> Any:
    """Return a field of a stage's Inputs: a table, a text, a stream that is not read yet, or the run's provenance.

    Of further heads of the sonar it is a mapping by head.
    """
    if isinstance(marker, OfFurtherHeads):
        return {head: read_input(run, marker.artefact) for head, run in this.heads.items()}
    if isinstance(marker, Provenance):
        return {"inputs": all_raw(this), "software": provenance.library_versions()}
    if isinstance(marker, RawFiles):
        settings = getattr(this.settings.session, marker.sensor)
        if settings is None:
            return EMPTY_STREAM
        return _stream(this, dispatch.raw_parts(marker.sensor, settings, this.settings.session_folder))
    where = this.folder(marker.owner)
    if isinstance(marker, Document):
        return (where / marker.name).read_text(encoding="utf-8")
    if marker.kind == "table":
        return parquet.read_table(where / f"{marker.name}.parquet", marker)
    owner = manifest.read_manifest(where)
    names = sorted(owner.outputs) if owner is not None else []
    return _stream(this, [ParquetPart(where / name) for name in names if name.startswith(f"{marker.name}/")])


@dataclass(frozen=True)
class _Watched:
    """A part that counts its rows for the progress bar, and raises Stopped when the run has failed elsewhere."""

    part: Part
    this: Run

    @property
    def name(self) -> str:
        return self.part.name

    def only(self, columns: tuple[str, ...]) -> "_Watched":
        return replace(self, part=only(self.part, columns))

    def pieces(self) -> list["_Watched"]:
        return [replace(self, part=piece) for piece in pieces(self.part)]

    def chunks(self) -> Iterator[Chunk]:
        for chunk in self.part.chunks():
            if self.this.workers.stop.is_set():
                raise Stopped
            yield chunk
            self.this.progress.advance(len(next(iter(chunk.columns.values()), ())))


def _stream(this: Run, parts: Sequence[Part]) -> Stream:
    watched = [_Watched(part, this) for part in parts] if this.workers.local else parts
    return Stream(tuple(watched), this.workers.map, this.workers.here)


def write_outputs(partial: Path, stage: ModuleType, outputs: Any) -> dict[str, int]:
    """Write a stage's tables and documents. Its streams are already written, part by part.

    Parameters
    ----------
    partial
        The stage's partial folder.
    stage, outputs
        The stage's module, and its Outputs.

    Returns
    -------
    dict
        Number of rows by artefact.
    """
    rows: dict[str, int] = {}
    for name, marker in declared(stage.Outputs).items():
        value = getattr(outputs, name)
        if isinstance(marker, Document):
            write_text(partial / marker.name, value)
        elif value is None:
            continue
        elif isinstance(marker, Artefact) and marker.kind == "table":
            parquet.write_table(partial / f"{marker.name}.parquet", parquet.to_arrow(value, marker))
            rows[marker.name] = len(value)
        elif isinstance(marker, Artefact):
            rows[marker.name] = sum(parquet.row_count(path) for path in sorted((partial / marker.name).iterdir()))
    return rows
