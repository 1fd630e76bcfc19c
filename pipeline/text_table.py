"""Tables of text, and sentences in lines, for the screen and for recordings."""

import re
from collections.abc import Iterable, Sequence

from pipeline.language import letters
from pipeline.language.chosen import translated

SCREEN = 100  # columns of the screen within which sentences are kept
_PIECE = re.compile(  # what stays together on a line: a word, or one letter of East Asia, with the marks behind it
    r"\s*(?:[\u2e80-\uffef]|[^\s\u2e80-\uffef]+)[、。，；：）？！]*"
)


def text_table(layout: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    r"""Return a table's lines, the header first, each cell in the language of this process.

    A column becomes wider where a cell does not fit. At least one blank is left between two columns, except between a
    flush-right column and a flush-left one for which the layout has no blank.

    Parameters
    ----------
    layout
        For each column ``<`` (flush left) or ``>`` (flush right), and its smallest width. Blanks before it are printed.
    header
        The columns' heads.
    rows
        The cells of each row. Cells that are missing at the end of a row are empty.

    >>> print("\n".join(text_table("  <6>8 <1", ["", "sigma"], [["roll", "0.012", "deg"], ["x", "0.0000003", "m"]])))
                 sigma
      roll       0.012 deg
      x      0.0000003 m
    """
    columns = [(len(gap), side, int(width)) for gap, side, width in re.findall(r"( *)([<>])(\d+)", layout)]
    lines = [[*map(translated, row), *[""] * (len(columns) - len(row))] for row in (header, *rows)]
    widths = []
    for place, (gap, side, width) in enumerate(columns):
        following = columns[place + 1] if place + 1 < len(columns) else None
        before = side == ">" and place > 0 and gap == 0
        behind = side == "<" and following is not None and following[:2] == (0, "<")
        widths.append(max(width, max(letters.width(line[place]) for line in lines) + before + behind))
    return [
        "".join(
            f"{'':{gap}}{letters.padded(cell, side, width)}"
            for (gap, side, _), width, cell in zip(columns, widths, line, strict=True)
        ).rstrip()
        for line in lines
    ]


def wrapped(text: str, first: str = "", following: str = "  ") -> list[str]:
    r"""Return a sentence in the language of this process, in lines of at most 100 columns; longer words stay whole.

    Parameters
    ----------
    text
        The sentence.
    first, following
        What stands before the first line, and before each further one.

    >>> [len(line) for line in wrapped("word " * 30, "- ")]
    [96, 56]
    """
    return in_lines(translated(text), first, following)


def in_lines(text: str, first: str, following: str, columns: int = SCREEN) -> list[str]:
    r"""Return a text as it is, in lines of at most so many columns; longer words stay whole.

    >>> in_lines("横摇、纵摇", "", " ", 6)
    ['横摇、', ' 纵摇']
    """
    lines, line, begun = [], first, False
    for piece in _PIECE.findall(text):
        if begun and letters.width(line + piece) > columns:
            lines.append(line)
            line, begun = following, False
        line += piece if begun else piece.lstrip()
        begun = True
    return [*lines, line]
