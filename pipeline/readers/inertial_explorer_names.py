"""Names and units of the columns of an Inertial Explorer export, from two lines of its header.

Known names are those of the Waypoint Software User Manual, and some others that exports print. ``Date`` is the date of
``GPSTime``; with the unit d it is the day of the week, like ``D``. ``CorrTime`` is the GPS time corrected for the
receiver's clock. ``Project Name`` is one column. The width of a column may cut off up to two letters at the end of its
name. The name is completed if exactly one known name begins with the remaining letters. ``UT UT UTCTim`` above
``ho mi (sec)`` is one time in three columns.

Some columns (such as Q) have no unit. A unit belongs to the name above it whose end is nearest to the unit's end, or
units belong in order to the names that need one. A file for which the two ways disagree is refused.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pipeline.errors import RawDataError

LONGEST = 8192  # most letters of the line of names, or of units
LEAST_NAMES, MOST_NAMES = 4, 300  # least number of known names, most names in the line of names
TITLES = {name.lower(): name for name in (
    "Week", "GPSTime", "GPSDate", "UTCTime", "UTCDate", "Latitude", "Longitude", "H-Ell", "H-MSL", "Undulation", "Roll",
    "Pitch", "Heading", "Q", "SDNorth", "SDEast", "SDHeight", "RollSD", "PitchSD", "HdngSD",
)} | {"weekday": "D"}  # fmt: skip
_OTHER_NAMES = (
    "rollsep", "ptchsep", "hdngsep", "heave", "ambstatus", "seqnum", "project name",
    "x-ecef", "y-ecef", "z-ecef",
)
UNITLESS = frozenset({"q", "ambstatus", "seqnum", "ns", "project name"})
TWO_WORDS = {("project", "name")}
SYNONYMS = {"date": "gpsdate", "corrtime": "gpstime"}
_CHARACTERISTIC = frozenset({"gpstime", "utctime", "h-ell", "h-msl"})  # a header has at least one of these
MOST_CUT, LEAST_LEFT = 2, 3  # most letters that may be cut off a name, least letters that must remain
TIME_COLUMNS = ("gpstime", "utctime")
SPLIT_TIME = (("ho", "hr", "h", "hour", "hours"), ("mi", "min", "minutes"), ("sec", "s", "seconds"))
DAY_OF_WEEK = "d"  # the unit of a day of the week
DATE_ORDERS = ("mdy", "dmy", "ymd")
THREE_COLUMN_UNITS = ("dms", "hms", *DATE_ORDERS)  # each stands for three columns


@dataclass(frozen=True)
class HeaderColumns:
    """Names and units by column."""

    names: tuple[str, ...]  # known names in lower case, else the word itself
    printed: tuple[str, ...]  # as they stand in the file
    units: tuple[str, ...]  # without brackets; empty: none


def export_column_names(line: str) -> list[str] | None:
    """Return the column names of a line in lower case; None if it is no line of Inertial Explorer's names."""
    if len(line) > LONGEST:
        return None
    names = _known([word for word, _ in _words(line)])
    known = TITLES.keys() & set(names)
    return names if len(known) >= LEAST_NAMES and known & _CHARACTERISTIC and len(names) <= MOST_NAMES else None


def names_and_units(names: str, units: str | None, file: str) -> HeaderColumns:
    """Return names and units by column from the header's two lines.

    Parameters
    ----------
    names : str
        The line of names.
    units : str or None
        The line of units below it; None: the header has no units.
    file : str
        The file's path in the session folder, for messages.

    Raises
    ------
    RawDataError
        Units do not stand below the names, or may belong to other names as well.
    """
    words = _words(names)
    printed = [word for word, _ in words]
    known = _known(printed)
    column_units = [""] * len(words) if units is None else _units(names, words, units, file)
    known = [_weekday(name, word, unit) for name, word, unit in zip(known, printed, column_units, strict=True)]
    return _join_times(HeaderColumns(tuple(known), tuple(printed), tuple(column_units)))


# --- names -----------------------------------------------------------------------------------------------------------
def _words(line: str) -> list[tuple[str, int]]:
    """Return the words of a line as printed, each with the place of its end.

    In a line with commas the words are the texts between the commas; their places are 0 and are not used. Two words
    that are one name (TWO_WORDS) count as one.
    """
    if "," in line:
        return [(word.strip(), 0) for word in line.split(",")]
    words: list[tuple[str, int]] = []
    for match in re.finditer(r"\S+", line.expandtabs()):
        word = match.group()
        if words and (words[-1][0].lower(), word.lower()) in TWO_WORDS:
            words[-1] = (f"{words[-1][0]} {word}", match.end())
        else:
            words.append((word, match.end()))
    return words


def _known(printed: Sequence[str]) -> list[str]:
    """Return each word's known name, or else the word itself, in lower case; names in full precede shortened ones."""
    words = [re.sub(r"\.\d+$", "", word.lower()) for word in printed]  # GPSTime.1 is a second GPSTime
    full = set(words)
    return [_full_name(word, full) for word in words]


def _full_name(word: str, full: set[str]) -> str:
    if word in TITLES or word in _OTHER_NAMES:
        return word
    if word in SYNONYMS:
        return word if SYNONYMS[word] in full else SYNONYMS[word]
    longer = [
        name
        for name in (*TITLES, *_OTHER_NAMES, *SYNONYMS)
        if name.startswith(word) and len(word) >= LEAST_LEFT and len(name) - len(word) <= MOST_CUT
    ]
    if len(longer) != 1:
        return word
    name = SYNONYMS.get(longer[0], longer[0])
    return word if name in full else name


def _weekday(name: str, printed: str, unit: str) -> str:
    """Return "weekday" for a column of the day of the week, and the name for any other column.

    >>> _weekday("gpsdate", "Date", "d"), _weekday("d", "D", "d"), _weekday("gpsdate", "Date", "mdy")
    ('weekday', 'weekday', 'gpsdate')
    """
    return "weekday" if unit == DAY_OF_WEEK and printed.lower() in ("d", "date", "day", "gpsdate") else name


def _join_times(header: HeaderColumns) -> HeaderColumns:
    """Join the three columns of hours, minutes and seconds of a time into one column with the unit hms."""
    names, printed, units = list(header.names), list(header.printed), list(header.units)
    for k in range(len(names) - 1, 1, -1):
        if names[k] not in TIME_COLUMNS:
            continue
        last_units = units[k - 2 : k + 1]
        start = names[k - 1]  # beginning of the time's name, above hours and minutes: UT UT UTCTim
        split = names[k - 2] == start and names[k].startswith(start) and start != names[k]
        if _are_sixtieths(last_units) or (split and not any(last_units)):
            names[k - 2 : k + 1] = [names[k]]
            printed[k - 2 : k + 1] = [printed[k]]
            units[k - 2 : k + 1] = ["hms"]
        elif split:
            names[k] = printed[k].lower()  # with other units it does not count as a time
    return HeaderColumns(tuple(names), tuple(printed), tuple(units))


def _are_sixtieths(units: Sequence[str]) -> bool:
    return len(units) == len(SPLIT_TIME) and all(unit in known for unit, known in zip(units, SPLIT_TIME, strict=True))


# --- units -----------------------------------------------------------------------------------------------------------
def _units(names: str, words: list[tuple[str, int]], below: str, file: str) -> list[str]:
    """Return one unit for each of the ``words`` in the line of names, from the line ``below`` it; empty: no unit."""
    known = _known([word for word, _ in words])
    if "," in names:
        bare = [_bare(unit) for unit in below.split(",")]
        return (bare + [""] * len(words))[: len(words)]
    units = list(re.finditer(r"\([^()]*\)|\S+", below[:LONGEST].expandtabs()))
    bare = [_bare(unit.group()) for unit in units]
    if len(units) == len(words):
        return bare
    nearest = [int(np.argmin([abs(end - unit.end()) for _, end in words])) for unit in units]
    by_place = _placed(bare, nearest, len(words)) if all(a < b for a, b in pairwise(nearest)) else None
    with_unit = [k for k, name in enumerate(known) if name not in UNITLESS]
    by_count = _placed(bare, with_unit, len(words)) if len(with_unit) == len(units) else None
    if by_place is None and by_count is None:
        raise RawDataError(f"{file}: its line of units does not stand under its names; export it with its own header")
    if by_place is not None and by_count is not None:
        for name, word, placed, counted in zip(known, words, by_place, by_count, strict=True):
            if name in TITLES and placed != counted:
                raise RawDataError(
                    f"{file}: its units can be read in two ways: column {word[0]} has ({placed}) by place, ({counted}) "
                    "by count; export it with its own header"
                )
    return by_place or by_count or []


def _placed(units: Sequence[str], places: Sequence[int], count: int) -> list[str]:
    """Return a list of ``count`` units: ``units`` at their ``places``, and empty texts at the others."""
    all_units = [""] * count
    for place, unit in zip(places, units, strict=True):
        all_units[place] = unit
    return all_units


def _bare(unit: str) -> str:
    """Return a unit in lower case without brackets; a unit of three columns also without separators."""
    unit = unit.strip().removeprefix("(").removesuffix(")").lower().replace("+/-", "")
    letters = re.sub(r"[\s/:]", "", unit)
    return letters if letters in THREE_COLUMN_UNITS else unit.strip()
