"""Whether RUN/report/report.html shows the present state of the run."""

import functools
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.atomic_files import sha256
from pipeline.language.chosen import language
from pipeline.run import manifest
from pipeline.run.import_closure import import_closure
from pipeline.run.provenance import ROOT
from pipeline.run.results import PAGE, agreeing
from pipeline.run.settings import read_settings

HEAD = 2000  # bytes at the start of the page that contain its digest
DRAWING = ("pipeline.results.pages.report", "pipeline.results.pages.plots")  # modules that make page and pictures


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
    drawn_by = drawing_digests(ROOT, language())
    content = [shown, settings.as_json(), dict(settings.files), dict(settings.stated), drawn_by, language()]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@functools.cache
def drawing_digests(root: Path, code: str) -> list[str]:
    """Return the digests of all that makes the page: a newer program, or a better translation, draws it anew.

    Words of the page come from many packages, so that all modules count that its own can reach by imports.

    Parameters
    ----------
    root
        The folder in which the package ``pipeline`` lies.
    code
        The language.
    """
    catalogue = root / "pipeline" / "language" / code / "poolcal.po"
    files = import_closure(root, DRAWING) + ([catalogue] if catalogue.is_file() else [])
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
