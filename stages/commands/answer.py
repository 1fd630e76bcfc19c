"""What a command says at its end: the answer, what could not be drawn, where to look next."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.console import say

if TYPE_CHECKING:
    from stages.commands.draw import Failure


def say_where(run_folder: Path) -> None:
    """Where to look next."""
    page = run_folder / "report" / "report.html"
    if page.is_file():
        say(f"Report: {page}", sys.stdout)
    if any(run_folder.glob("*/*.rrd")):
        program = sys.argv[0] if Path(sys.argv[0]).name == "poolcal" else "poolcal"  # as it was called
        place = str(run_folder) if not str(run_folder).startswith("-") else f"./{run_folder}"
        say(f"Recordings: {program} view {shlex.quote(place)}", sys.stdout)


def say_failures(failed: "Sequence[Failure]", but: str = "") -> None:
    """Pictures are a help to see by: whatever goes wrong in drawing is said, and what has been computed stands."""
    for one in failed:
        if one.trace:
            say(one.trace, sys.stderr)
        say(f"{one.what}: not drawn ({one.reason}){but}", sys.stderr)


def answer_of(run_folder: Path) -> int:
    """Print the result; 1 if it was rejected."""
    from pipeline.results.screen import summary
    from pipeline.run.results import calibration

    result = calibration(run_folder)
    say(summary(result), sys.stdout)
    return 0 if result["verdict"] == "accepted" else 1
