"""The water's level by time, in a pool's config: ``target.water_level_changes``.

The level of a harbour rises and falls with the tide, that of a lock with its valves. Only the changes matter, for
``water_level_m`` says how high the water stands against the target. So readings of any staff or gauge serve, in any
datum. They stand in the pool's file, or in a text file beside it, which is read here. Where the boat's height is sure
(RTK fixed), the INS tells the changes itself, for the boat floats: ``ins``.
"""

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag

from pipeline.atomic_files import read_regular
from pipeline.errors import ConfigError

BY_INS: Literal["ins"] = "ins"
MOST_BYTES = 20_000_000
SLOT_S = 60.0  # readings of a file within a minute are averaged: waves are no tide
ROW = re.compile(
    r"\s*(?P<time>\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,6})?)?\s*(?:Z|[+-]\d\d:\d\d)?)"
    r"\s*[,;\s]\s*(?P<height>[+-]?\d+(?:\.\d+)?)\s*"
)
EXAMPLE = "2026-05-09T05:00:00Z, 0.12"


def utc_of(text: str) -> datetime:
    """Return the time that a text in ISO 8601 says; without a zone it is UTC."""
    time = datetime.fromisoformat(text.strip())
    return time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)


def _utc_text(text: str) -> str:
    try:
        time = utc_of(text)
    except (ValueError, OverflowError):
        raise ValueError(f"{text!r}: is no time as 2026-05-09T05:00:00Z") from None
    return time.isoformat().replace("+00:00", "Z")


Reading = tuple[Annotated[str, AfterValidator(_utc_text)], Annotated[float, Field(ge=-1000, le=10_000)]]


def _growing(readings: tuple[Reading, ...]) -> tuple[Reading, ...]:
    for (before, _), (after, _) in pairwise(readings):
        if utc_of(after) <= utc_of(before):
            raise ValueError(f"{after} stands after {before}: times must grow")
    return readings


Readings = Annotated[tuple[Reading, ...], Field(min_length=2, max_length=10_000), AfterValidator(_growing)]
WaterLevelChanges = Annotated[  # heights in any datum; they are compared with each other alone
    Annotated[Literal["ins"], Tag("by_ins")] | Annotated[Readings, Tag("readings")],
    Discriminator(lambda value: "by_ins" if isinstance(value, str) else "readings"),
]


def with_water_levels(content: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the content of a pool's file with the readings of the file that target.water_level_changes names.

    Raises
    ------
    ConfigError
        The file cannot be read, or has a line that is no reading.
    """
    target = content.get("target")
    changes = target.get("water_level_changes") if isinstance(target, dict) else None
    if isinstance(changes, list):
        return _with(content, [[_text(one) for one in row] if isinstance(row, list) else row for row in changes])
    if not isinstance(changes, str) or changes == BY_INS:
        return content
    where = f"{path}: target.water_level_changes = {changes!r}"
    if Path(changes).is_absolute() or ".." in Path(changes).parts or set(changes) & {"\\", "\0"}:
        raise ConfigError(f"{where}: must be ins, or name a file beside this one, or in a folder beside it")
    try:
        text = read_regular(path.parent / changes, MOST_BYTES)
    except OSError as error:
        raise ConfigError(f"{where}: cannot be read ({error.strerror}); check the path") from error
    if len(text) > MOST_BYTES:
        raise ConfigError(f"{where}: more than {MOST_BYTES:,} bytes; give the readings of the session alone")
    return _with(content, _means(text.decode("utf-8-sig", errors="replace"), where))


def _with(content: dict[str, Any], readings: list[Any]) -> dict[str, Any]:
    return content | {"target": content["target"] | {"water_level_changes": readings}}


def _text(value: Any) -> Any:
    """Return a time as text: YAML makes a time of what looks like one."""
    return value.isoformat() if isinstance(value, datetime) else value


def _means(text: str, where: str) -> list[list[Any]]:
    """Return the means of the readings within each minute."""
    slots: dict[float, list[tuple[datetime, float]]] = {}
    for time, height_m in _rows(text, where):
        slots.setdefault(time.timestamp() // SLOT_S, []).append((time, height_m))
    means = []
    for rows in slots.values():
        seconds = sum(time.timestamp() for time, _ in rows) / len(rows)
        middle = datetime.fromtimestamp(round(seconds, 3), UTC)
        means.append([middle.isoformat(), round(sum(height for _, height in rows) / len(rows), 4)])
    return means


def _rows(text: str, where: str) -> Iterator[tuple[datetime, float]]:
    """Yield the readings; empty lines, those that begin with #, and a heading are passed over."""
    first = True
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        match, heading = ROW.fullmatch(line), first and not re.match(r"\s*\d", line)
        first = False
        if match is None and not heading:
            raise ConfigError(
                f"{where}: line {number}: {line.strip()[:60]!a} is no time and height in m; write them as {EXAMPLE}"
            )
        if match is not None:
            try:
                yield utc_of(match["time"]), float(match["height"])
            except ValueError:
                raise ConfigError(f"{where}: line {number}: {match['time']} is no time; correct it") from None
