"""What may be drawn together, where it lies, and whether RUN/report/report.html shows the run as it is now."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.run import folder, manifest

PAGE = "report.html"
HEAD = 2000  # bytes within which the page says what it was drawn from


def recording_path(run: Path, stage: str) -> Path:
    """Where a stage's recording lies."""
    return run / stage / f"{stage}.rrd"


def agreeing(run: Path, stages: Sequence[str]) -> dict[str, manifest.Manifest]:
    """The finished stages that follow from each other and from run.yaml, in order."""
    settings = folder.read_settings(run).resolved_plainly()
    found: dict[str, manifest.Manifest] = {}
    for stage in stages:
        one = manifest.read(run / stage)
        if one is not None and manifest.consistent(found | {stage: one}) and _as_set(one, settings):
            found[stage] = one
    return found


def _as_set(one: manifest.Manifest, settings: Mapping[str, Any]) -> bool:
    """Whether the stage ran with the settings in run.yaml."""
    return all(name in settings and settings[name] == value for name, value in one.key.config.items())


def drawn_from(run: Path, done: Mapping[str, manifest.Manifest]) -> str:
    """Of everything that the page shows: it changes whenever a result, a setting or a raw file does."""
    shown = [[stage, one.outputs, one.key.raw] for stage, one in done.items()]
    settings = folder.read_settings(run).as_json()
    return hashlib.sha256(json.dumps([shown, settings], sort_keys=True).encode()).hexdigest()


def page_to_draw(run: Path, stages: Sequence[str]) -> bool:
    """Whether the page is missing or shows something else. Stages that do not agree are not drawn together."""
    done = agreeing(run, stages)
    if len(done) < len(stages):
        return False
    path = run / "report" / PAGE
    if not path.is_file():
        return True
    with path.open("rb") as file:
        return f'content="{drawn_from(run, done)}"'.encode() not in file.read(HEAD)
