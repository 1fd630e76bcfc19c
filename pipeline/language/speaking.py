"""Printing of text for people, in the language of this process."""

import re
import sys
from typing import TextIO

from pipeline.console import printable
from pipeline.errors import ArtefactError
from pipeline.language.chosen import translated, wholly_translated
from pipeline.language.letters import has_wide

# A command to be typed, indented, perhaps numbered, perhaps with its description behind it.
_COMMAND = re.compile(r"(?P<command>\s+(?:\d+\s+)?(?:\S*/)?poolcal [a-z].*?)(?P<gap>\s{2,}|$)(?P<words>.*)")
_TABLE = re.compile(r"\S {2,}\S")  # blanks between two columns


def _spoken(line: str) -> str:
    """Return a line in the language of this process. What is to be typed stays as it is."""
    command = _COMMAND.fullmatch(line)
    if command is not None:
        return command["command"] + command["gap"] + translated(command["words"])
    if not has_wide(line):
        return translated(line)
    return line if _TABLE.search(line) else wholly_translated(line)


def say(text: str, stream: TextIO, as_is: bool = False) -> None:
    """Print lines of text to a stream, in the language of this process.

    A line of a table, whose cells are translated, is not translated again.

    The program goes on if the reader of a pipe has ended. It also goes on if standard error cannot be written, because
    an error message would go to the same place.

    Parameters
    ----------
    text
        The lines.
    stream
        Standard output or standard error.
    as_is
        Whether the text is data, such as JSON, which is never translated.

    Raises
    ------
    ArtefactError
        Standard output, which takes the program's answer, cannot be written.
    """
    lines = "\n".join(printable(line if as_is else _spoken(line)) for line in text.split("\n"))
    try:
        print(lines, file=stream, flush=True)
    except BrokenPipeError:
        return
    except OSError as error:
        if stream is sys.stdout:
            raise ArtefactError(
                f"standard output: cannot be written ({error.strerror}); make room, or send it elsewhere"
            ) from error
