"""A recorded cast, and the functions that read numbers, times and positions from the texts of casts."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

NAN = float("nan")
DepthAndSpeed = tuple[float, float]


@dataclass(frozen=True)
class RecordedCast:
    """One cast as recorded in a file.

    Parameters
    ----------
    rows
        Depth [m] and sound speed [m/s] of each row; NaN for a cell that is no number.
    taken
        Date and time of the cast, in a time zone that the file need not name; None: not recorded.
    place_deg
        Latitude and longitude; None: not recorded.
    """

    rows: tuple[DepthAndSpeed, ...]
    taken: datetime | None = None
    place_deg: tuple[float, float] | None = None


def number_of(word: str, decimal_comma: bool = False) -> float:
    """Return the number in a cell, or NaN.

    >>> number_of(" 1.5 "), number_of("1,5", decimal_comma=True), number_of("n/a")
    (1.5, 1.5, nan)
    """
    try:
        return float(word.strip().replace(",", ".") if decimal_comma else word)
    except ValueError:
        return NAN


def is_number(word: str, decimal_comma: bool = False) -> bool:
    """Return whether a cell is a number, and not NaN."""
    number = number_of(word, decimal_comma)
    return number == number


def first_two_numbers(line: str) -> DepthAndSpeed:
    """Return the numbers in a line's first two columns, which blanks, commas or semicolons separate."""
    words = re.split(r"[\s,;]+", line.strip())
    return (number_of(words[0]), number_of(words[1])) if len(words) > 1 else (NAN, NAN)


def time_of_day_of_year(day: str, time: str) -> datetime | None:
    """Return date and time from CARIS's words (year and day of the year; time of the day); None if impossible.

    >>> time_of_day_of_year("2020-195", "07:29:11")
    datetime.datetime(2020, 7, 13, 7, 29, 11)
    """
    try:
        year, day_number = (int(word) for word in day.split("-"))
        hours, minutes, seconds = (float(word) for word in time.split(":"))
        since_new_year = timedelta(days=day_number - 1, hours=hours, minutes=minutes, seconds=seconds)
        return datetime(year, 1, 1) + since_new_year if 1 <= day_number <= 366 else None  # no time zone
    except (ValueError, OverflowError):
        return None


def time_of_digits(word: str) -> datetime | None:
    """Return date and time from Kongsberg's digits YYYYMMDDhhmm[ss]; None if impossible.

    >>> time_of_digits("201203212242")
    datetime.datetime(2012, 3, 21, 22, 42)
    """
    for form, length in (("%Y%m%d%H%M%S", 14), ("%Y%m%d%H%M", 12)):
        if len(word) == length and word.isdigit():
            try:
                return datetime.strptime(word, form)  # the file names no time zone
            except ValueError:
                return None
    return None


def place_of(words: Sequence[str]) -> tuple[float, float] | None:
    """Return latitude and longitude [degrees] from two words; None if they are impossible, or both 0."""
    degrees = [degrees_of(word) for word in words]
    if len(degrees) != 2 or not (abs(degrees[0]) <= 90 and abs(degrees[1]) <= 360) or degrees == [0.0, 0.0]:
        return None
    return degrees[0], degrees[1]


def degrees_of(word: str) -> float:
    """Return degrees from decimal degrees, or from degrees, minutes and seconds.

    >>> degrees_of("-12:30:00"), degrees_of("54.25")
    (-12.5, 54.25)
    """
    parts = [number_of(part) for part in word.split(":")]
    size = sum(abs(part) / 60.0**k for k, part in enumerate(parts[:3]))
    return -size if word.strip().startswith("-") else size
