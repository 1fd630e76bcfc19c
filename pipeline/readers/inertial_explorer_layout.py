"""What an Inertial Explorer export says of itself: which columns its rows have, where, and in which units.

The layout is its user's own (an export profile). Free lines of text come first, then one line of names, then mostly one
of units, then the rows (``ie_names.py``); columns are parted by blanks, or by commas. The units D M S, HMS and MDY
stand for three columns: 36 30 15.2, 6 29 6.0 or 6:29:06.0, 5/12/2026. Degrees, metres and seconds where there is no
unit; dates must say the order of day and month, unless the year stands first. What tells the time: ``ie_times.py``.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.inertial_explorer_names import ORDERS, THREE, TIMES, TITLES, Names, column_names, names_and_units
from pipeline.readers.inertial_explorer_times import SECOND, Clock, choose
from pipeline.readers.raw_file import opened

HEAD = 65_536
SAMPLE = 20  # rows of which the printed digits are counted
POSITION = ("latitude", "longitude")
ATTITUDE = ("roll", "pitch", "heading")
SIGMAS = {  # by column of the table ins_sigmas
    "north_m": "sdnorth", "east_m": "sdeast", "up_m": "sdheight",
    "roll_deg": "rollsd", "pitch_deg": "pitchsd", "heading_deg": "hdngsd",
}  # fmt: skip
HEIGHTS = ("h-ell", "h-msl", "undulation")
DATES = ("gpsdate", "utcdate")
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
    **dict.fromkeys(DATES, dict.fromkeys(ORDERS, 1.0)), "week": WEEKS, "weekday": {"d": 1.0}, SECOND: SECONDS,
    **{name: METRES if column.endswith("_m") else DEGREES for column, name in SIGMAS.items()},
}  # fmt: skip
COARSEST_DEG = 2e-7  # 2 cm: positions printed more coarsely are of no use


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
    rest = [k for k in range(number + 1, len(lines)) if lines[k].strip()]
    has_units = bool(rest) and not any(_is_number(word) for word in re.split(r"[\s,]+", _text(lines[rest[0]])))
    given = names_and_units(text, _text(lines[rest[0]]) if has_units else None, name)
    first = rest[0] + 1 if has_units else number + 1
    rows = [_text(line) for line in lines[first:-1] if line.strip()][:SAMPLE]
    if "," not in text and rows and re.search(r"\d,\d", rows[0]):
        raise RawDataError(f"{name}: its numbers have commas in place of decimal points; export them with points")
    given = replace(given, units=tuple(_assumed(given, rows[0] if rows else "")))
    starts = np.cumsum([0, *(3 if unit in THREE else 1 for unit in given.units)]).tolist()
    spans = [tuple(range(start, end)) for start, end in pairwise(starts)]
    between = b","[: "," in text] + b"/"[: any(unit in ORDERS for unit in given.units)]
    separators = between + b":"[: "hms" in given.units]
    words = _split(rows, separators)
    if "dms" in given.units and not any(len(row) == starts[-1] for row in words):
        separators = between + b":"  # 36:30:15.2
        words = _split(rows, separators)
    _refuse_three_of_one(given, {len(row) for row in words}, starts[-1], name)
    words = [row for row in words if len(row) == starts[-1]]
    sample = {k: _seconds(words, spans[k]) for k, column in enumerate(given.names) if column in TIMES}
    columns, clock = _wanted(given, sample, name)
    places = {column: spans[k] for column, k in columns}
    scales = {column: _scale(column, given.units[k], name) for column, k in columns}
    order = next((given.units[k] for column, k in columns if column == clock and column in DATES), "")
    start = sum(len(line) + 1 for line in lines[:first])
    timed = [k for column, k in columns if column in (*TIMES, SECOND)]
    time = spans[timed[0]]
    steps = {column: _step(words, places[column]) * scales[column] for column in POSITION} | {
        "time": _step(words, (time[-1],))
    }
    if words:
        _refuse_coarse(steps, name)
    one = [float(sample[k][0]) for k in timed] if words and len(time) == 1 else []
    first_s = float(np.fmax.reduce(one)) if one else np.nan
    return Layout(start, separators, starts[-1], places, scales, clock, order, first_s, steps)


def _split(rows: list[str], separators: bytes) -> list[list[str]]:
    return [re.split(rf"[\s{separators.decode()}]+", row.strip()) for row in rows]


def _seconds(rows: list[list[str]], places: tuple[int, ...]) -> NDArray[np.float64]:
    """What a column of times says in some rows; of three columns hours, minutes, seconds."""
    cells = [[float(row[k]) if _is_number(row[k]) else np.nan for k in places] for row in rows]
    factors = np.array([3600.0, 60.0, 1.0] if len(places) == 3 else [1.0])
    return np.asarray(np.array(cells, dtype=np.float64).reshape(-1, len(places)) @ factors)


def _refuse_three_of_one(given: Names, found: set[int], width: int, file: str) -> None:
    """Rows that have one column where the unit stands for three: the unit is the cause."""
    three = [(word, unit) for word, unit in zip(given.printed, given.units, strict=True) if unit in THREE]
    for cause in (three, [(word, unit) for word, unit in three if unit == "dms"]):
        if cause and found == {width - 2 * len(cause)}:
            columns = ", ".join(f"{word} ({unit})" for word, unit in cause)
            raise RawDataError(
                f"{file}: the units of {columns} stand for three columns each, but its rows have one column there; "
                "export angles in decimal degrees (deg) and times in seconds (sec), or their three parts with blanks "
                "between"
            )


def _text(line: bytes) -> str:
    return line.removeprefix(b"\xef\xbb\xbf").decode("latin-1").rstrip()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _assumed(given: Names, row: str) -> list[str]:
    """Units that are not told: dates by their look, times with colons; angles in three columns by the row's length."""
    filled = []
    for column, unit in zip(given.names, given.units, strict=True):
        if column in DATES and not unit:
            unit = "ymd" if re.search(r"(?<!\d)\d{4}/", row) else "?dy" if "/" in row else ""
        elif column in TIMES and not unit and ":" in row:
            unit = "hms"
        filled.append(unit)
    count = len(re.split(r"[\s,:/]+", row.strip())) - 2 * sum(unit in (*THREE, "?dy") for unit in filled)
    turns = [k for k, column in enumerate(given.names) if column in POSITION and not filled[k]]
    if len(turns) == 2 and count == len(given.names) + 4:
        filled = ["dms" if k in turns else unit for k, unit in enumerate(filled)]
    return filled


def _wanted(
    given: Names, sample: Mapping[int, NDArray[np.float64]], file: str
) -> tuple[list[tuple[str, int]], Clock]:
    """The columns to read, with their numbers, and what tells the week; RawDataError where something is missing."""
    names = given.names
    there = set(names)
    times, clock = choose(given, sample, file)
    height = ["h-ell"] if "h-ell" in there else ["h-msl", "undulation"]
    needed = [*POSITION, *height, *ATTITUDE]
    missing = ([] if times else ["gpstime"]) + [column for column in needed if column not in there]
    has = f"(has: {', '.join(TITLES.get(column, column) for column in names)[:200]})"
    if missing == ["undulation"]:
        raise RawDataError(f"{file}: its height, H-MSL, is above sea level; export H-Ell as well, or Undulation")
    if missing == ["h-msl"] or missing == ["h-msl", "undulation"]:
        missing = ["h-ell"]
    if missing:
        lacking = ", ".join(TITLES[column] for column in missing)
        raise RawDataError(f"{file}: has no column {lacking} {has}; add it to the export profile")
    wanted = needed + [column for column in ("q", *SIGMAS.values()) if column in there]
    chosen = {column for column, _ in times} - {SECOND}
    twice = [column for column in (*wanted, *chosen - {"gpstime"}) if names.count(column) > 1]
    if twice:
        raise RawDataError(f"{file}: has column {TITLES[twice[0]]} twice; take one out of the export profile")
    return [*times, *((column, names.index(column)) for column in wanted)], clock


def _scale(column: str, unit: str, file: str) -> float:
    known = UNITS.get(column, {})
    if column == "q" or (not unit and column not in DATES):
        return 1.0
    if unit not in known:
        told = f"has the unit ({unit})" if unit else "has no unit"
        told = "has no unit to tell the day from the month" if unit == "?dy" else told
        title = TITLES.get(column, "GPSTime")
        raise RawDataError(f"{file}: column {title} {told}; export it as one of {', '.join(known)}")
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
