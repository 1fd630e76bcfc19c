"""What an Inertial Explorer export says of itself: which columns its rows have, where, and in which units.

The layout is its user's own (an export profile). Free lines of text come first, then one line of names, then mostly one
of units, then the rows; columns are parted by blanks, or by commas. Names are those of the Waypoint Software User
Manual. Of units, of which some columns (Q) have none, each belongs to the name above it: the one that ends nearest. The
units D M S, HMS and MDY stand for three columns: 36 30 15.2, 6 29 6.0 or 6:29:06.0, 5/12/2026. Degrees, metres and
seconds where there is no unit; dates must say the order of day and month, unless the year stands first.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from pipeline.errors import RawDataError
from pipeline.readers.files import opened

HEAD = 65_536
SAMPLE = 20  # rows of which the printed digits are counted
POSITION = ("latitude", "longitude")
ATTITUDE = ("roll", "pitch", "heading")
SIGMAS = {  # by column of the table ins_sigmas
    "north_m": "sdnorth", "east_m": "sdeast", "up_m": "sdheight",
    "roll_deg": "rollsd", "pitch_deg": "pitchsd", "heading_deg": "hdngsd",
}  # fmt: skip
HEIGHTS = ("h-ell", "h-msl", "undulation")
TIMES = ("gpstime", "utctime")
DATES = ("gpsdate", "utcdate")
TITLES = {name.lower(): name for name in (
    "Week", "GPSTime", "GPSDate", "UTCTime", "UTCDate", "Latitude", "Longitude", "H-Ell", "H-MSL", "Undulation", "Roll",
    "Pitch", "Heading", "Q", "SDNorth", "SDEast", "SDHeight", "RollSD", "PitchSD", "HdngSD",
)}  # fmt: skip
OWN = frozenset({"gpstime", "utctime", "h-ell", "h-msl"})  # of these at least one, of all names at least LEAST_NAMES
LEAST_NAMES, MOST_NAMES = 4, 300
LONGEST = 8192  # letters of the names, or of the units
ORDERS = ("mdy", "dmy", "ymd")
THREE = ("dms", "hms", *ORDERS)  # units of three columns
DEGREES = {
    "deg": 1.0, "degree": 1.0, "degrees": 1.0, "rad": 180 / np.pi, "radians": 180 / np.pi,
    **dict.fromkeys(("arcmin", "arc-min", "amin", "arcminutes"), 1 / 60),
    **dict.fromkeys(("arcsec", "arc-sec", "asec", "arcseconds"), 1 / 3600),
}  # fmt: skip
METRES = {"m": 1.0, "metres": 1.0, "meters": 1.0, "cm": 0.01, "mm": 0.001}
SECONDS = {"sec": 1.0, "s": 1.0, "seconds": 1.0, "hms": 1.0}
WEEKS = {"weeks": 1.0, "week": 1.0}
UNITS: dict[str, Mapping[str, float]] = {
    **dict.fromkeys(POSITION, DEGREES | {"dms": 1.0}), **dict.fromkeys(ATTITUDE, DEGREES),
    **dict.fromkeys(HEIGHTS, METRES), **dict.fromkeys(TIMES, SECONDS),
    **dict.fromkeys(DATES, dict.fromkeys(ORDERS, 1.0)), "week": WEEKS,
    **{name: METRES if column.endswith("_m") else DEGREES for column, name in SIGMAS.items()},
}  # fmt: skip
COARSEST_DEG = 2e-7  # 2 cm: positions printed more coarsely are of no use
Clock = Literal["week", "gpsdate", "utcdate", "gps_week"]


@dataclass(frozen=True)
class Layout:
    """Of one file. ``clock``: what, beside the time, tells its week: a column, or session.yaml (gps_week)."""

    start: int  # byte of the first row
    separators: bytes  # beside blanks
    width: int  # columns of a row
    places: Mapping[str, tuple[int, ...]]  # the one or three columns of each name that is read
    scales: Mapping[str, float]  # to degrees, metres
    clock: Clock
    order: str  # of a date: mdy, dmy or ymd
    first_s: float  # time of the first row (NaN: no row, or hours, minutes, seconds)
    steps: Mapping[str, float]  # of the last printed digit: of the time (s), latitude and longitude (degrees)

    @property
    def time(self) -> str:
        return "utctime" if self.clock == "utcdate" else "gpstime"


def column_names(line: str) -> list[str] | None:
    """The names in lower case, where this line is one of Inertial Explorer's names."""
    if len(line) > LONGEST:
        return None
    names = [word.strip().lower() for word in (line.split(",") if "," in line else line.split())]
    known = TITLES.keys() & set(names)
    return names if len(known) >= LEAST_NAMES and known & OWN and len(names) <= MOST_NAMES else None


def names_line(head: bytes) -> int | None:
    """The number of the line of names in a file's beginning."""
    lines = (number for number, line in enumerate(head.split(b"\n")) if column_names(_text(line)) is not None)
    return next(lines, None)


def read_layout(path: Path, name: str) -> Layout:
    """The layout that the file's own header tells.

    Raises
    ------
    RawDataError
        Something that is needed is not there, is there twice, or has a unit that is not understood.
    """
    with opened(path, name) as file:
        head = file.read(HEAD)
    lines = head.split(b"\n")
    number = names_line(head)
    if number is None:
        raise RawDataError(f"{name}: has no line of Inertial Explorer's column names; export it with its header")
    text = _text(lines[number])
    names = column_names(text) or []
    rest = [k for k in range(number + 1, len(lines)) if lines[k].strip()]
    has_units = bool(rest) and not any(_is_number(word) for word in re.split(r"[\s,]+", _text(lines[rest[0]])))
    units = _units(text, _text(lines[rest[0]]), name) if has_units else [""] * len(names)
    first = rest[0] + 1 if has_units else number + 1
    rows = [_text(line) for line in lines[first:-1] if line.strip()][:SAMPLE]
    units = _assumed(names, units, rows[0] if rows else "")
    wanted, clock = _wanted(names, units, name)
    starts = np.cumsum([0, *(3 if unit in THREE else 1 for unit in units)]).tolist()
    places = {
        column: tuple(range(starts[k], starts[k + 1])) for k, column in enumerate(names) if column in wanted
    }
    scales = {column: _scale(column, units[names.index(column)], name) for column in wanted}
    order = units[names.index(clock)] if clock in DATES else ""
    separators = b","[: "," in text] + b":"[: "hms" in units] + b"/"[: any(unit in ORDERS for unit in units)]
    start = sum(len(line) + 1 for line in lines[:first])
    words = [re.split(rf"[\s{separators.decode()}]+", row.strip()) for row in rows]
    words = [row for row in words if len(row) == starts[-1]]
    time = places["utctime" if clock == "utcdate" else "gpstime"]
    steps = {column: _step(words, places[column]) * scales[column] for column in POSITION} | {
        "time": _step(words, (time[-1],))
    }
    if words:
        _refuse_coarse(steps, name)
    first_s = float(words[0][time[0]]) if words and len(time) == 1 and _is_number(words[0][time[0]]) else np.nan
    return Layout(start, separators, starts[-1], places, scales, clock, order, first_s, steps)


def _text(line: bytes) -> str:
    return line.removeprefix(b"\xef\xbb\xbf").decode("latin-1").rstrip()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _units(names: str, line: str, file: str) -> list[str]:
    """The unit of each name, bare: without brackets, signs and blanks; empty where it has none."""
    if "," in names:
        found = line.split(",")
        bare = [_bare(unit) for unit in found]
        return (bare + [""] * names.count(","))[: names.count(",") + 1]
    ends = [found.end() for found in re.finditer(r"\S+", names.expandtabs())]
    units = list(re.finditer(r"\([^()]*\)|\S+", line[:LONGEST].expandtabs()))
    if len(units) == len(ends):
        return [_bare(unit.group()) for unit in units]
    nearest = [int(np.argmin([abs(end - unit.end()) for end in ends])) for unit in units]
    if any(second <= first for first, second in pairwise(nearest)):
        raise RawDataError(f"{file}: its line of units does not stand under its names; export it with its own header")
    bare = [""] * len(ends)
    for place, unit in zip(nearest, units, strict=True):
        bare[place] = _bare(unit.group())
    return bare


def _bare(unit: str) -> str:
    unit = unit.strip().removeprefix("(").removesuffix(")").lower().replace("+/-", "")
    letters = re.sub(r"[\s/:]", "", unit)
    return letters if letters in THREE else unit.strip()


def _assumed(names: list[str], units: list[str], row: str) -> list[str]:
    """Units that are not told: dates by their look, times with colons; angles in three columns by the row's length."""
    filled = []
    for column, unit in zip(names, units, strict=True):
        if column in DATES and not unit:
            unit = "ymd" if re.search(r"(?<!\d)\d{4}/", row) else "?dy" if "/" in row else ""
        elif column in TIMES and not unit and ":" in row:
            unit = "hms"
        filled.append(unit)
    count = len(re.split(r"[\s,:/]+", row.strip())) - 2 * sum(unit in (*THREE, "?dy") for unit in filled)
    turns = [k for k, column in enumerate(names) if column in POSITION and not filled[k]]
    if len(turns) == 2 and count == len(names) + 4:
        filled = ["dms" if k in turns else unit for k, unit in enumerate(filled)]
    return filled


def _wanted(names: list[str], units: list[str], file: str) -> tuple[list[str], Clock]:
    """The columns to read, and what tells the week; RawDataError where something is missing."""
    there = set(names)
    clock: Clock = "gps_week"
    if "gpstime" in there and there & {"week", "gpsdate"}:
        clock = "week" if "week" in there and units[names.index("gpstime")] != "hms" else "gpsdate"
    elif {"utctime", "utcdate"} <= there:
        clock = "utcdate"
    time = "utctime" if clock == "utcdate" else "gpstime"
    height = ["h-ell"] if "h-ell" in there else ["h-msl", "undulation"]
    needed = [time, *([] if clock == "gps_week" else [clock]), *POSITION, *height, *ATTITUDE]
    missing = [column for column in needed if column not in there]
    has = f"(has: {', '.join(TITLES.get(column, column) for column in names)[:200]})"
    if missing == ["undulation"]:
        raise RawDataError(f"{file}: its height, H-MSL, is above sea level; export H-Ell as well, or Undulation")
    if missing == ["h-msl"] or missing == ["h-msl", "undulation"]:
        missing = ["h-ell"]
    if missing:
        lacking = ", ".join(TITLES[column] for column in missing)
        raise RawDataError(f"{file}: has no column {lacking} {has}; add it to the export profile")
    if clock == "gps_week" and units[names.index("gpstime")] == "hms":
        raise RawDataError(f"{file}: GPSTime is in hours, minutes, seconds, without a date; export GPSDate as well")
    wanted = needed + [column for column in ("q", *SIGMAS.values()) if column in there]
    twice = [column for column in wanted if names.count(column) > 1]
    if twice:
        raise RawDataError(f"{file}: has column {TITLES[twice[0]]} twice; take one out of the export profile")
    return wanted, clock


def _scale(column: str, unit: str, file: str) -> float:
    known = UNITS.get(column, {})
    if column == "q" or (not unit and column not in DATES):
        return 1.0
    if unit not in known:
        told = f"has the unit ({unit})" if unit else "has no unit"
        raise RawDataError(f"{file}: column {TITLES[column]} {told}; export it as one of {', '.join(known)}")
    return known[unit]


def _refuse_coarse(steps: Mapping[str, float], file: str) -> None:
    for column in POSITION:
        if steps[column] > COARSEST_DEG:
            raise RawDataError(
                f"{file}: {TITLES[column]} is printed in steps of {steps[column]:.0e} degrees, more than 2 cm; "
                "export it with more digits: 8 in degrees, 5 in seconds of arc"
            )


def _step(rows: list[list[str]], places: tuple[int, ...]) -> float:
    """The last printed digit of a number (of three columns: of their last, as a share of the first's unit)."""
    decimals = max((len(row[places[-1]].partition(".")[2]) for row in rows), default=0)
    return float(10.0 ** -min(decimals, 18)) / (3600 if len(places) == 3 else 1)
