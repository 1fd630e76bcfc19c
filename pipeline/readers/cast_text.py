"""Read casts of sound speed from text: CARIS .svp, Kongsberg .asvp, HYPACK .vel, and columns below a header line.

CARIS: the first line is ``[SVP_VERSION_2]``, and a name follows. Then come sections, which begin with a line such as
``Section 2020-195 07:29:11 54:18:31.20 11:56:51.00`` (year and day of the year, time, latitude, longitude). Rows of
depth and speed follow each. Kongsberg: a cast begins with the line ``( SoundVelocity 1.0 0 YYYYMMDDhhmm[ss] latitude
longitude -1 0 0 NAME P 0035 )``. Its last number is the number of rows below. The first two columns of a row are depth
and speed. HYPACK: rows follow the line ``FTP NEW 2`` or ``FTP NEW 3 ...``. All three are in metres and metres per
second. :mod:`pipeline.readers.cast_columns` reads columns below a header line.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

from pipeline.errors import RawDataError
from pipeline.readers.cast_columns import cast_of_columns
from pipeline.readers.cast_values import RecordedCast, first_two_numbers, place_of, time_of_day_of_year, time_of_digits

_WIDE = str.maketrans("（），；：", "(),;:")  # full-width marks of Chinese and Japanese keyboards


def casts_of(text: str, name: str) -> tuple[str, list[RecordedCast]]:
    """Return the name of the text's format, and the casts in the text.

    Raises
    ------
    RawDataError
        The text has none of the formats, or other units than metres and m/s, or it is not complete.
    """
    lines = text.translate(_WIDE).splitlines()
    first = next((line.strip() for line in lines if line.strip()), "")
    if first.upper().startswith("[SVP_VERSION"):
        if not first.upper().startswith("[SVP_VERSION_2]"):
            raise RawDataError(f"{name}: is {first[:20]} of CARIS; export it as [SVP_VERSION_2]")
        return "CARIS .svp", _caris_casts(lines, name)
    if re.match(r"\(\s*SoundVelocity\b", first):
        return "Kongsberg .asvp", _asvp_casts(lines, name)
    if first.upper().startswith("FTP NEW"):
        return "HYPACK .vel", _hypack_casts(lines, name)
    return "columns", [cast_of_columns(lines, name)]


def _sections(lines: Sequence[str], begins: Callable[[str], bool]) -> Iterator[tuple[str, list[str]]]:
    """Yield the first line of each cast, and the other lines of the cast that are not empty."""
    starts = [number for number, line in enumerate(lines) if begins(line)]
    for start, end in pairwise([*starts, len(lines)]):
        yield lines[start], [line for line in lines[start + 1 : end] if line.strip()]


def _caris_casts(lines: Sequence[str], name: str) -> list[RecordedCast]:
    casts = []
    for head, body in _sections(lines, lambda line: line.strip().lower().startswith("section")):
        words = head.split()[1:]
        rows = tuple(first_two_numbers(line) for line in body)
        taken = time_of_day_of_year(words[0], words[1]) if len(words) > 1 else None
        casts.append(RecordedCast(rows, taken, place_of(words[2:4])))
    if not casts:
        raise RawDataError(f"{name}: has no section, and so no cast; export it again")
    return casts


def _asvp_casts(lines: Sequence[str], name: str) -> list[RecordedCast]:
    casts = []
    for head, body in _sections(lines, lambda line: line.lstrip().startswith("(")):
        words = head.strip().strip("()").split()
        rows = tuple(first_two_numbers(line) for line in body)
        promised = int(words[-1]) if words and re.fullmatch("[0-9]{1,9}", words[-1]) else len(rows)
        if promised != len(rows):
            raise RawDataError(f"{name}: its header promises {promised} rows, but it has {len(rows)}; export it again")
        taken = time_of_digits(words[3]) if len(words) > 3 else None
        casts.append(RecordedCast(rows, taken, place_of(words[4:6])))
    return casts


def _hypack_casts(lines: Sequence[str], name: str) -> list[RecordedCast]:
    casts = []
    for _, body in _sections(lines, lambda line: line.strip().upper().startswith("FTP NEW")):
        log_records = [line for line in body if re.match(r"\s*[A-Za-z]{2,4}\d?\s", line)]
        if len(log_records) > len(body) / 2:
            raise RawDataError(f"{name}: is a log of HYPACK, no cast; give the .vel file")
        casts.append(RecordedCast(tuple(first_two_numbers(line) for line in body if line not in log_records)))
    return casts
