"""Whether RUN/report/report.html shows the run as it is now."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.run import manifest
from pipeline.run.results import PAGE, agreeing
from pipeline.run.settings import read_settings

HEAD = 2000  # bytes within which the page says what it was drawn from


def page_digest(run: Path, manifests: Mapping[str, manifest.Manifest]) -> str:
    """Return a digest of all results, settings and raw files that the page shows; ``manifests``: of all stages."""
    shown = [[stage, of_stage.outputs, of_stage.key.raw] for stage, of_stage in manifests.items()]
    settings = read_settings(run).as_json()
    return hashlib.sha256(json.dumps([shown, settings], sort_keys=True).encode()).hexdigest()


def is_page_outdated(run: Path, stages: Sequence[str]) -> bool:
    """Whether the page is missing or shows something else, and can be drawn: all stages agree."""
    manifests = agreeing(run, stages)
    if len(manifests) < len(stages):
        return False
    path = run / "report" / PAGE
    if not path.is_file():
        return True
    with path.open("rb") as file:
        return f'content="{page_digest(run, manifests)}"'.encode() not in file.read(HEAD)
