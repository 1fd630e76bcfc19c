"""Bring the stages of a run folder up to date: only stages that are out of date are run.

The caller passes the stages (:mod:`stages`). This module knows only their protocol
(:mod:`pipeline.run.stage_protocol`), not their names.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

from pipeline.artefacts.memory import give_back_memory
from pipeline.atomic_files import remove
from pipeline.config.session import Calibrated
from pipeline.errors import ArtefactError, ConfigError
from pipeline.run import folder, manifest
from pipeline.run.digests import Digests
from pipeline.run.execute import execute_stage
from pipeline.run.found_target import remembered_target
from pipeline.run.freshness import OF_HEADS, Run, out_of_date
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
from pipeline.run.stage_protocol import name_of, of_each_head
from pipeline.run.workers import SERIAL, Workers


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
        The modules of the stages, in order.
    session_folder, config_path
        The session's folder and the pool's YAML file.
    run_folder
        The folder for the results.
    workers
        The threads or the cluster that process the parts of streams.
    progress
        The display of the progress; None: nothing is printed.
    finished
        Function that is called with the name of each stage that was run, when the stage has ended.
    calibrated
        The sensor that is calibrated.
    overwrite
        True: replace the results of another session. False: refuse a folder that holds such results.

    Returns
    -------
    list
        The names of the stages that had to be run.
    """
    names, progress = [name_of(stage) for stage in stages], progress or Progress(quiet=True)
    find = partial(remembered_target, run_folder, names, session_folder, workers=workers, progress=progress)
    settings = load_settings(session_folder, config_path, calibrated, find, several_heads=True)
    refuse_shared_folder(run_folder, session_folder)
    with folder.locked(run_folder, names):
        refuse_other_sensor(run_folder, calibrated)
        this = _open(run_folder, settings, stages, workers, progress)
        if not overwrite:
            refuse_other_session(this, names)
        write_settings(run_folder, settings)
        _remove_absent_heads(this)
        had_to_run = []
        for head, run in this.heads.items():
            with folder.locked(run.path, run.stages):
                write_settings(run.path, run.settings)
                done = _bring_all_up_to_date(run, of_each_head(stages), finished)
                had_to_run += [f"{head}/{name}" for name in done]
        return had_to_run + _bring_all_up_to_date(this, stages, finished)


def _bring_all_up_to_date(
    this: Run, stages: Sequence[ModuleType], finished: Callable[[str], object]
) -> list[str]:
    """Bring stages up to date, and return the names of those that had to be run."""
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
    """Bring one stage up to date; the stages before it must be up to date already.

    Parameters
    ----------
    stages
        The modules of all stages, in order.
    name
        The name of the stage to bring up to date.
    run_folder
        The run folder.
    settings
        New settings; None: the settings in run.yaml.
    workers
        The threads or the cluster that process the parts of streams.
    progress
        The display of the progress; None: nothing is printed.

    Returns
    -------
    bool
        Whether the stage had to be run.
    """
    names = [name_of(stage) for stage in stages]
    new = settings is not None
    if settings is None:
        settings = read_settings(run_folder)
    refuse_shared_folder(run_folder, settings.session_folder)
    with folder.locked(run_folder, names):
        this = _open(run_folder, settings, stages, workers, progress)
        if this.heads:
            raise ConfigError(
                f"{run_folder}: its session has {len(this.heads) + 1} heads, whose stages run together: use poolcal run"
            )
        if new:
            refuse_other_session(this, names)
        write_settings(run_folder, settings)
        for stage in stages[: names.index(name)]:
            if why := out_of_date(this, stage):
                raise ArtefactError(f"{run_folder}: {name_of(stage)}: {why[0]}; run stage {name_of(stage)} first")
        return _bring_up_to_date(this, stages[names.index(name)])


def _open(
    path: Path, settings: Settings, stages: Sequence[ModuleType], workers: Workers, progress: Progress | None
) -> Run:
    """Return a run folder in use, with the runs of the sonar's further heads."""
    path = path.absolute()  # workers of a cluster have another working directory
    digests, heads = Digests(path / folder.DIGESTS, workers.here), list(settings.session.heads)[1:]
    return Run(
        path=path,
        settings=settings,
        digests=digests,
        stages=tuple(name_of(stage) for stage in stages),
        workers=workers,
        progress=progress or Progress(quiet=True),
        heads={
            head: _open(path / OF_HEADS / head, settings.of_head(head), of_each_head(stages), workers, progress)
            for head in heads
        },
    )


def _remove_absent_heads(this: Run) -> None:
    """Remove the runs of heads that the session does not have any more."""
    for path in sorted((this.path / OF_HEADS).glob("*")):
        if path.name not in this.heads:
            remove(path)
    if not this.heads:
        remove(this.path / OF_HEADS)


def _bring_up_to_date(this: Run, stage: ModuleType, first: bool = False) -> bool:
    """Run the stage if it is out of date; return whether it was. In a folder's ``first`` run no reasons are printed."""
    place = this.folder(name_of(stage))
    name = name_of(stage) if this.path.parent.name != OF_HEADS else f"{this.path.name}/{name_of(stage)}"
    reasons = out_of_date(this, stage)
    if not reasons:
        folder.touch(place)
        this.progress.note(f"{name}: up to date")
        return False
    if not first:
        this.progress.reasons(name, reasons)
    with this.progress.stage(name):
        execute_stage(this, stage)
    give_back_memory()
    for line in _losses(manifest.read_manifest(place)):
        this.progress.note(f"{name}: {line}")
    return True


def _losses(done: manifest.Manifest | None) -> list[str]:
    """Return text lines with the counts of data left out, so that a cut file or a short log is noticed."""
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
