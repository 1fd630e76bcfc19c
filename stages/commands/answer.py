"""Print what a command says at its end: the answer, what could not be drawn, where to look next."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.console import say

if TYPE_CHECKING:
    from stages.commands.one_drawing import DrawingFailure


def print_answer(text: str, is_yes: bool) -> int:
    """Print an answer; return the exit status, 1 for a no."""
    say(text, sys.stdout)
    return 0 if is_yes else 1


def print_result(run: Path) -> int:
    """Print the result of a run; return the exit status, 1 if it was rejected."""
    from pipeline.results.screen import summary
    from pipeline.run.results import calibration

    result = calibration(run)
    return print_answer(summary(result), result["verdict"] == "accepted")


def say_where(run: Path) -> None:
    """Say where to look next: the page, and the command that shows the recordings."""
    page = run / "report" / "report.html"
    if page.is_file():
        say(f"Report: {page}", sys.stdout)
    if any(run.glob("*/*.rrd")):
        program = sys.argv[0] if Path(sys.argv[0]).name == "poolcal" else "poolcal"  # as it was called
        place = str(run) if not str(run).startswith("-") else f"./{run}"
        say(f"Recordings: {program} view {shlex.quote(place)}", sys.stdout)


def say_failures(failures: "Sequence[DrawingFailure]", but: str = "") -> None:
    """Say what could not be drawn; ``but``: what holds all the same. Drawings are a help: the result stands."""
    for failure in failures:
        if failure.trace:
            say(failure.trace, sys.stderr)
        say(f"{failure.kind}: not drawn ({failure.reason}){but}", sys.stderr)
