"""Read casts of sound speed from columns below a header line (AML, Valeport, CastAway and others).

The header line is the first line that names a depth and a sound speed. Commas, semicolons, tabs or blanks separate the
names. The unit of a column stands in its name (in brackets or at the end), or in the line below the header line. The
unit of depth may also stand in an earlier line of its own. Without units depths are in metres and speeds in m/s.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from pipeline.errors import RawDataError
from pipeline.readers.cast_values import NAN, DepthAndSpeed, RecordedCast, is_number, number_of, place_of

MAX_HEADER_LINES = 300  # lines in which the header line is searched
SPEED = re.compile(
    r"\b(sound (speed|velocity)|speed of sound|soundspeed|soundvelocity|svp?|ssp?)\b|^(speed|velocity|vel)\b|声速"
)
DEPTH = re.compile(r"\bdepth\b|^d$|深度|水深")
PRESSURE = re.compile(r"\bpress|\bdbar\b|压力")
WATER_PROPERTY = re.compile(r"\b(temp|cond|salin)\w*|温度|盐度")
METRE_WORDS = {"", "m", "meter", "meters", "metre", "metres", "米"}
METRES_PER_SECOND = {
    "", "m/s", "m/sec", "m s", "ms-1", "m s-1", "m.s-1", "m*s-1", "m/second", "meter per second", "meters per second",
    "metres per second", "meters/second", "metres/second", "meter/second", "米/秒",
}  # fmt: skip
OTHER_UNIT = re.compile(r"\b(ft/s|ft|feet|foot|f/s|fps|fm|fathoms?|yards?|yd|km|dm|cm|mm|dbar)\b|英尺|厘米|毫米")
DEPTH_UNIT = re.compile(r"\bdepth[ _]?units?\b\W*(\w+)", re.IGNORECASE)  # in a line above the header line
_ADVICE = "export depth in metres and sound speed in m/s"


@dataclass(frozen=True)
class _Header:
    """The header line: its number, the separator of its cells, and the column numbers of depth and sound speed."""

    number: int
    separator: str
    columns: tuple[int, int]


def cast_of_columns(lines: Sequence[str], name: str) -> RecordedCast:
    """Return the cast in the text ``lines`` of a file; ``name`` names the file in messages.

    Raises
    ------
    RawDataError
        No line names a depth and a sound speed, several columns hold one of them, or a unit is not metres or m/s.
    """
    header = _header(lines, name)
    before, below = lines[: header.number], header.number + 1
    while below < len(lines) and not lines[below].strip():
        below += 1
    units = _units_below(lines, header, below)
    _refuse_other_units(lines, header, units, name)
    rows = _rows(lines[below:], header)
    if units != ("", ""):
        rows = rows[1:]
    return RecordedCast(tuple(rows), _time_in(before), _place_in(before))


def _header(lines: Sequence[str], name: str) -> _Header:
    for number, line in enumerate(lines[:MAX_HEADER_LINES]):
        separator = _separator(line)
        cells = _cells(line, separator)
        depths, speeds = _matching(cells, DEPTH), _matching(cells, SPEED)
        if separator == " " and (len(cells) > 6 or any(is_number(cell) for cell in cells)):
            continue  # a sentence, or a row of numbers
        if depths and speeds and depths != speeds:
            columns = (_only(depths, cells, "depth", name), _only(speeds, cells, "sound speed", name))
            return _Header(number, separator, columns)
    raise RawDataError(f"{name}: {_why_no_cast(lines)}")


def _separator(line: str) -> str:
    return max(",;\t", key=line.count) if any(mark in line for mark in ",;\t") else " "


def _cells(line: str, separator: str) -> list[str]:
    line = re.sub(r"^\s*(columns|units)\s*=", "", line.strip("\r\n"), flags=re.I).lstrip("#%/ ")
    if separator == " ":  # no blank may divide a name from its unit in brackets, nor the words "sound speed"
        line = re.sub(r"\([^()]*\)", lambda bracketed: bracketed.group().replace(" ", "_"), line)
        line = re.sub(r"(?i)\bsound (speed|velocity)", r"sound_\1", re.sub(r"\s+(?=[\[(])", "", line))
    cells = line.split() if separator == " " else line.split(separator)
    return [cell.strip().strip('"') for cell in cells]


def _matching(cells: Sequence[str], pattern: re.Pattern[str]) -> list[int]:
    return [k for k, cell in enumerate(cells) if pattern.search(_without_unit(cell)) and len(cell) < 80]


def _without_unit(cell: str) -> str:
    """Return a column's name without its unit.

    >>> _without_unit("Sound_Velocity (M/SEC)"), _without_unit("depth_m")
    ('sound velocity', 'depth m')
    """
    return re.sub(r"[\[(].*", "", cell.lower()).replace("_", " ").replace(".", " ").strip()


def _only(columns: Sequence[int], cells: Sequence[str], quantity: str, name: str) -> int:
    """Return the only one of the ``columns`` of a quantity; raise RawDataError if there are several."""
    if len(columns) > 1:
        names = " and ".join(cells[k] for k in columns[:3])
        raise RawDataError(f"{name}: has {len(columns)} columns of {quantity}: {names}; leave in it the one to be used")
    return columns[0]


def _units_below(lines: Sequence[str], header: _Header, below: int) -> tuple[str, ...]:
    """Return the units of depth and speed from line number ``below``; two empty texts if it is no line of units."""
    cells = _cells(lines[below], header.separator) if below < len(lines) else []
    units = tuple(cells[k].strip("()[] ").lower() for k in header.columns if k < len(cells))
    has_numbers = any(is_number(cell, header.separator != ",") for cell in cells)
    if has_numbers or len(units) != len(header.columns):
        return ("", "")
    has_units = any(unit in METRE_WORDS | METRES_PER_SECOND or OTHER_UNIT.search(unit) for unit in units)
    n_names = len(_cells(lines[header.number], header.separator))
    return units if has_units or len(cells) >= n_names > 1 else ("", "")


def _refuse_other_units(lines: Sequence[str], header: _Header, units: Sequence[str], name: str) -> None:
    names = _cells(lines[header.number], header.separator)
    depth_units = (match[1].lower() for line in lines[: header.number] if (match := DEPTH_UNIT.search(line)))
    depth_unit = next(depth_units, "")
    for k, accepted, unit in zip(header.columns, (METRE_WORDS, METRES_PER_SECOND), units, strict=True):
        stated = _unit_in(names[k]) or unit or (depth_unit if accepted is METRE_WORDS else "")
        if stated not in accepted:
            raise RawDataError(f"{name}: its column {names[k]} is in {stated}; {_ADVICE}")


def _unit_in(cell: str) -> str:
    """Return the unit in a column's name, in lower case; an empty text without a unit.

    >>> _unit_in("Depth (Meter)"), _unit_in("depth_m"), _unit_in("Sound Velocity"), _unit_in("sound_speed_m_s")
    ('meter', 'm', '', 'm s')
    >>> _unit_in("Depth ft:")
    'ft'
    """
    bracketed = re.search(r"[\[(]([^\])]*)[\])]", cell)
    if bracketed:
        return bracketed.group(1).replace("_", " ").strip().lower()
    words = cell.lower().replace("_", " ")
    bare = OTHER_UNIT.search(words) or re.search(r"\b(m s|m/s|m/sec|m)$", words)
    return bare.group() if bare else ""


def _rows(lines: Sequence[str], header: _Header) -> list[DepthAndSpeed]:
    """Return depth and speed of each line that is not empty; NaN for a missing cell or a cell without a number."""
    rows = []
    depth, speed = header.columns
    decimal_comma = header.separator != ","
    for line in lines:
        cells = _cells(line, header.separator)
        if line.strip() and len(cells) > max(header.columns):
            rows.append((number_of(cells[depth], decimal_comma), number_of(cells[speed], decimal_comma)))
        elif line.strip():
            rows.append((NAN, NAN))
    return rows


def _time_in(lines: Sequence[str]) -> datetime | None:
    """Return date and time from a line with the word cast, time or date; lines that also have UTC come first."""
    for zone in ("utc", ""):
        for line in lines:
            digits = re.search(r"(\d{4})[-/](\d\d)[-/](\d\d)[ T,]+(\d\d):(\d\d):(\d\d)", line)
            if digits and zone in line.lower() and re.search(r"cast|time|date", line, re.I):
                try:
                    return datetime(*(int(part) for part in digits.groups()))  # type: ignore[arg-type]
                except ValueError:
                    continue
    return None


def _place_in(lines: Sequence[str]) -> tuple[float, float] | None:
    """Return latitude and longitude [degrees] from the lines that name them; None without a possible position."""
    values = []
    for word in ("latitude", "longitude"):
        line = next((line for line in lines if word in line.lower()), "")
        value = re.search(r"-?\d+\.\d+", line)
        values.append(value.group() if value else "nan")
    return place_of(values)


def _why_no_cast(lines: Sequence[str]) -> str:
    """Return the words of a message: why these lines hold no cast, and what the user should do."""
    head = [
        " ".join(_without_unit(cell) for cell in _cells(line, _separator(line))) for line in lines[:MAX_HEADER_LINES]
    ]
    text = "\n".join(head)
    if SPEED.search(text) and PRESSURE.search(text):
        return f"has pressure, and no depth; {_ADVICE}"
    if WATER_PROPERTY.search(text):
        return f"has temperature, conductivity or salinity, and no sound speed with a depth; {_ADVICE}"
    return (
        "is no cast: neither CARIS .svp, Kongsberg .asvp nor HYPACK .vel, and no line names a depth and a sound speed; "
        "if its columns are depth in metres and sound speed in m/s, put the line depth_m,speed_m_s above them"
    )
