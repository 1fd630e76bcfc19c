"""What a run says while it works: a bar with rate and time left on a terminal, one plain line a stage elsewhere."""

import sys
from typing import TYPE_CHECKING, TextIO

from pipeline.errors import ArtefactError

if TYPE_CHECKING:
    pass


def printable(text: str) -> str:
    r"""Control characters escaped: names in files are other people's, and a terminal obeys them.

    >>> printable("a\x1b[2Jb")
    'a\\x1b[2Jb'
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def say(text: str, stream: TextIO) -> None:
    """Print lines. A reader that has gone away is no reason to stop, nor a log that cannot be written: what could be
    said of that would go there, too. An answer on standard output that cannot be written is an ArtefactError."""
    lines = "\n".join(printable(line) for line in text.split("\n"))
    try:
        print(lines, file=stream, flush=True)
    except BrokenPipeError:
        return
    except OSError as error:
        if stream is sys.stdout:
            raise ArtefactError(
                f"standard output: cannot be written ({error.strerror}); make room, or send it elsewhere"
            ) from error


def signed(value: float, digits: int) -> str:
    """With its sign, and no minus before nothing.

    >>> signed(-0.0004, 3), signed(-0.0006, 3)
    ('+0.000', '-0.001')
    """
    return f"{round(value, digits) + 0.0:+.{digits}f}"


def plural(number: int, noun: str) -> str:
    """A count and what is counted, in whole words.

    >>> plural(1, "file"), plural(2, "pass"), plural(3, "study"), plural(0, "day")
    ('1 file', '2 passes', '3 studies', '0 days')
    """
    if number == 1:
        return f"1 {noun}"
    if noun.endswith(("s", "x", "ch", "sh")):
        return f"{number} {noun}es"
    if noun.endswith("y") and noun[-2] not in "aeiou":
        return f"{number} {noun[:-1]}ies"
    return f"{number} {noun}s"
