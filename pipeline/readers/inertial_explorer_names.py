"""Names and units of the columns of an Inertial Explorer export, from two lines of its header.

Names are those of the Waypoint Software User Manual, or as exports print them: ``Date`` is the date of ``GPSTime``
(with the unit d it is the day of the week, as ``D`` is), ``CorrTime`` the GPS time corrected for the receiver's clock.
``Project Name`` is one column. A name that lacks up to two letters at its end, cut off by the width of its column, is
taken where one known name alone begins so. ``UT UT UTCTim`` over ``ho mi (sec)`` is one time in three columns.

Of units, of which some columns (Q) have none, each belongs to the name above it: the one that ends nearest.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pipeline.errors import RawDataError

LONGEST = 8192  # letters of the names, or of the units
LEAST_NAMES, MOST_NAMES = 4, 300
TITLES = {name.lower(): name for name in (
    "Week", "GPSTime", "GPSDate", "UTCTime", "UTCDate", "Latitude", "Longitude", "H-Ell", "H-MSL", "Undulation", "Roll",
    "Pitch", "Heading", "Q", "SDNorth", "SDEast", "SDHeight", "RollSD", "PitchSD", "HdngSD",
)} | {"weekday": "D"}  # fmt: skip
OTHERS = ("rollsep", "ptchsep", "hdngsep", "heave", "ambstatus", "seqnum", "project name", "x-ecef", "y-ecef", "z-ecef")
UNITLESS = frozenset({"q", "ambstatus", "seqnum", "ns", "project name"})
TWO_WORDS = {("project", "name")}
SYNONYMS = {"date": "gpsdate", "corrtime": "gpstime"}
OWN = frozenset({"gpstime", "utctime", "h-ell", "h-msl"})  # of these at least one, of all names at least LEAST_NAMES
MOST_CUT, LEAST_LEFT = 2, 3  # letters that a name may lack, and those that it must have
TIMES = ("gpstime", "utctime")
SPLIT_TIME = (("ho", "hr", "h", "hour", "hours"), ("mi", "min", "minutes"), ("sec", "s", "seconds"))
DAY_OF_WEEK = "d"  # the unit
ORDERS = ("mdy", "dmy", "ymd")
THREE = ("dms", "hms", *ORDERS)  # units of three columns


@dataclass(frozen=True)
class Names:
    """By column: its name here, as printed, its unit (bare, empty where it has none)."""

    names: tuple[str, ...]
    printed: tuple[str, ...]
    units: tuple[str, ...]


def column_names(line: str) -> list[str] | None:
    """The names in lower case, where this line is one of Inertial Explorer's names."""
    if len(line) > LONGEST:
        return None
    names = _known([word for word, _ in _words(line)])
    known = TITLES.keys() & set(names)
    return names if len(known) >= LEAST_NAMES and known & OWN and len(names) <= MOST_NAMES else None


def names_and_units(names: str, units: str | None, file: str) -> Names:
    """``units``: the line below the names; None where there is none.

    Raises
    ------
    RawDataError
        Units that stand under no name, or of which it cannot be told to which name they belong.
    """
    words = _words(names)
    printed = [word for word, _ in words]
    known = _known(printed)
    told = [""] * len(words) if units is None else _units(names, words, known, units, file)
    known = [_weekday(name, word, unit) for name, word, unit in zip(known, printed, told, strict=True)]
    return _joined_times(Names(tuple(known), tuple(printed), tuple(told)))


# --- names -----------------------------------------------------------------------------------------------------------
def _words(line: str) -> list[tuple[str, int]]:
    """The words as printed, and where each ends; of a list with commas what stands between them."""
    if "," in line:
        return [(word.strip(), 0) for word in line.split(",")]
    words: list[tuple[str, int]] = []
    for found in re.finditer(r"\S+", line.expandtabs()):
        word = found.group()
        if words and (words[-1][0].lower(), word.lower()) in TWO_WORDS:
            words[-1] = (f"{words[-1][0]} {word}", found.end())
        else:
            words.append((word, found.end()))
    return words


def _known(printed: Sequence[str]) -> list[str]:
    """Each word's known name, else the word itself, in lower case. What is written in full goes first."""
    words = [re.sub(r"\.\d+$", "", word.lower()) for word in printed]  # GPSTime.1 is a second GPSTime
    full = set(words)
    return [_meant(word, full) for word in words]


def _meant(word: str, full: set[str]) -> str:
    if word in TITLES or word in OTHERS:
        return word
    if word in SYNONYMS:
        return word if SYNONYMS[word] in full else SYNONYMS[word]
    longer = [
        name
        for name in (*TITLES, *OTHERS, *SYNONYMS)
        if name.startswith(word) and len(word) >= LEAST_LEFT and len(name) - len(word) <= MOST_CUT
    ]
    if len(longer) != 1:
        return word
    name = SYNONYMS.get(longer[0], longer[0])
    return word if name in full else name


def _weekday(name: str, printed: str, unit: str) -> str:
    """
    >>> _weekday("gpsdate", "Date", "d"), _weekday("d", "D", "d"), _weekday("gpsdate", "Date", "mdy")
    ('weekday', 'weekday', 'gpsdate')
    """
    return "weekday" if unit == DAY_OF_WEEK and printed.lower() in ("d", "date", "day", "gpsdate") else name


def _joined_times(given: Names) -> Names:
    """A time whose hours and minutes stand in columns of their own before it becomes one, of the unit hms."""
    names, printed, units = list(given.names), list(given.printed), list(given.units)
    for k in range(len(names) - 1, 1, -1):
        if names[k] not in TIMES:
            continue
        three = units[k - 2 : k + 1]
        start = names[k - 1]  # of the name, over hours and minutes: UT UT UTCTim
        split = names[k - 2] == start and names[k].startswith(start) and start != names[k]
        if _are_sixtieths(three) or (split and not any(three)):
            names[k - 2 : k + 1] = [names[k]]
            printed[k - 2 : k + 1] = [printed[k]]
            units[k - 2 : k + 1] = ["hms"]
        elif split:
            names[k] = printed[k].lower()  # whatever those units are: it is not known as a time
    return Names(tuple(names), tuple(printed), tuple(units))


def _are_sixtieths(units: Sequence[str]) -> bool:
    return len(units) == len(SPLIT_TIME) and all(unit in known for unit, known in zip(units, SPLIT_TIME, strict=True))


# --- units -----------------------------------------------------------------------------------------------------------
def _units(line: str, words: list[tuple[str, int]], known: list[str], below: str, file: str) -> list[str]:
    """The unit of each name."""
    if "," in line:
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
        for name, word, one, other in zip(known, words, by_place, by_count, strict=True):
            if name in TITLES and one != other:
                raise RawDataError(
                    f"{file}: its units can be read in two ways: column {word[0]} has ({one}) by place, ({other}) by "
                    "count; export it with its own header"
                )
    return by_place or by_count or []


def _placed(units: Sequence[str], places: Sequence[int], count: int) -> list[str]:
    found = [""] * count
    for place, unit in zip(places, units, strict=True):
        found[place] = unit
    return found


def _bare(unit: str) -> str:
    unit = unit.strip().removeprefix("(").removesuffix(")").lower().replace("+/-", "")
    letters = re.sub(r"[\s/:]", "", unit)
    return letters if letters in THREE else unit.strip()
