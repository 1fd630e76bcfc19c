"""Whether RUN/report/report.html shows the present state of the run."""

import functools
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.atomic_files import sha256
from pipeline.language.chosen import language
from pipeline.run import manifest
from pipeline.run.results import PAGE, agreeing
from pipeline.run.settings import read_settings

HEAD = 2000  # bytes at the start of the page that contain its digest


def page_digest(run: Path, manifests: Mapping[str, manifest.Manifest]) -> str:
    """Return a digest of the results, settings and raw files on the page, of what draws it, and of its language.

    Parameters
    ----------
    run
        The run folder.
    manifests
        The manifests of all stages.
    """
    shown = [[stage, of_stage.outputs, of_stage.key.raw] for stage, of_stage in manifests.items()]
    settings = read_settings(run)
    content = [shown, settings.as_json(), dict(settings.files), dict(settings.stated), _drawn_by(), language()]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@functools.cache
def _drawn_by() -> list[str]:
    """Return the digests of the files in this folder: a newer program draws the page anew."""
    files = sorted(path for path in Path(__file__).parent.iterdir() if path.suffix in (".py", ".html"))
    return [sha256(path) for path in files]


def is_page_outdated(run: Path, stages: Sequence[str]) -> bool:
    """Return whether the page is missing or out of date. False if the stages do not agree: it cannot be drawn then."""
    manifests = agreeing(run, stages)
    if len(manifests) < len(stages):
        return False
    path = run / "report" / PAGE
    if not path.is_file():
        return True
    with path.open("rb") as file:
        return f'content="{page_digest(run, manifests)}"'.encode() not in file.read(HEAD)
