"""``poolcal diff``: the difference of two runs on the screen, as JSON, as a page and as a recording."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.atomic_files import write_text, writing
from pipeline.errors import ConfigError
from pipeline.language.speaking import say
from pipeline.results.diff import difference_by_head
from pipeline.results.diff_text import difference_text
from pipeline.results.finished_run import FinishedRun
from pipeline.results.mount_difference import is_moved
from pipeline.results.units import Tolerances
from pipeline.run.output_files import refuse_output
from stages import ORDER


@dataclass(frozen=True)
class DiffOutputs:
    """The forms of the output: JSON or text on the screen, a page and a recording in files; None: no file."""

    as_json: bool  # else text
    html: Path | None
    rrd: Path | None


def command(first: Path, second: Path, tolerances: Tolerances, outputs: DiffOutputs) -> int:
    """Compare two runs.

    Parameters
    ----------
    first, second
        Run folders.
    tolerances
        A larger difference of the mount gives status 1, even if it is not significant.
    outputs
        The forms of the output.

    Returns
    -------
    int
        0: no movement of the mount is shown; 1: it has moved, or the mounts cannot be compared.
    """
    difference = compare_runs(first, second, tolerances)
    if "heads" in difference and (outputs.html is not None or outputs.rrd is not None):
        raise ConfigError("--html, --rrd: show one head; of a sonar with several heads there is the text, and --json")
    for option, file in (("--html", outputs.html), ("--rrd", outputs.rrd)):
        refuse_output(option, file, first, second)
    if outputs.html is not None:
        from pipeline.results.pages.diff import difference_page

        write_text(outputs.html, difference_page(difference))
    if outputs.rrd is not None:
        write_two_runs(first, second, difference, outputs.rrd)
    text = json.dumps(difference, indent=1, ensure_ascii=False) if outputs.as_json else difference_text(difference)
    say(text, sys.stdout, as_is=outputs.as_json)
    return 1 if any(map(is_moved, difference.get("heads", [difference]))) else 0


def compare_runs(first: Path, second: Path, tolerances: Tolerances) -> dict[str, Any]:
    """Return the difference of two run folders, of :func:`pipeline.results.diff.difference_by_head`.

    Parameters
    ----------
    first, second
        The run folders.
    tolerances
        A mount parameter with a larger difference is listed by name.
    """
    before, after = (FinishedRun.read(folder, ORDER, several_heads=True) for folder in (first, second))
    return difference_by_head(before, after, tolerances)


def write_two_runs(first: Path, second: Path, difference: dict[str, Any], path: Path) -> None:
    """Write a recording of two run folders.

    Parameters
    ----------
    first, second
        The run folders.
    difference
        Their difference, of :func:`compare_runs`.
    path
        The recording's file.
    """
    from stages.views.two_runs import save_two_runs

    with writing(path):
        save_two_runs(first, second, difference, path)
