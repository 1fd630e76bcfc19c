"""``poolcal diff``: two runs compared, on the screen, as JSON, as a page and as a recording."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.atomic_files import write_text, writing
from pipeline.console import say
from pipeline.results.compare import RunRead, diff, is_moved
from pipeline.results.compare_text import text
from pipeline.run.output_files import refuse_output
from stages import ORDER


@dataclass(frozen=True)
class DiffOutputs:
    """In which forms the comparison is wanted, beside lines on the screen."""

    as_json: bool  # in their place
    html: Path | None
    rrd: Path | None


def command(
    first: Path, second: Path, tolerance_deg: float | None, tolerance_mm: float | None, outputs: DiffOutputs
) -> int:
    """Compare two runs.

    Parameters
    ----------
    first, second
        Run folders.
    tolerance_deg, tolerance_mm
        An angle, or a coordinate of the lever arm, that differs by more is a no, significant or not; None: any may.
    outputs
        Forms of the comparison.

    Returns
    -------
    int
        1: the mounts differ, or cannot be compared.
    """
    comparison = compare_runs(first, second, tolerance_deg, tolerance_mm)
    for option, file in (("--html", outputs.html), ("--rrd", outputs.rrd)):
        refuse_output(option, file, first, second)
    if outputs.html is not None:
        from pipeline.results.pages.comparison import page

        write_text(outputs.html, page(comparison))
    if outputs.rrd is not None:
        write_pair(first, second, comparison, outputs.rrd)
    as_json = json.dumps(comparison, indent=1, ensure_ascii=False) if outputs.as_json else None
    say(text(comparison) if as_json is None else as_json, sys.stdout)
    return 1 if is_moved(comparison) else 0


def compare_runs(
    first: Path, second: Path, tolerance_deg: float | None = None, tolerance_mm: float | None = None
) -> dict[str, Any]:
    """Return the comparison of two run folders; tolerances as in :func:`command`."""
    return diff(RunRead.read(first, ORDER), RunRead.read(second, ORDER), tolerance_deg, tolerance_mm)


def write_pair(first: Path, second: Path, comparison: dict[str, Any], path: Path) -> None:
    """Write both runs as one recording.

    Parameters
    ----------
    first, second
        Run folders.
    comparison
        Theirs, of :func:`compare_runs`.
    path
        The recording's file.
    """
    from stages.views.two_runs import save_pair

    with writing(path):
        save_pair(first, second, comparison, path)
