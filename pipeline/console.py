"""Text for people: safe printing, numbers with their sign, and plurals."""

import sys
from typing import TextIO

from pipeline.errors import ArtefactError
from pipeline.language.chosen import translated
from pipeline.language.letters import has_wide


def printable(text: str) -> str:
    r"""Return the text with control characters escaped: names in files may contain them, and a terminal obeys them.

    >>> printable("a\x1b[2Jb")
    'a\\x1b[2Jb'
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def say(text: str, stream: TextIO, as_is: bool = False) -> None:
    """Print lines of text to a stream, in the language of this process.

    A line that has words of that language already is not translated again: a table, whose cells were.

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
    lines = "\n".join(printable(line if as_is or has_wide(line) else translated(line)) for line in text.split("\n"))
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
    """Return a number as text with its sign. A value that is rounded to zero has a plus.

    >>> signed(-0.0004, 3), signed(-0.0006, 3)
    ('+0.000', '-0.001')
    """
    return f"{round(value, digits) + 0.0:+.{digits}f}"


def plural(number: int, noun: str) -> str:
    """Return a count and its noun as text, the noun in singular or plural.

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
