"""The width of text in columns of a terminal: letters of East Asia take two."""

import unicodedata

WIDE = ("W", "F")  # East Asian Width, Unicode Standard Annex 11


def width(text: str) -> int:
    """Return the number of columns that a text takes.

    >>> width("roll"), width("横摇 °")
    (4, 6)
    """
    return sum(2 if unicodedata.east_asian_width(letter) in WIDE else 1 for letter in text)


def padded(text: str, side: str, columns: int) -> str:
    """Return a text flush left (``<``) or flush right (``>``) in so many columns.

    >>> padded("横摇", "<", 6) + "|", padded("横摇", ">", 6)
    ('横摇  |', '  横摇')
    """
    blanks = " " * (columns - width(text))
    return blanks + text if side == ">" else text + blanks


def has_wide(text: str) -> bool:
    """Return whether a text has letters of East Asia."""
    return any(unicodedata.east_asian_width(letter) in WIDE for letter in text)
