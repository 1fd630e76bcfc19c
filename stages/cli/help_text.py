"""The text of ``--help`` in the language of this process.

Typer makes its texts in English and hands each to a formatter; the one of this module translates them, and breaks them
into lines in which letters of East Asia take two columns. Names of options and of values stay as they are typed.
"""

import re
from collections.abc import Sequence

import typer.core

from pipeline.language.chosen import translated
from pipeline.language.letters import has_wide, padded, width
from pipeline.text_table import in_lines

UNCUT = 10_000  # columns that typer reckons with: it cuts a command's sentence that is longer, before it is translated
SPACING = 2  # blanks between two columns
_EXTRA = re.compile(r"(?P<help>.*?)\s*\[(?P<extra>[^][]*)\]", re.DOTALL)  # what typer adds: [default: 1; required]

_Formatter = typer.core.TyperCommand.context_class.formatter_class


class SpokenFormatter(_Formatter):  # type: ignore[misc,valid-type]  # a class that typer keeps in a variable
    """Typer's formatter of the help, with each text translated as it comes."""

    width: int

    def __init__(self, *words: int | None, **values: int | None) -> None:
        super().__init__(*words, **values)
        self.columns = self.width
        self.width = UNCUT

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the line of a command's use."""
        head = translated("Usage:")
        first = f"{head}{'' if has_wide(head) else ' '}{prog} "
        self._write_lines(args, first, " " * width(first))

    def write_heading(self, heading: str) -> None:
        """Write the head of a section."""
        self._write_lines(translated(f"{heading}:"), "", "")

    def write_text(self, text: str) -> None:
        """Write the paragraphs of a text."""
        for number, paragraph in enumerate(re.split(r"\n\s*\n", text)):
            if number:
                self.write_paragraph()
            indent = " " * self.current_indent
            self._write_lines(translated(" ".join(paragraph.split())), indent, indent)

    def write_dl(self, rows: Sequence[tuple[str, str]], col_max: int = 30, col_spacing: int = SPACING) -> None:
        """Write names, each with its sentence beside it, or below it where the name is long."""
        widest = min(max(width(name) for name, _ in rows), col_max)
        following = " " * (self.current_indent + widest + col_spacing)
        for name, about in rows:
            first = " " * self.current_indent + padded(name, "<", widest + col_spacing)
            if width(name) > widest:
                self.write(f"{first}\n")
                first = following
            self._write_lines(_explained(about), first, following)

    def _write_lines(self, text: str, first: str, following: str) -> None:
        self.write("".join(f"{line.rstrip()}\n" for line in in_lines(text, first, following, self.columns)))


def _explained(about: str) -> str:
    """Return the sentence on an option, with what typer adds to it, in the language of this process."""
    extra = _EXTRA.fullmatch(about)
    if extra is None:
        return translated(about)
    return f"{translated(extra['help'])}  [{'; '.join(map(translated, extra['extra'].split('; ')))}]"


def speak() -> None:
    """Let the help of all commands be written by this module."""
    typer.core.TyperCommand.context_class.formatter_class = SpokenFormatter
