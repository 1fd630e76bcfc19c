"""What may be drawn together, where it lies, and whether RUN/report/report.html shows the run as it is now."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.run import manifest
from pipeline.run.results import PAGE, agreeing
from pipeline.run.settings import read_settings

HEAD = 2000  # bytes within which the page says what it was drawn from


def drawn_from(run: Path, done: Mapping[str, manifest.Manifest]) -> str:
    """Of everything that the page shows: it changes whenever a result, a setting or a raw file does."""
    shown = [[stage, one.outputs, one.key.raw] for stage, one in done.items()]
    settings = read_settings(run).as_json()
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
