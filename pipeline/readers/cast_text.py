"""Texts of casts of sound speed as rows: CARIS .svp, Kongsberg .asvp, HYPACK .vel, and columns under a line of names.

CARIS: ``[SVP_VERSION_2]``, a name, then sections ``Section 2020-195 07:29:11 54:18:31.20 11:56:51.00`` (year and its
day, time, latitude, longitude), each with rows of depth and speed. Kongsberg: ``( SoundVelocity 1.0 0 YYYYMMDDhhmm[ss]
latitude longitude -1 0 0 NAME P 0035 )``, the last number that of the rows below, of which the first two columns are
depth and speed. HYPACK: ``FTP NEW 2`` or ``FTP NEW 3 ...``, then rows. All three are in metres and metres a second.

Columns (AML, Valeport, CastAway and others): the first line that names a depth and a sound speed, parted by commas,
semicolons, tabs or blanks; units stand in the names, in brackets, or in the line below; none means m and m/s.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from pipeline.errors import RawDataError

Row = tuple[float, float]
MOST_BEFORE = 300  # lines before the names of columns
NAN = float("nan")
SPEED = re.compile(
    r"\b(sound (speed|velocity)|speed of sound|soundspeed|soundvelocity|svp?|ssp?)\b|^(speed|velocity|vel)\b|声速"
)
DEPTH = re.compile(r"\bdepth\b|^d$|深度|水深")
PRESSURE = re.compile(r"\bpress|\bdbar\b|压力")
OTHER = re.compile(r"\b(temp|cond|salin)\w*|温度|盐度")
METRES = {"", "m", "meter", "meters", "metre", "metres", "米"}
METRES_PER_SECOND = {
    "", "m/s", "m/sec", "m s", "ms-1", "m s-1", "m.s-1", "m*s-1", "m/second", "meter per second", "meters per second",
    "metres per second", "meters/second", "metres/second", "meter/second", "米/秒",
}  # fmt: skip
OTHER_UNIT = re.compile(r"\b(ft/s|ft|feet|foot|f/s|fps|fm|fathoms?|yards?|yd|km|dm|cm|mm|dbar)\b|英尺|厘米|毫米")
DEPTH_UNIT = re.compile(r"\bdepth[ _]?units?\b\W*(\w+)", re.IGNORECASE)  # a line of its own, before the columns
WIDE = str.maketrans("（），；：", "(),;:")  # as Chinese and Japanese keyboards have them
ADVICE = "export depth in metres and sound speed in m/s"


@dataclass(frozen=True)
class Cast:
    """Rows of depth (m) and speed (m/s) as they stand there, NaN where a cell is no number. ``taken``: the file's own
    time, which does not say its zone; ``place_deg``: latitude, longitude."""

    rows: tuple[Row, ...]
    taken: datetime | None = None
    place_deg: tuple[float, float] | None = None


def casts_of(text: str, name: str) -> tuple[str, list[Cast]]:
    """The kind of the text, and the casts in it.

    Raises
    ------
    RawDataError
        It is none of the kinds, or not depth in metres and sound speed in m/s.
    """
    lines = text.translate(WIDE).splitlines()
    first = next((line.strip() for line in lines if line.strip()), "")
    if first.upper().startswith("[SVP_VERSION"):
        if not first.upper().startswith("[SVP_VERSION_2]"):
            raise RawDataError(f"{name}: is {first[:20]} of CARIS; export it as [SVP_VERSION_2]")
        return "CARIS .svp", _sections(lines[lines.index(next(x for x in lines if x.strip())) + 1 :], name)
    if re.match(r"\(\s*SoundVelocity\b", first):
        return "Kongsberg .asvp", _asvp(lines, name)
    if first.upper().startswith("FTP NEW"):
        return "HYPACK .vel", _hypack(lines, name)
    return "columns", [_columns(lines, name)]


def number_of(word: str, decimal_comma: bool = False) -> float:
    """
    >>> number_of(" 1.5 "), number_of("1,5", decimal_comma=True), number_of("n/a")
    (1.5, 1.5, nan)
    """
    try:
        return float(word.strip().replace(",", ".") if decimal_comma else word)
    except ValueError:
        return NAN


def _pair(line: str) -> Row:
    words = re.split(r"[\s,;]+", line.strip())
    return (number_of(words[0]), number_of(words[1])) if len(words) > 1 else (NAN, NAN)


# --- CARIS -----------------------------------------------------------------------------------------------------------
def _sections(lines: Sequence[str], name: str) -> list[Cast]:
    starts = [k for k, line in enumerate(lines) if line.strip().lower().startswith("section")]
    if not starts:
        raise RawDataError(f"{name}: has no section, and so no cast; export it again")
    found = []
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        words = lines[start].split()[1:]
        rows = tuple(_pair(line) for line in lines[start + 1 : end] if line.strip())
        taken = _day_of_year(words[0], words[1]) if len(words) > 1 else None
        found.append(Cast(rows, taken, _place(words[2:4])))
    return found


def _day_of_year(day: str, time: str) -> datetime | None:
    """
    >>> _day_of_year("2020-195", "07:29:11")
    datetime.datetime(2020, 7, 13, 7, 29, 11)
    """
    try:
        year, number = (int(word) for word in day.split("-"))
        hours, minutes, seconds = (float(word) for word in time.split(":"))
        step = timedelta(days=number - 1, hours=hours, minutes=minutes, seconds=seconds)
        return datetime(year, 1, 1) + step if 1 <= number <= 366 else None  # no zone is told
    except (ValueError, OverflowError):
        return None


def _place(words: Sequence[str]) -> tuple[float, float] | None:
    degrees = [_degrees(word) for word in words]
    if len(degrees) != 2 or not (abs(degrees[0]) <= 90 and abs(degrees[1]) <= 360) or degrees == [0.0, 0.0]:
        return None
    return degrees[0], degrees[1]


def _degrees(word: str) -> float:
    """
    >>> _degrees("-12:30:00"), _degrees("54.25")
    (-12.5, 54.25)
    """
    parts = [number_of(part) for part in word.split(":")]
    size = sum(abs(part) / 60.0**k for k, part in enumerate(parts[:3]))
    return -size if word.strip().startswith("-") else size


# --- Kongsberg, HYPACK -----------------------------------------------------------------------------------------------
def _asvp(lines: Sequence[str], name: str) -> list[Cast]:
    starts = [k for k, line in enumerate(lines) if line.lstrip().startswith("(")]
    found = []
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        words = lines[start].strip().strip("()").split()
        rows = tuple(_pair(line) for line in lines[start + 1 : end] if line.strip())
        told = int(words[-1]) if words and re.fullmatch("[0-9]{1,9}", words[-1]) else len(rows)
        if told != len(rows):
            raise RawDataError(f"{name}: its header tells of {told} rows, it has {len(rows)}; copy or export it again")
        taken = _compact(words[3]) if len(words) > 3 else None
        found.append(Cast(rows, taken, _place(words[4:6])))
    return found


def _compact(word: str) -> datetime | None:
    """
    >>> _compact("201203212242")
    datetime.datetime(2012, 3, 21, 22, 42)
    """
    for form, length in (("%Y%m%d%H%M%S", 14), ("%Y%m%d%H%M", 12)):
        if len(word) == length and word.isdigit():
            try:
                return datetime.strptime(word, form)  # no zone is told
            except ValueError:
                return None
    return None


def _hypack(lines: Sequence[str], name: str) -> list[Cast]:
    starts = [k for k, line in enumerate(lines) if line.strip().upper().startswith("FTP NEW")]
    found = []
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        body = [line for line in lines[start + 1 : end] if line.strip()]
        records = [line for line in body if re.match(r"\s*[A-Za-z]{2,4}\d?\s", line)]
        if len(records) > len(body) / 2:
            raise RawDataError(f"{name}: is a log of HYPACK, no cast; give the .vel file")
        found.append(Cast(tuple(_pair(line) for line in body if line not in records)))
    return found


# --- columns ---------------------------------------------------------------------------------------------------------
def _columns(lines: Sequence[str], name: str) -> Cast:
    for number, line in enumerate(lines[:MOST_BEFORE]):
        separator = _separator(line)
        cells = _cells(line, separator)
        depths, speeds = _matching(cells, DEPTH), _matching(cells, SPEED)
        if separator == " " and (len(cells) > 6 or any(number_of(cell) == number_of(cell) for cell in cells)):
            continue  # a sentence, or a row
        if depths and speeds and depths != speeds:
            place = (_only(depths, cells, "depth", name), _only(speeds, cells, "sound speed", name))
            return _rows(lines, number, separator, place, name)
    raise RawDataError(f"{name}: {_lacking(lines)}")


def _separator(line: str) -> str:
    return max(",;\t", key=line.count) if any(mark in line for mark in ",;\t") else " "


def _cells(line: str, separator: str) -> list[str]:
    line = re.sub(r"^\s*(columns|units)\s*=", "", line.strip("\r\n"), flags=re.I).lstrip("#%/ ")
    if separator == " ":  # a unit in brackets and sound speed are one cell with what they belong to
        line = re.sub(r"\([^()]*\)", lambda found: found.group().replace(" ", "_"), line)
        line = re.sub(r"(?i)\bsound (speed|velocity)", r"sound_\1", re.sub(r"\s+(?=[\[(])", "", line))
    cells = line.split() if separator == " " else line.split(separator)
    return [cell.strip().strip('"') for cell in cells]


def _matching(cells: Sequence[str], pattern: re.Pattern[str]) -> list[int]:
    return [k for k, cell in enumerate(cells) if pattern.search(_plain(cell)) and len(cell) < 80]


def _plain(cell: str) -> str:
    """A name without its unit.

    >>> _plain("Sound_Velocity (M/SEC)"), _plain("depth_m")
    ('sound velocity', 'depth m')
    """
    return re.sub(r"[\[(].*", "", cell.lower()).replace("_", " ").replace(".", " ").strip()


def _only(places: Sequence[int], cells: Sequence[str], what: str, name: str) -> int:
    if len(places) > 1:
        both = " and ".join(cells[k] for k in places[:3])
        raise RawDataError(f"{name}: has {len(places)} columns of {what}: {both}; leave in it the one to be used")
    return places[0]


def _rows(lines: Sequence[str], number: int, separator: str, place: tuple[int, int], name: str) -> Cast:
    names = _cells(lines[number], separator)
    below = number + 1
    while below < len(lines) and not lines[below].strip():
        below += 1
    units = ["", ""]
    under = _cells(lines[below], separator) if below < len(lines) else []
    comma = separator != ","
    worded = not any(number_of(cell, comma) == number_of(cell, comma) for cell in under)
    below_place = [under[k].strip("()[] ").lower() for k in place if k < len(under)]
    units_there = any(unit in METRES | METRES_PER_SECOND or OTHER_UNIT.search(unit) for unit in below_place)
    if worded and len(below_place) == len(place) and (units_there or len(under) >= len(names) > 1):
        units = below_place
    before = next((unit_told[1].lower() for line in lines[:number] if (unit_told := DEPTH_UNIT.search(line))), "")
    for k, known, unit in zip(place, (METRES, METRES_PER_SECOND), units, strict=True):
        told = _unit(names[k]) or unit or (before if known is METRES else "")
        if told not in known:
            raise RawDataError(f"{name}: its column {names[k]} is in {told}; {ADVICE}")
    found = []
    for line in lines[below:]:
        cells = _cells(line, separator)
        if line.strip() and len(cells) > max(place):
            found.append((number_of(cells[place[0]], comma), number_of(cells[place[1]], comma)))
        elif line.strip():
            found.append((NAN, NAN))
    if under and units != ["", ""]:
        found = found[1:]
    return Cast(tuple(found), _said_time(lines[:number]), _said_place(lines[:number]))


def _unit(cell: str) -> str:
    """
    >>> _unit("Depth (Meter)"), _unit("depth_m"), _unit("Sound Velocity"), _unit("sound_speed_m_s"), _unit("Depth ft:")
    ('meter', 'm', '', 'm s', 'ft')
    """
    bracketed = re.search(r"[\[(]([^\])]*)[\])]", cell)
    if bracketed:
        return bracketed.group(1).replace("_", " ").strip().lower()
    words = cell.lower().replace("_", " ")
    bare = OTHER_UNIT.search(words) or re.search(r"\b(m s|m/s|m/sec|m)$", words)
    return bare.group() if bare else ""


def _said_time(lines: Sequence[str]) -> datetime | None:
    """The time in UTC, else any, that a line before the columns names as the cast's: year, month, day, time."""
    for wanted in ("utc", ""):
        for line in lines:
            found = re.search(r"(\d{4})[-/](\d\d)[-/](\d\d)[ T,]+(\d\d):(\d\d):(\d\d)", line)
            if found and wanted in line.lower() and re.search(r"cast|time|date", line, re.I):
                try:
                    return datetime(*(int(part) for part in found.groups()))  # type: ignore[arg-type]
                except ValueError:
                    continue
    return None


def _said_place(lines: Sequence[str]) -> tuple[float, float] | None:
    found = []
    for word in ("latitude", "longitude"):
        line = next((line for line in lines if word in line.lower()), "")
        value = re.search(r"-?\d+\.\d+", line)
        found.append(value.group() if value else "nan")
    return _place(found)


def _lacking(lines: Sequence[str]) -> str:
    """Why there is no cast in these lines, and what to do."""
    head = [" ".join(_plain(cell) for cell in _cells(line, _separator(line))) for line in lines[:MOST_BEFORE]]
    text = "\n".join(head)
    if SPEED.search(text) and PRESSURE.search(text):
        return f"has pressure, and no depth; {ADVICE}"
    if OTHER.search(text):
        return f"has temperature, conductivity or salinity, and no sound speed with a depth; {ADVICE}"
    return (
        "is no cast: neither CARIS .svp, Kongsberg .asvp nor HYPACK .vel, and no line names a depth and a sound speed; "
        "if its columns are depth in metres and sound speed in m/s, put the line depth_m,speed_m_s above them"
    )
