"""The command line. Each module declares the arguments of some commands, and passes them to :mod:`stages.commands`.

A command's module and its imports are loaded only when the command is called. Therefore ``--help`` answers at once.
"""

import atexit
import sys
from pathlib import Path

from pipeline.errors import ConfigError
from pipeline.language.chosen import choose
from stages.cli import calibrating, looking, preparing, surveying  # in this order the help lists their commands
from stages.cli.application import app
from stages.commands import entry, guide

__all__ = ["calibrating", "call", "looking", "main", "preparing", "surveying"]


def call(arguments: list[str]) -> int:
    """Run a command line and return its exit status; no exception is raised."""
    debug = "--debug" in arguments  # this and --lang may stand anywhere in the line
    words = [word for word in arguments if word != "--debug"]
    try:
        words = _without_language(words)
    except ConfigError as error:
        return entry.refused(error, debug)
    if not words:
        names = [info.name for info in app.registered_commands if info.name is not None]
        return entry.status_of(lambda: guide.command(names, Path()), debug)
    return entry.status_of(lambda: app(words, prog_name="poolcal", standalone_mode=False), debug)


def _without_language(words: list[str]) -> list[str]:
    """Choose the language that ``--lang`` names, or the usual one, and return the other words."""
    asked = None
    for place, word in enumerate(words):
        if word == "--":
            break
        if word.startswith("--lang=") or (word == "--lang" and place + 1 < len(words)):
            taken = 1 if "=" in word else 2
            asked = word.partition("=")[2] if "=" in word else words[place + 1]
            words = words[:place] + words[place + taken :]
            break
    choose(asked)
    return words


def main() -> None:
    """Run the command line of this process, as the console script does."""
    atexit.register(entry.leave)
    entry.prepare_process()
    entry.end_process(call(sys.argv[1:]))
