"""The water's level by time, in a pool's config: ``target.water_by_time``.

The level of a harbour rises and falls with the tide, that of a lock with its valves. Either the boat tells it, for it
floats: then the config has the height of the INS above the water. Or readings of a staff or gauge do, in any datum, for
only their changes count. These stand in the pool's file, or in a text file beside it, which is read here.
"""

import hashlib
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, model_validator

from pipeline.config.beside import content_beside
from pipeline.config.quantities import Model
from pipeline.errors import ConfigError

KEY = "target.water_by_time.readings"
MOST_BYTES, MOST = 20_000_000, 10_000  # of a file; readings
LOWEST_M, HIGHEST_M = -1000, 10_000
FIRST_YEAR, LAST_YEAR = 1990, 2200
SLOT_S = 60.0  # readings of a file within a minute are averaged: waves are no tide
TIME = r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,6})?)?\s*(?:Z|[+-]\d\d:\d\d)?"
ROW = re.compile(rf"\s*(?P<time>{TIME})\s*[,;\s]\s*(?P<height>[+-]?\d+(?:\.\d+)?)\s*")


def utc_of(text: str) -> datetime:
    """Return the time that a text in ISO 8601 says; without a zone it is UTC.

    Raises
    ------
    ValueError
        The text is no such time, or one of another age.
    """
    text = text.strip()
    if not re.fullmatch(TIME, text):
        raise ValueError(f"{text[:40]!r}: is no time as 2026-05-09T05:00:00Z")
    try:
        time = datetime.fromisoformat(text)
        time = time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{text!r}: is no time as 2026-05-09T05:00:00Z") from error
    if not FIRST_YEAR <= time.year <= LAST_YEAR:
        raise ValueError(f"{text!r}: is no time of this age")
    return time


def _utc_text(text: str) -> str:
    return utc_of(text).isoformat().replace("+00:00", "Z")


Reading = tuple[Annotated[str, AfterValidator(_utc_text)], Annotated[float, Field(ge=LOWEST_M, le=HIGHEST_M)]]


def _growing(readings: tuple[Reading, ...]) -> tuple[Reading, ...]:
    for (before, _), (after, _) in pairwise(readings):
        if utc_of(after) <= utc_of(before):
            raise ValueError(f"{after} stands after {before}: times must grow")
    return readings


Readings = Annotated[tuple[Reading, ...], Field(min_length=2, max_length=MOST), AfterValidator(_growing)]


class ReadingsFile(Model):
    """The file of readings that was used: its name, its digest, and its rows."""

    file: Annotated[str, Field(max_length=1000)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    rows: int


class WaterByTime(Model):
    """How the water rises and falls: by the boat, or by readings."""

    ins_above_water_m: Annotated[float, Field(ge=-20, le=100)] | None = None  # of the point that the INS places
    readings: Readings | None = None  # UTC, and height upward in m
    readings_from: ReadingsFile | None = None  # if readings was the name of a file

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.ins_above_water_m is None) == (self.readings is None):
            raise ValueError("needs either ins_above_water_m or readings")
        return self


def with_readings(content: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the content of a pool's file with the readings of the file that it names.

    Raises
    ------
    ConfigError
        The file cannot be read, or has a line that is no reading.
    """
    target = content.get("target")
    by_time = target.get("water_by_time") if isinstance(target, dict) else None
    if not isinstance(target, dict) or not isinstance(by_time, dict):
        return content
    readings = by_time.get("readings")
    if isinstance(readings, str):
        text = content_beside(path, readings, KEY, MOST_BYTES)
        read = list(_rows(text.decode("utf-8-sig", errors="replace"), str(path.parent / readings)))
        used = {"file": readings, "sha256": hashlib.sha256(text).hexdigest(), "rows": len(read)}
        by_time = by_time | {"readings": _means(read, str(path.parent / readings)), "readings_from": used}
    elif isinstance(readings, list):  # YAML makes a time of what looks like one
        rows = [[_text(one) for one in row] if isinstance(row, list) else row for row in readings]
        by_time = by_time | {"readings": rows}
    return content | {"target": target | {"water_by_time": by_time}}


def _text(value: Any) -> Any:
    return value.isoformat() if isinstance(value, datetime) else value


def _means(rows: list[tuple[datetime, float]], where: str) -> list[list[Any]]:
    """Return the means of the readings within each minute."""
    slots: dict[float, list[tuple[datetime, float]]] = {}
    for time, height_m in rows:
        slots.setdefault(time.timestamp() // SLOT_S, []).append((time, height_m))
    if not 2 <= len(slots) <= MOST:
        raise ConfigError(f"{where}: has readings in {len(slots)} minutes, of 2 to {MOST}; give those of the session")
    means = []
    for of_slot in slots.values():
        seconds = sum(time.timestamp() for time, _ in of_slot) / len(of_slot)
        middle = datetime.fromtimestamp(round(seconds, 3), UTC)
        means.append([middle.isoformat(), round(sum(height for _, height in of_slot) / len(of_slot), 4)])
    return means


def _rows(text: str, where: str) -> Iterator[tuple[datetime, float]]:
    """Yield the readings; empty lines, those that begin with #, and a heading without a digit are passed over."""
    before, headed = None, False
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        here, match = f"{where}: line {number}: {line.strip()[:60]!a}", ROW.fullmatch(line)
        if match is None:
            if before is not None or headed or re.search(r"\d", line):
                raise ConfigError(f"{here} is no time and height in m; write them as 2026-05-09T05:00:00Z, 0.12")
            headed = True
            continue
        try:
            time, height_m = utc_of(match["time"]), float(match["height"])
        except ValueError as error:
            raise ConfigError(f"{here}: {error}; correct it") from error
        if not LOWEST_M <= height_m <= HIGHEST_M:
            raise ConfigError(f"{here}: is no height in m, of {LOWEST_M} to {HIGHEST_M}; correct it")
        if before is not None and time <= before:
            raise ConfigError(f"{here}: does not stand after the line before: times must grow; sort the lines")
        before = time
        yield time, height_m
