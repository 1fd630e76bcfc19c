"""Texts of casts of sound speed as rows: CARIS .svp, Kongsberg .asvp, HYPACK .vel, and columns under a line of names.

CARIS: ``[SVP_VERSION_2]``, a name, then sections ``Section 2020-195 07:29:11 54:18:31.20 11:56:51.00`` (year and its
day, time, latitude, longitude), each with rows of depth and speed. Kongsberg: ``( SoundVelocity 1.0 0 YYYYMMDDhhmm[ss]
latitude longitude -1 0 0 NAME P 0035 )``, the last number that of the rows below, of which the first two columns are
depth and speed. HYPACK: ``FTP NEW 2`` or ``FTP NEW 3 ...``, then rows. All three are in metres and metres a second.
:mod:`pipeline.readers.cast_columns` reads columns under a line of names.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

from pipeline.errors import RawDataError
from pipeline.readers.cast_columns import cast_of_columns
from pipeline.readers.cast_values import RecordedCast, first_two_numbers, place_of, time_of_day_of_year, time_of_digits

_WIDE = str.maketrans("（），；：", "(),;:")  # as Chinese and Japanese keyboards have them


def casts_of(text: str, name: str) -> tuple[str, list[RecordedCast]]:
    """Return the kind of the text, and the casts in it.

    Raises
    ------
    RawDataError
        It is none of the kinds, or not depth in metres and sound speed in m/s.
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
    """Yield each line with which a cast begins, and the lines below it that are not empty."""
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
