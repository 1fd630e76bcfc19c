"""Soundings that a survey software exported as text: XYZ, CSV and the like, row by row, with or without column names.

Blanks, tabs, commas or semicolons separate the numbers; a comma may also be the decimal point. Lines before the first
row of numbers, and lines that begin with #, //, % or ;, are a header. If its last line has as many words as the rows
have numbers, they name the columns; if not, the first three columns are east (or longitude), north (or latitude),
height. Rows without three numbers are left out and counted.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.raw_file import opened

ROWS = 200_000
HEAD_BYTES = 65_536
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMMENTS = ("#", "//", "%", ";")
_NAMES = {  # of columns, without case, unit and punctuation
    "latitude": "lat latitude latdeg latitudedeg 纬度",
    "longitude": "lon long longitude londeg longitudedeg lng 经度",
    "x": "x xm e east easting eastingm utmx utme 东坐标 东",
    "y": "y ym n north northing northingm utmy utmn 北坐标 北",
    "z": "z zm height heightm elevation elev elevationm altitude h hm ellipsoidalheight up 高程 高",
    "depth": "depth depthm zdown 水深 深度",
}
_ROLE = {word: role for role, words in _NAMES.items() for word in words.split()}


@dataclass(frozen=True)
class TextLayout:
    """How the rows of a text are written.

    Attributes
    ----------
    separator
        Regular expression between two numbers.
    decimal
        "." or ",".
    header_lines
        Number of lines before the first row.
    columns
        Places of x, y, z.
    geographic
        Whether the names are longitude and latitude; None: the columns have no names.
    depths
        Whether the third is named a depth, positive down.
    words
        Number of words in a row.
    """

    separator: str
    decimal: str
    header_lines: int
    columns: tuple[int, int, int]
    geographic: bool | None
    depths: bool
    words: int


def text_layout(path: Path) -> TextLayout:
    """Return how a text is written, from its beginning; raise RawDataError if it has no rows of three numbers."""
    with opened(path, str(path)) as file:
        head = file.read(HEAD_BYTES)
    if not head.strip():
        raise RawDataError(f"{path}: is empty; export the soundings again")
    if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in head:
        raise RawDataError(f"{path}: is no text of 8 bits a letter, no LAS, LAZ or GSF; export it as XYZ text in UTF-8")
    lines = head.decode("utf-8", errors="replace").splitlines()
    lines = lines[:-1] if len(head) == HEAD_BYTES else lines
    for separator, decimal in ((r";", ","), ("\t", ","), (r"\s+", ","), (r";", "."), (r",", "."), (r"\s+", ".")):
        first = next((k for k, line in enumerate(lines) if _numbers(line, separator, decimal) >= 3), None)
        if first is not None:
            words = len(_words(lines[first], separator))
            names = _names(lines[:first], separator, words)
            columns, geographic, depths = _roles(names, path)
            return TextLayout(separator, decimal, first, columns, geographic, depths, words)
    shown = next((line for line in lines if line.strip()), "")[:60]
    raise RawDataError(
        f"{path}: has no row of three numbers (it begins with {shown!r}); export x, y, z of each sounding"
    )


def _words(line: str, separator: str) -> list[str]:
    return [word.strip() for word in re.split(separator, line.strip().strip("\ufeff"))]


def _numbers(line: str, separator: str, decimal: str) -> int:
    """Return how many words of a line are numbers; with a decimal comma at least one must have it."""
    if line.lstrip().startswith(_COMMENTS):
        return 0
    words = _words(line, separator)
    if decimal == ",":
        if "." in line or not any("," in word for word in words):
            return 0
        words = [word.replace(",", ".") for word in words]
    return sum(_NUMBER.fullmatch(word) is not None for word in words)


def _names(header: Sequence[str], separator: str, words: int) -> list[str]:
    """Return the words of the header's last line that has one for each column; none if there is no such line."""
    for line in reversed(header):
        bare = re.sub(r"[(\[].*?[)\]]", "", line.strip().strip("\ufeff").lstrip("#/%; "))
        found = [re.sub(r"[\W_]", "", word).lower() for word in _words(bare, separator)]
        if len(found) == words:
            return found
    return []


def _roles(names: list[str], path: Path) -> tuple[tuple[int, int, int], bool | None, bool]:
    """Return the places of x, y, z, whether these are longitude and latitude (None: unknown), and whether z is down."""
    place = {_ROLE[name]: k for k, name in reversed(list(enumerate(names))) if name in _ROLE}
    if not place.keys() & {"latitude", "longitude", "x", "y"}:
        return (0, 1, 2), None, False
    pair = ("longitude", "latitude") if {"longitude", "latitude"} <= place.keys() else ("x", "y")
    height = "z" if "z" in place else "depth"
    if not {*pair, height} <= place.keys():
        raise RawDataError(
            f"{path}: its columns {', '.join(names)[:80]} name no x, y, z (or longitude, latitude, height)"
        )
    return (place[pair[0]], place[pair[1]], place[height]), pair[0] == "longitude", height == "depth"


def text_points(path: Path, layout: TextLayout) -> Iterator[tuple[NDArray[np.float64], int]]:
    """Yield x, y, z (n, 3) in the file's order, heights up, and the number of rows left out before, batch by batch."""
    wanted = sorted(set(layout.columns))
    try:
        batches = pd.read_csv(
            path, sep=layout.separator, decimal=layout.decimal, skiprows=layout.header_lines, header=None,
            names=list(range(layout.words)), usecols=wanted, index_col=False, chunksize=ROWS, on_bad_lines="skip",
            encoding="utf-8", encoding_errors="replace", skipinitialspace=True, low_memory=False,
            engine="c" if len(layout.separator) == 1 or layout.separator == r"\s+" else "python",
        )  # fmt: skip
        with batches:
            for table in batches:
                numbers = [
                    pd.to_numeric(table[place], errors="coerce").to_numpy(np.float64) for place in layout.columns
                ]
                points = np.stack(numbers, axis=1)
                good = np.isfinite(points).all(axis=1)
                yield points[good] * [1.0, 1.0, -1.0 if layout.depths else 1.0], int((~good).sum())
    except (OSError, ValueError, OverflowError) as error:
        raise RawDataError(f"{path}: cannot be read as rows of numbers ({error}); export it again") from error
