"""Bring a run folder's stages up to date, and run only those that are not.

The stages themselves come from above (:mod:`stages`): this module knows their protocol
(:mod:`pipeline.run.stage_protocol`), not their names.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

from pipeline.config.session import Calibrated
from pipeline.errors import ArtefactError
from pipeline.run import folder, manifest
from pipeline.run.digests import Digests
from pipeline.run.execute import execute_stage
from pipeline.run.freshness import Run, out_of_date
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
from pipeline.run.stage_protocol import name_of
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
    names = [name_of(stage) for stage in stages]
    with folder.locked(run_folder, names):
        refuse_other_sensor(run_folder, calibrated)
        this = _open(run_folder, settings, names, workers, progress)
        if not overwrite:
            refuse_other_session(this, names)
        write_settings(run_folder, settings)
        first = not any(manifest.read_manifest(this.folder(name)) for name in names)
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
        this = _open(run_folder, settings, names, workers, progress)
        if new:
            refuse_other_session(this, names)
        write_settings(run_folder, settings)
        for stage in stages[: names.index(name)]:
            if why := out_of_date(this, stage):
                raise ArtefactError(f"{run_folder}: {name_of(stage)}: {why[0]}; run stage {name_of(stage)} first")
        return _bring_up_to_date(this, stages[names.index(name)])


def _open(
    path: Path, settings: Settings, stages: Sequence[str], workers: Workers, progress: Progress | None
) -> Run:
    path = path.absolute()  # workers elsewhere have another working directory
    digests = Digests(path / folder.DIGESTS, workers.here)
    return Run(
        path=path,
        settings=settings,
        digests=digests,
        stages=tuple(stages),
        workers=workers,
        progress=progress or Progress(quiet=True),
    )


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
        execute_stage(this, stage)
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
