"""Run one stage: read its inputs, call it, write its outputs, and record in its manifest what they depend on."""

import time
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.artefacts.schema import RawFiles
from pipeline.artefacts.sinks import FolderSink
from pipeline.atomic_files import remove
from pipeline.config.stage_settings import stage_config
from pipeline.errors import ArtefactError, RawDataError
from pipeline.run import folder, manifest, provenance
from pipeline.run.digests import Digests
from pipeline.run.freshness import Run, inputs_of, key_of, raw_digests_now, raw_of
from pipeline.run.kept_results import keep_accepted
from pipeline.run.stage_files import make_folders, read_input, rows_to_map, write_outputs
from pipeline.run.stage_protocol import declared, evaluate, name_of


def execute_stage(this: Run, stage: ModuleType) -> None:
    """Run a stage in its partial folder, and put this folder in the place of the old result.

    If the stage fails, the partial folder is removed.
    """
    start = time.perf_counter()
    target = this.folder(name_of(stage))
    partial = folder.partial(target)
    key = key_of(this, stage)
    config = stage_config(stage.Config, this.settings.resolved())
    inputs = stage.Inputs(**{name: read_input(this, marker) for name, marker in inputs_of(this, stage).items()})
    remove(partial)
    try:
        streams = make_folders(partial, stage)
        total = rows_to_map(this, stage)
        sink = FolderSink(partial, streams)
        outputs = evaluate(
            stage, inputs, config, sink, mapper=this.workers.map, begin=lambda: this.progress.begin(total)
        )
        rows = write_outputs(partial, stage, outputs)
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
    except BaseException:  # whatever stops it, Ctrl-C included
        _remove_quietly(partial)
        raise


def _raw_has_changed(this: Run, stage: ModuleType) -> bool:
    """Return whether a raw file that the stage has read has changed since this run first hashed it."""
    sensors = [marker.sensor for marker in declared(stage.Inputs).values() if isinstance(marker, RawFiles)]
    return any(raw_digests_now(this, sensor) != raw_of(this, sensor) for sensor in sensors)


def _remove_quietly(partial: Path) -> None:
    """Remove the partial folder after a failure.

    If that fails too, nothing is raised: the user must see the error of the stage.
    """
    try:
        remove(partial)
    except ArtefactError:
        return


def _entries(this: Run, partial: Path) -> dict[str, dict[str, Any]]:
    paths = sorted(path for path in partial.rglob("*") if path.is_file())
    return {
        path.relative_to(partial).as_posix(): {"sha256": digest, "bytes": path.stat().st_size}
        for path, digest in zip(paths, Digests(None, this.digests.mapper).of(paths), strict=True)
    }
