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
    """Print the result of a run, with a note on an assumed drift, and return the exit status: 1 if it was rejected."""
    from pipeline.results.pages.assumptions import note_of_run
    from pipeline.results.screen import summary
    from pipeline.run.results import calibration
    from pipeline.text_table import wrapped

    result = calibration(run, several_heads=True)
    note = note_of_run(run, result)
    lines = [summary(result), *(wrapped(f"Note: {note}.") if note else ())]
    return print_answer("\n".join(lines), result["verdict"] == "accepted")


def say_where(run: Path) -> None:
    """Print the path of the report's page, and the command that shows the recordings."""
    page = run / "report" / "report.html"
    if page.is_file():
        say(f"Report: {page}", sys.stdout)
    if any(run.glob("*/*.rrd")):
        say(f"See the recordings: {_command('view', run)}", sys.stdout)


def say_next(run: Path, heads: Sequence[str] = ()) -> None:
    """Print what comes after an accepted calibration of the sonar: entering its values, and proving that.

    ``heads``: names of the sonar's heads, if it has several.
    """
    if heads:
        lines = ["Next: enter the values of each head in your survey software (poolcal export --list shows all):"]
        lines += [f"  {_command('export', run)} --head {head} --to NAME" for head in heads]
    else:
        lines = [
            "Next: enter the values in your survey software (poolcal export --list shows all), and prove that:",
            f"  {_command('export', run)} --to NAME",
            f"  {_command('check-entry', run)} SOUNDINGS",
        ]
    say("\n".join(lines), sys.stdout)


def _command(name: str, run: Path) -> str:
    """Return a command on a run, quoted for the shell, with the program as the user called it."""
    program = sys.argv[0] if Path(sys.argv[0]).name == "poolcal" else "poolcal"
    place = str(run) if not str(run).startswith("-") else f"./{run}"
    return f"{shlex.quote(program)} {name} {shlex.quote(place)}"


def say_failures(failures: "Sequence[DrawingFailure]", but: str = "") -> None:
    """Print which drawings failed, and why; ``but``: text at the end of each line. The result stays valid."""
    for failure in failures:
        if failure.trace:
            say(failure.trace, sys.stderr, as_is=True)
        say(f"{failure.kind}: not drawn ({failure.reason}){but}", sys.stderr)
