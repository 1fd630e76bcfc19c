"""Units of the columns of an Inertial Explorer export: factors, units that the header omits, sizes of printed digits.

The units D M S, HMS and MDY each stand for three columns: 36 30 15.2, 6 29 6.0 or 6:29:06.0, 5/12/2026. Numbers without
a unit are in degrees, metres or seconds. A date without a unit is accepted only if its year stands first.
"""

import re
from collections.abc import Mapping

import numpy as np

from pipeline.errors import RawDataError
from pipeline.readers.inertial_explorer_names import (
    DATE_ORDERS,
    THREE_COLUMN_UNITS,
    TIME_COLUMNS,
    TITLES,
    HeaderColumns,
)
from pipeline.readers.inertial_explorer_times import SECOND_GPS_TIME

POSITION = ("latitude", "longitude")
ATTITUDE = ("roll", "pitch", "heading")
SIGMA_COLUMN_NAMES = {  # by column of the table ins_sigmas
    "north_m": "sdnorth", "east_m": "sdeast", "up_m": "sdheight",
    "roll_deg": "rollsd", "pitch_deg": "pitchsd", "heading_deg": "hdngsd",
}  # fmt: skip
HEIGHTS = ("h-ell", "h-msl", "undulation")
DATES = ("gpsdate", "utcdate")
_DEGREES = {
    "deg": 1.0, "degree": 1.0, "degrees": 1.0, "rad": 180 / np.pi, "radians": 180 / np.pi,
    **dict.fromkeys(("arcmin", "arc-min", "amin", "arcminutes"), 1 / 60),
    **dict.fromkeys(("arcsec", "arc-sec", "asec", "arcseconds"), 1 / 3600),
}  # fmt: skip
_METRES = {"m": 1.0, "metres": 1.0, "meters": 1.0, "cm": 0.01, "mm": 0.001}
_SECONDS = {"sec": 1.0, "s": 1.0, "seconds": 1.0, "hms": 1.0}
_WEEKS = {"weeks": 1.0, "week": 1.0}
_UNITS: dict[str, Mapping[str, float]] = {
    **dict.fromkeys(POSITION, _DEGREES | {"dms": 1.0}), **dict.fromkeys(ATTITUDE, _DEGREES),
    **dict.fromkeys(HEIGHTS, _METRES), **dict.fromkeys(TIME_COLUMNS, _SECONDS),
    **dict.fromkeys(DATES, dict.fromkeys(DATE_ORDERS, 1.0)), "week": _WEEKS, "weekday": {"d": 1.0},
    SECOND_GPS_TIME: _SECONDS,
    **{name: _METRES if column.endswith("_m") else _DEGREES for column, name in SIGMA_COLUMN_NAMES.items()},
}  # fmt: skip
COARSEST_DEG = 2e-7  # 2 cm: positions printed in larger steps are refused


def complete_units(header: HeaderColumns, row: str) -> list[str]:
    """Add the units that the header omits, from the first row.

    A date gets the order of its parts if the year stands first. A time gets hms if the row has colons. Latitude and
    longitude get dms if the row has four columns more than the header.

    Parameters
    ----------
    header : HeaderColumns
        Names and units.
    row : str
        The first row; empty: none.

    Returns
    -------
    list of str
        Units by column; "?dy": a date whose day and month cannot be distinguished.
    """
    filled = []
    for column, unit in zip(header.names, header.units, strict=True):
        if column in DATES and not unit:
            unit = "ymd" if re.search(r"(?<!\d)\d{4}/", row) else "?dy" if "/" in row else ""
        elif column in TIME_COLUMNS and not unit and ":" in row:
            unit = "hms"
        filled.append(unit)
    count = len(re.split(r"[\s,:/]+", row.strip())) - 2 * sum(unit in (*THREE_COLUMN_UNITS, "?dy") for unit in filled)
    positions = [k for k, column in enumerate(header.names) if column in POSITION and not filled[k]]
    if len(positions) == 2 and count == len(header.names) + 4:
        filled = ["dms" if k in positions else unit for k, unit in enumerate(filled)]
    return filled


def scale_of(column: str, unit: str, file: str) -> float:
    """Return the factor from a column's unit to degrees, metres or seconds.

    Parameters
    ----------
    column : str
        Known name of the column.
    unit : str
        Its unit; empty: it has none.
    file : str
        The file's path in the session folder, for messages.

    Raises
    ------
    RawDataError
        The unit is not known for this column, or a date has none.
    """
    known = _UNITS.get(column, {})
    if column == "q" or (not unit and column not in DATES):
        return 1.0
    if unit not in known:
        problem = f"has the unit ({unit})" if unit else "has no unit"
        problem = "has no unit to tell the day from the month" if unit == "?dy" else problem
        title = TITLES.get(column, "GPSTime")
        raise RawDataError(f"{file}: column {title} {problem}; export it as one of {', '.join(known)}")
    return known[unit]


def refuse_single_columns(header: HeaderColumns, widths: set[int], width: int, file: str) -> None:
    """Refuse rows that have one column where the unit stands for three.

    Parameters
    ----------
    header : HeaderColumns
        Names and units.
    widths : set of int
        Numbers of columns of the first rows.
    width : int
        Number of columns by the header.
    file : str
        The file's path in the session folder, for messages.

    Raises
    ------
    RawDataError
        All these rows lack two columns for each unit of three columns, or for each unit D M S.
    """
    printed_units = zip(header.printed, header.units, strict=True)
    three = [(word, unit) for word, unit in printed_units if unit in THREE_COLUMN_UNITS]
    for cause in (three, [(word, unit) for word, unit in three if unit == "dms"]):
        if cause and widths == {width - 2 * len(cause)}:
            columns = ", ".join(f"{word} ({unit})" for word, unit in cause)
            raise RawDataError(
                f"{file}: the units of {columns} stand for three columns each, but its rows have one column there; "
                "export angles in decimal degrees (deg) and times in seconds (sec), or their three parts with blanks "
                "between"
            )


def printed_step(rows: list[list[str]], places: tuple[int, ...]) -> float:
    """Return the size of one step of the last printed digit.

    Parameters
    ----------
    rows : list of lists of str
        Words of some rows.
    places : tuple of int
        The one or three columns of a number.

    Returns
    -------
    float
        Step in the number's unit; for three columns the step of the last, in the unit of the first.
    """
    decimals = max((len(row[places[-1]].partition(".")[2]) for row in rows), default=0)
    return float(10.0 ** -min(decimals, 18)) / (3600 if len(places) == 3 else 1)


def refuse_coarse_positions(steps: Mapping[str, float], file: str) -> None:
    """Raise RawDataError if latitude or longitude is printed in ``steps`` (degrees) above COARSEST_DEG."""
    for column in POSITION:
        if steps[column] > COARSEST_DEG:
            raise RawDataError(
                f"{file}: {TITLES[column]} is printed in steps of {steps[column]:.0e} degrees, more than 2 cm; "
                "export it with more digits: 8 in degrees, 5 in seconds of arc"
            )
