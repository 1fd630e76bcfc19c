"""The command line. Each module declares the arguments of some commands, and passes them to :mod:`stages.commands`.

A command's module and its imports are loaded only when the command is called. Therefore ``--help`` answers at once.
"""

import sys

from stages.cli import calibrating, looking, preparing, surveying  # in this order the help lists their commands
from stages.cli.application import app
from stages.commands import entry

__all__ = ["calibrating", "call", "looking", "main", "preparing", "surveying"]


def call(arguments: list[str]) -> int:
    """Run a command line and return its exit status; no exception is raised."""
    debug = "--debug" in arguments  # may stand anywhere in the line
    words = [word for word in arguments if word != "--debug"] or ["--help"]
    return entry.status_of(lambda: app(words, prog_name="poolcal", standalone_mode=False), debug)


def main() -> None:
    """Run the command line of this process, as the console script does."""
    entry.prepare_process()
    entry.end_process(call(sys.argv[1:]))
