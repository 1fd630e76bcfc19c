"""Bring a run folder's stages up to date: read, run, write, and remember what was read.

The stages themselves come from above (:mod:`stages`): this module knows their protocol
(:mod:`pipeline.run.stage_protocol`), not their names.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.artefacts import parquet
from pipeline.artefacts.schema import Artefact, Document, Provenance, RawFiles
from pipeline.artefacts.sinks import FolderSink
from pipeline.artefacts.streams import EMPTY_STREAM, Chunk, ParquetPart, Part, Stream
from pipeline.atomic_files import remove, write_text, writing
from pipeline.config.session import Calibrated
from pipeline.config.stage_settings import stage_config
from pipeline.errors import ArtefactError, RawDataError
from pipeline.readers import dispatch
from pipeline.run import folder, manifest, provenance
from pipeline.run.digests import Digests
from pipeline.run.freshness import Run, all_raw, key_of, out_of_date, raw_digests, raw_of
from pipeline.run.kept_results import keep_accepted
from pipeline.run.other_session import refuse_other_session
from pipeline.run.progress import Progress
from pipeline.run.settings import (
    Settings,
    load_settings,
    read_settings,
    refuse_other_sensor,
    refuse_shared_folder,
    write_settings,
)
from pipeline.run.stage_protocol import declared, evaluate, is_stream, name_of, sources
from pipeline.run.workers import SERIAL, Stopped, Workers


def run(
    stages: Sequence[ModuleType],
    session_folder: Path,
    config_path: Path,
    run_folder: Path,
    *,
    workers: Workers = SERIAL,
    progress: Progress | None = None,
    finished: Callable[[str], object] = lambda _: None,
    calibrated: Calibrated = "mbes",
    overwrite: bool = False,
) -> list[str]:
    """Bring every stage up to date.

    Parameters
    ----------
    stages
        Their modules, in order.
    session_folder, config_path
        The session's folder and the pool's YAML file.
    run_folder
        The folder for the results.
    workers
        Where parts are worked on.
    progress
        What is printed; None: nothing.
    finished
        Called with the name of each stage that had to be run, as it is done.
    calibrated
        The sensor that is calibrated.
    overwrite
        Replace another session's results; else a folder with such is refused.

    Returns
    -------
    list
        The names of the stages that had to be run.
    """
    settings = load_settings(session_folder, config_path, calibrated)
    refuse_shared_folder(run_folder, session_folder)
    with folder.locked(run_folder, [name_of(stage) for stage in stages]):
        refuse_other_sensor(run_folder, calibrated)
        this = _open(run_folder, settings, workers, progress)
        if not overwrite:
            refuse_other_session(this, [name_of(stage) for stage in stages])
        write_settings(run_folder, settings)
        first = not any(manifest.read_manifest(this.folder(name_of(stage))) for stage in stages)
        had_to_run = []
        for stage in stages:
            if _bring_up_to_date(this, stage, first):
                had_to_run.append(name_of(stage))
                finished(name_of(stage))
        return had_to_run


def run_stage(
    stages: Sequence[ModuleType],
    name: str,
    run_folder: Path,
    *,
    settings: Settings | None = None,
    workers: Workers = SERIAL,
    progress: Progress | None = None,
) -> bool:
    """Bring one stage up to date; those before it must be.

    Parameters
    ----------
    stages
        The modules of all stages, in order.
    name
        The stage that is wanted.
    run_folder
        The run folder.
    settings
        New ones; None: those in run.yaml.
    workers
        Where parts are worked on.
    progress
        What is printed; None: nothing.

    Returns
    -------
    bool
        Whether it had to be run.
    """
    names = [name_of(stage) for stage in stages]
    new = settings is not None
    if settings is None:
        settings = read_settings(run_folder)
    refuse_shared_folder(run_folder, settings.session_folder)
    with folder.locked(run_folder, names):
        this = _open(run_folder, settings, workers, progress)
        if new:
            refuse_other_session(this, names)
        write_settings(run_folder, settings)
        for stage in stages[: names.index(name)]:
            if why := out_of_date(this, stage):
                raise ArtefactError(f"{run_folder}: {name_of(stage)}: {why[0]}; run stage {name_of(stage)} first")
        return _bring_up_to_date(this, stages[names.index(name)])


def _open(path: Path, settings: Settings, workers: Workers, progress: Progress | None) -> Run:
    path = path.absolute()  # workers elsewhere have another working directory
    digests = Digests(path / folder.DIGESTS, workers.here)
    return Run(path, settings, digests, workers, progress or Progress(quiet=True))


# --- reading, running, writing ---------------------------------------------------------------------------------------
def _bring_up_to_date(this: Run, stage: ModuleType, first: bool = False) -> bool:
    """Return whether it had to be run; in a folder's ``first`` run no reasons are printed."""
    name = name_of(stage)
    reasons = out_of_date(this, stage)
    if not reasons:
        folder.touch(this.folder(name))
        this.progress.note(f"{name}: up to date")
        return False
    if not first:
        this.progress.reasons(name, reasons)
    with this.progress.stage(name):
        _execute(this, stage)
    for line in _losses(manifest.read_manifest(this.folder(name))):
        this.progress.note(f"{name}: {line}")
    return True


def _losses(done: manifest.Manifest | None) -> list[str]:
    """Return lines on data that could not be used: a cut file, or a log that is too short, must not pass in silence."""
    if done is None or done.stage not in ("ingest", "georeference"):
        return []
    total: dict[str, int] = {}
    for row in done.counts:
        total[row["source"]] = total.get(row["source"], 0) + row["count"]

    def is_worth_saying(source: str, reason: str, count: int) -> bool:
        if done.stage == "ingest":
            return count > 0 and reason not in ("used", "no detection")
        return count > total[source] / 100 and reason in ("outside every pass", "hole in the INS")

    lost = [row for row in done.counts if is_worth_saying(row["source"], row["reason"], row["count"])]
    return [f"{r['source']}: left out {r['count']:,} of {total[r['source']]:,}: {r['reason']}" for r in lost]


def _execute(this: Run, stage: ModuleType) -> None:
    start = time.perf_counter()
    target = this.folder(name_of(stage))
    partial = folder.partial(target)
    key = key_of(this, stage)
    config = stage_config(stage.Config, this.settings.resolved())
    inputs = stage.Inputs(**{name: _read(this, marker) for name, marker in declared(stage.Inputs).items()})
    remove(partial)
    try:
        streams = _make_folders(partial, stage)
        total = _rows_to_map(this, stage)
        sink = FolderSink(partial, streams)
        outputs = evaluate(
            stage, inputs, config, sink, mapper=this.workers.map, begin=lambda: this.progress.begin(total)
        )
        rows = _write(partial, stage, outputs)
        if _raw_has_changed(this, stage):
            raise RawDataError(f"{this.settings.session_folder}: files changed while they were read; run again")
        entries = _entries(this, partial)
        counts = getattr(outputs, "counts", None)
        manifest.Manifest(
            stage=name_of(stage),
            key=key,
            outputs=entries,
            rows=rows,
            counts=[] if counts is None else counts.to_dict("records"),
            git_commit=provenance.git_commit(),
            wall_s=round(time.perf_counter() - start, 3),
        ).write(partial)
        kept = keep_accepted(target)
        folder.swap_in(target)
        if kept is not None:
            this.progress.note(f"{name_of(stage)}: the accepted result that was there is kept in {kept}")
    except BaseException:
        _remove_quietly(partial)
        raise


def _raw_has_changed(this: Run, stage: ModuleType) -> bool:
    """Return whether a raw file that the stage has read is not what it was when this run first looked at it."""
    sensors = [marker.sensor for marker in declared(stage.Inputs).values() if isinstance(marker, RawFiles)]
    return any(raw_digests(this, sensor) != raw_of(this, sensor) for sensor in sensors)


def _remove_quietly(partial: Path) -> None:
    """Remove it after a failure: the error to show is what made the stage fail, not what hinders the tidying up."""
    try:
        remove(partial)
    except ArtefactError:
        return


def _make_folders(partial: Path, stage: ModuleType) -> dict[str, Artefact]:
    streams = {n: m for n, m in declared(stage.Outputs).items() if isinstance(m, Artefact) and is_stream(m)}
    with writing(partial):
        partial.mkdir()
        for marker in streams.values():
            (partial / marker.name).mkdir()
    return streams


def _rows_to_map(this: Run, stage: ModuleType) -> int | None:
    """Return the number of rows of the streams that are mapped; None where raw files do not tell."""
    markers = declared(stage.Inputs)
    total = 0
    for source in sources(stage):
        marker = markers[source]
        owner = manifest.read_manifest(this.folder(marker.owner)) if isinstance(marker, Artefact) else None
        if owner is None or not isinstance(marker, Artefact):
            return None
        total += owner.rows.get(marker.name, 0)
    return total


def _read(this: Run, marker: Artefact | Document | RawFiles | Provenance) -> Any:
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
    """A part that counts its rows for the progress bar, and ends when the run has failed elsewhere."""

    part: Part
    this: Run

    @property
    def name(self) -> str:
        return self.part.name

    def chunks(self) -> Iterator[Chunk]:
        for chunk in self.part.chunks():
            if self.this.workers.stop.is_set():
                raise Stopped
            yield chunk
            self.this.progress.advance(len(next(iter(chunk.columns.values()), ())))


def _stream(this: Run, parts: Sequence[Part]) -> Stream:
    watched = [_Watched(part, this) for part in parts] if this.workers.local else parts
    return Stream(tuple(watched), this.workers.map)


def _write(partial: Path, stage: ModuleType, outputs: Any) -> dict[str, int]:
    """Write tables and documents (streams have been written part by part); return the rows by artefact."""
    rows: dict[str, int] = {}
    for name, marker in declared(stage.Outputs).items():
        value = getattr(outputs, name)
        if isinstance(marker, Document):
            write_text(partial / marker.name, value)
        elif isinstance(marker, Artefact) and marker.kind == "table":
            parquet.write_table(partial / f"{marker.name}.parquet", parquet.to_arrow(value, marker))
            rows[marker.name] = len(value)
        elif isinstance(marker, Artefact):
            rows[marker.name] = sum(parquet.row_count(path) for path in sorted((partial / marker.name).iterdir()))
    return rows


def _entries(this: Run, partial: Path) -> dict[str, dict[str, Any]]:
    paths = sorted(path for path in partial.rglob("*") if path.is_file())
    return {
        path.relative_to(partial).as_posix(): {"sha256": digest, "bytes": path.stat().st_size}
        for path, digest in zip(paths, Digests(None, this.digests.mapper).of(paths), strict=True)
    }
