"""No command: this module prints a command's last lines, with the answer, failed drawings and paths of results."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.language.speaking import say

if TYPE_CHECKING:
    from stages.commands.one_drawing import DrawingFailure


def print_answer(text: str, is_yes: bool, as_is: bool = False) -> int:
    """Print an answer and return the exit status: 0 for yes, 1 for no; ``as_is``: it is JSON, never translated."""
    say(text, sys.stdout, as_is)
    return 0 if is_yes else 1


def print_result(run: Path) -> int:
    """Print the result of a run and return the exit status: 1 if it was rejected."""
    from pipeline.results.screen import summary
    from pipeline.run.results import calibration

    result = calibration(run)
    return print_answer(summary(result), result["verdict"] == "accepted")


def say_where(run: Path) -> None:
    """Print the path of the report's page, and the command that shows the recordings."""
    page = run / "report" / "report.html"
    if page.is_file():
        say(f"Report: {page}", sys.stdout)
    if any(run.glob("*/*.rrd")):
        program = sys.argv[0] if Path(sys.argv[0]).name == "poolcal" else "poolcal"  # as the user called it
        place = str(run) if not str(run).startswith("-") else f"./{run}"
        say(f"Recordings: {shlex.quote(program)} view {shlex.quote(place)}", sys.stdout)


def say_failures(failures: "Sequence[DrawingFailure]", but: str = "") -> None:
    """Print which drawings failed, and why; ``but``: text at the end of each line. The result stays valid."""
    for failure in failures:
        if failure.trace:
            say(failure.trace, sys.stderr, as_is=True)
        say(f"{failure.kind}: not drawn ({failure.reason}){but}", sys.stderr)
