"""The layout of an Inertial Explorer export: the names, places and units of the columns of its rows.

The user chooses the layout in an export profile. Free lines of text come first. Then come one line of names, in most
files one line of units, and the rows (``inertial_explorer_names``, ``inertial_explorer_units``). Blanks or commas
separate the columns. ``inertial_explorer_times`` chooses the columns of the time.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.inertial_explorer_names import (
    DATE_ORDERS,
    THREE_COLUMN_UNITS,
    TIME_COLUMNS,
    TITLES,
    HeaderColumns,
    export_column_names,
    names_and_units,
)
from pipeline.readers.inertial_explorer_times import SECOND_GPS_TIME, Clock, choose_time_columns
from pipeline.readers.inertial_explorer_units import (
    ATTITUDE,
    DATES,
    POSITION,
    SIGMA_COLUMN_NAMES,
    complete_units,
    printed_step,
    refuse_coarse_positions,
    refuse_single_columns,
    scale_of,
)
from pipeline.readers.raw_file import opened

_HEAD = 65_536
SAMPLE = 20  # number of first rows from which the header is checked and printed digits are counted


@dataclass(frozen=True)
class ExportLayout:
    """The layout of one file."""

    start: int  # byte of the first row
    separators: bytes  # separators of columns beside blanks
    width: int  # number of columns of a row
    places: Mapping[str, tuple[int, ...]]  # by name of a value: the numbers of its column, or of its three columns
    scales: Mapping[str, float]  # by name of a value: factor to degrees, metres or seconds
    clock: Clock  # source of a time's week: a column, or session.yaml (gps_week)
    order: str  # order of the parts of a date: mdy, dmy or ymd; empty: no date is read
    first_s: float  # time of the first row; NaN: no row, or a time in hours, minutes, seconds
    steps: Mapping[str, float]  # size of the last printed digit of the time (s), latitude and longitude (degrees)

    @property
    def time(self) -> str:
        """Name of the column of the time."""
        return "utctime" if self.clock == "utcdate" else "gpstime"


def header_line_number(head: bytes) -> int | None:
    """Return the number of the line of names in a file's beginning; None without one."""
    lines = (number for number, line in enumerate(head.split(b"\n")) if export_column_names(_text(line)) is not None)
    return next(lines, None)


def read_layout(path: Path, name: str) -> ExportLayout:
    """Read the layout from the file's own header, and check it against the first rows.

    Parameters
    ----------
    path : Path
        The export.
    name : str
        Its path in the session folder, for messages.

    Raises
    ------
    RawDataError
        A needed column is missing, stands twice or has an unknown unit; or its numbers cannot be read or are too
        coarse.
    """
    with opened(path, name) as file:
        head = file.read(_HEAD)
    names_line, start, header, rows = _header_and_rows(head, name)
    starts = np.cumsum([0, *(3 if unit in THREE_COLUMN_UNITS else 1 for unit in header.units)]).tolist()
    spans = [tuple(range(first, end)) for first, end in pairwise(starts)]
    width = starts[-1]
    between = b","[: "," in names_line] + b"/"[: any(unit in DATE_ORDERS for unit in header.units)]
    separators = between + b":"[: "hms" in header.units]
    words = _split(rows, separators)
    if "dms" in header.units and not any(len(row) == width for row in words):
        separators = between + b":"  # dms may be printed as 36:30:15.2
        words = _split(rows, separators)
    refuse_single_columns(header, {len(row) for row in words}, width, name)
    words = [row for row in words if len(row) == width]
    sample = {k: _seconds(words, spans[k]) for k, column in enumerate(header.names) if column in TIME_COLUMNS}
    columns, clock = _needed_columns(header, sample, name)
    places = {column: spans[k] for column, k in columns}
    scales = {column: scale_of(column, header.units[k], name) for column, k in columns}
    times = [k for column, k in columns if column in (*TIME_COLUMNS, SECOND_GPS_TIME)]
    time_places = spans[times[0]]
    steps = {column: printed_step(words, places[column]) * scales[column] for column in POSITION} | {
        "time": printed_step(words, (time_places[-1],))
    }
    if words:
        refuse_coarse_positions(steps, name)
    first_times = [float(sample[k][0]) for k in times] if words and len(time_places) == 1 else []
    return ExportLayout(
        start=start,
        separators=separators,
        width=width,
        places=places,
        scales=scales,
        clock=clock,
        order=next((header.units[k] for column, k in columns if column == clock and column in DATES), ""),
        first_s=float(np.fmax.reduce(first_times)) if first_times else np.nan,
        steps=steps,
    )


def _header_and_rows(head: bytes, name: str) -> tuple[str, int, HeaderColumns, list[str]]:
    """Return the line of names, the byte of the first row, names and units, and the first rows."""
    lines = head.split(b"\n")
    number = header_line_number(head)
    if number is None:
        raise RawDataError(f"{name}: has no line of Inertial Explorer's column names; export it with its header")
    names_line = _text(lines[number])
    rest = [k for k in range(number + 1, len(lines)) if lines[k].strip()]
    has_units = bool(rest) and not any(_is_number(word) for word in re.split(r"[\s,]+", _text(lines[rest[0]])))
    header = names_and_units(names_line, _text(lines[rest[0]]) if has_units else None, name)
    first = rest[0] + 1 if has_units else number + 1
    rows = [_text(line) for line in lines[first:-1] if line.strip()][:SAMPLE]
    if "," not in names_line and rows and re.search(r"\d,\d", rows[0]):
        raise RawDataError(f"{name}: its numbers have commas in place of decimal points; export them with points")
    header = replace(header, units=tuple(complete_units(header, rows[0] if rows else "")))
    return names_line, sum(len(line) + 1 for line in lines[:first]), header, rows


def _split(rows: list[str], separators: bytes) -> list[list[str]]:
    return [re.split(rf"[\s{separators.decode()}]+", row.strip()) for row in rows]


def _seconds(rows: list[list[str]], places: tuple[int, ...]) -> NDArray[np.float64]:
    """Return a time in some rows (n,), s, from one column or from hours, minutes, seconds; NaN for other words."""
    cells = [[float(row[k]) if _is_number(row[k]) else np.nan for k in places] for row in rows]
    factors = np.array([3600.0, 60.0, 1.0] if len(places) == 3 else [1.0])
    return np.asarray(np.array(cells, dtype=np.float64).reshape(-1, len(places)) @ factors)


def _text(line: bytes) -> str:
    return line.removeprefix(b"\xef\xbb\xbf").decode("latin-1").rstrip()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _needed_columns(
    header: HeaderColumns, sample: Mapping[int, NDArray[np.float64]], file: str
) -> tuple[list[tuple[str, int]], Clock]:
    """Return the names and numbers of the columns to read, and the clock (see ExportLayout).

    Raises
    ------
    RawDataError
        A column is missing, or stands twice.
    """
    names = header.names
    present = set(names)
    times, clock = choose_time_columns(header, sample, file)
    height = ["h-ell"] if "h-ell" in present else ["h-msl", "undulation"]
    needed = [*POSITION, *height, *ATTITUDE]
    missing = ([] if times else ["gpstime"]) + [column for column in needed if column not in present]
    has = f"(has: {', '.join(TITLES.get(column, column) for column in names)[:200]})"
    if missing == ["undulation"]:
        raise RawDataError(f"{file}: its height, H-MSL, is above sea level; export H-Ell as well, or Undulation")
    if missing == ["h-msl"] or missing == ["h-msl", "undulation"]:
        missing = ["h-ell"]
    if missing:
        lacking = ", ".join(TITLES[column] for column in missing)
        raise RawDataError(f"{file}: has no column {lacking} {has}; add it to the export profile")
    wanted = needed + [column for column in ("q", *SIGMA_COLUMN_NAMES.values()) if column in present]
    chosen = {column for column, _ in times} - {SECOND_GPS_TIME}
    twice = [column for column in (*wanted, *chosen - {"gpstime"}) if names.count(column) > 1]
    if twice:
        raise RawDataError(f"{file}: has column {TITLES[twice[0]]} twice; take one out of the export profile")
    return [*times, *((column, names.index(column)) for column in wanted)], clock


