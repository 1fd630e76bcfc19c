"""Check a run folder against its manifests: everything that was read and written is hashed again."""

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType

from pipeline.errors import PoolcalError
from pipeline.run import folder, manifest
from pipeline.run.digests import Digests
from pipeline.run.freshness import OF_HEADS, Run, digests_now, key_of
from pipeline.run.settings import RUN_YAML, read_settings
from pipeline.run.stage_protocol import name_of, of_each_head
from pipeline.run.workers import SERIAL, Workers


def problems_of_run(stages: Sequence[ModuleType], run_folder: Path, workers: Workers = SERIAL) -> list[str]:
    """Hash all files that a run read and wrote, and return one text line for each difference from its manifests.

    Parameters
    ----------
    stages
        The modules of the run's stages.
    run_folder
        The run folder; it is only read.
    workers
        The threads that hash the files.
    """
    settings = read_settings(run_folder)
    with folder.reading(run_folder):
        names = tuple(name_of(stage) for stage in stages)
        digests = Digests(None, workers.here)
        heads = {
            head: Run(run_folder / OF_HEADS / head, settings.of_head(head), digests, names, workers)
            for head in list(settings.session.heads)[1:]
        }
        this = Run(run_folder, settings, digests, names, workers, heads=heads)
        of_heads = [
            f"{head}/{name_of(stage)}: {problem}"
            for head, run in heads.items()
            for stage in of_each_head(stages)
            for problem in _problems(run, stage)
        ]
        return of_heads + [f"{name_of(stage)}: {problem}" for stage in stages for problem in _problems(this, stage)]


def _problems(this: Run, stage: ModuleType) -> Iterator[str]:
    old = manifest.read_manifest(this.folder(name_of(stage)))
    if old is None:
        yield "has no complete result"
        return
    try:
        now = key_of(this, stage)
    except PoolcalError as error:
        yield str(error)
        return
    recorded = dataclasses.replace(now, config=old.key.config, source=old.key.source, versions=old.key.versions)
    yield from manifest.reasons_out_of_date(old, recorded, digests_now(this, this.folder(name_of(stage)), old))
    where = this.folder(name_of(stage))
    for path in sorted(where.rglob("*.parquet")):
        if path.relative_to(where).as_posix() not in old.outputs:
            yield f"{path.relative_to(where).as_posix()} is not its own"
    for name in sorted(now.config.keys() | old.key.config.keys()):
        if now.config.get(name) != old.key.config.get(name):
            yield f"{name} is not as in {RUN_YAML}"
