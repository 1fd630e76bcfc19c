"""The protocol of stages: what a stage declares, how it is called, what it must return. No run folder is touched.

A stage is a module with the frozen dataclasses ``Config``, ``Inputs`` and ``Outputs``. Each field of the latter two is
annotated with its artefact. A stage of tables alone has ``run(inputs, config) -> Outputs``. A stage over streams has

    prepare(inputs, config) -> prepared                         called once
    run_batch(source, chunk, prepared, config) -> BatchResult   called for each chunk of the streams in SOURCES (or all)
    combine(prepared, partials, config) -> Outputs              called once; its fields of streams stay EMPTY_STREAM

A table's field with the default None is optional. An optional input is None if no stage of the run writes it. An
optional output that is None is not written.
"""

import dataclasses
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, get_type_hints

from pipeline.artefacts.parquet import from_arrow, to_arrow
from pipeline.artefacts.schema import Artefact, Document, OfFurtherHeads, Provenance, RawFiles
from pipeline.artefacts.sinks import MemorySink, Sink, Written
from pipeline.artefacts.streams import EMPTY_STREAM, Mapper, Part, Stream, serial

Marker = Artefact | RawFiles | Document | Provenance | OfFurtherHeads


def name_of(stage: ModuleType) -> str:
    """Return the stage's name: its module's name without the package."""
    return stage.__name__.rpartition(".")[2]


def declared(fields_of: type) -> dict[str, Marker]:
    """Return the artefacts with which the fields of a stage's Inputs or Outputs are annotated, by field."""
    artefacts: dict[str, Marker] = {}
    for name, hint in get_type_hints(fields_of, include_extras=True).items():
        markers = [m() if m is Provenance else m for m in getattr(hint, "__metadata__", ())]
        markers = [m for m in markers if isinstance(m, Marker)]
        if len(markers) != 1:
            raise TypeError(f"{fields_of.__module__}.{fields_of.__name__}.{name} must be annotated with one artefact")
        artefacts[name] = markers[0]
    return artefacts


def inputs_in(stages: Collection[str], stage: ModuleType) -> dict[str, Marker]:
    """Return the artefacts that a stage reads in a run of these ``stages``, by field.

    An optional table is left out if none of the stages writes it; the stage then gets None.
    """
    optional = {field.name for field in dataclasses.fields(stage.Inputs) if field.default is None}
    return {
        name: marker
        for name, marker in declared(stage.Inputs).items()
        if not (name in optional and isinstance(marker, Artefact) and marker.owner not in stages)
    }


def of_each_head(stages: Sequence[ModuleType]) -> Sequence[ModuleType]:
    """Return the stages that run once for each further head: up to the last whose results another stage reads so."""
    read = (marker for stage in stages for marker in declared(stage.Inputs).values())
    owners = {marker.artefact.owner for marker in read if isinstance(marker, OfFurtherHeads)}
    last = max((number for number, stage in enumerate(stages) if name_of(stage) in owners), default=-1)
    return stages[: last + 1]


def is_stream(marker: Marker) -> bool:
    """Return whether a field is a stream, and not a table or document."""
    return isinstance(marker, RawFiles) or (isinstance(marker, Artefact) and marker.kind == "stream")


def sources(stage: ModuleType) -> tuple[str, ...]:
    """Return the fields of the streams that are mapped part by part; none for a stage of tables alone."""
    if not hasattr(stage, "run_batch"):
        return ()
    streams = tuple(name for name, marker in declared(stage.Inputs).items() if is_stream(marker))
    return tuple(getattr(stage, "SOURCES", streams))


def evaluate(
    stage: ModuleType,
    inputs: Any,
    config: Any,
    sink: Sink,
    *,
    mapper: Mapper = serial,
    begin: Callable[[], None] = lambda: None,
) -> Any:
    """Call a stage and return its Outputs, checked against their artefacts.

    Parameters
    ----------
    stage
        The stage's module.
    inputs, config
        The stage's Inputs and Config.
    sink
        Takes the batches of the streams that the stage writes.
    mapper
        Maps a function over the parts.
    begin
        Called before the parts are mapped.
    """
    if not hasattr(stage, "run_batch"):
        return _checked(stage, stage.run(inputs, config), {}, mapper)
    prepared = stage.prepare(inputs, config)
    outputs = {name: marker for name, marker in declared(stage.Outputs).items() if is_stream(marker)}
    partials: dict[str, list[tuple[str, object]]] = {}
    parts: dict[str, list[Part]] = {name: [] for name in outputs}
    owner: dict[str, str] = {}
    begin()
    for source in sources(stage):
        stream: Stream = getattr(inputs, source)
        work = [
            _Work(
                source=source,
                number=number,
                part=part,
                run_batch=stage.run_batch,
                prepared=prepared,
                config=config,
                sink=sink,
            )
            for number, part in enumerate(stream.parts)
        ]
        partials[source] = []
        for part, (results, written) in zip(stream.parts, mapper(_run_part, work), strict=True):
            partials[source] += [(part.name, partial) for partial in results]
            for name, files in written.items():
                if files and owner.setdefault(name, source) != source:
                    raise TypeError(f"{stage.__name__}: {owner[name]} and {source} both write {name}")
                parts[name] += files
    result = stage.combine(prepared, partials, config)
    streams = {name: Stream(tuple(written_parts) or sink.empty(name), mapper) for name, written_parts in parts.items()}
    return _checked(stage, result, streams, mapper)


@dataclass(frozen=True)
class _Work:
    source: str
    number: int
    part: Part
    run_batch: Callable[..., Any]
    prepared: Any
    config: Any
    sink: Sink


def _run_part(work: _Work) -> tuple[list[object], Written]:
    """Run a stage over all chunks of one part. This is one task of a worker."""
    partials = []
    with work.sink.open(work.number) as sink:
        for chunk in work.part.chunks():
            piece = work.run_batch(work.source, chunk, work.prepared, work.config)
            for name, batch in piece.streams.items():
                sink.add(name, batch)
            partials.append(piece.partial)
    return partials, sink.written()


def _checked(stage: ModuleType, outputs: Any, streams: Mapping[str, Stream], mapper: Mapper) -> Any:
    """Return the outputs with the streams put in, and with the tables as they would be after writing and reading."""
    if not isinstance(outputs, stage.Outputs):
        raise TypeError(f"{stage.__name__} must return its Outputs, not {type(outputs).__name__}")
    values: dict[str, Any] = dict(streams)
    optional = {field.name for field in dataclasses.fields(stage.Outputs) if field.default is None}
    for name, marker in declared(stage.Outputs).items():
        value = getattr(outputs, name)
        if value is None and name in optional:
            continue
        if isinstance(marker, Document):
            if not isinstance(value, str):
                raise TypeError(f"{stage.__name__}: {name} must be text, not {type(value).__name__}")
        elif isinstance(marker, Artefact) and marker.kind == "table":
            values[name] = from_arrow(to_arrow(value, marker))
        elif name not in streams or value != EMPTY_STREAM:
            raise TypeError(f"{stage.__name__}: run_batch fills stream {name}: leave it EMPTY_STREAM")
    return dataclasses.replace(outputs, **values)


def run_in_memory(stage: ModuleType, inputs: Any, config: Any, mapper: Mapper = serial) -> Any:
    """Call a stage without any file, for campaigns of simulated sessions and for tests, and return its Outputs.

    Parameters
    ----------
    stage
        The stage's module.
    inputs, config
        The stage's Inputs and Config.
    mapper
        Maps a function over the parts.
    """
    outputs = declared(stage.Outputs)
    streams = {name: marker for name, marker in outputs.items() if isinstance(marker, Artefact) and is_stream(marker)}
    return evaluate(stage, inputs, config, MemorySink(streams), mapper=mapper)
