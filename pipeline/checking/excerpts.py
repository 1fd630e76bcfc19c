"""Large files read in pieces: stretches of a LAS file, or a short copy made of a file's start, pieces and its end.

LAS can be read from any point. The readers of binary logs find the next record after a cut, so that a copy of some
pieces in their order reads as a log with holes. Pieces of SBET are cut between records, pieces of texts between lines.
Other files (E57, Parquet) are read from their start up to a limit. Their end stays unread.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pipeline.artefacts.streams import Part
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.readers.las import LasPart
from pipeline.readers.raw_file import opened, read_at, size_of
from pipeline.readers.sbet import SBET_RECORD

POINTS = 4_000_000  # upper limit, about, of the points read of a laser's files together
STRETCH = 8_192  # points read at one place
PACKED_STRETCH, PACKED_PLACES = 50_000, 24  # points at one place of LAZ, and places: each place costs a process
BYTES = {"ins": 64 << 20, "mbes": 48 << 20}  # upper limit, about, of the bytes read of a sensor's files together
PLACES = 128  # most places in one file
LEAST = {"ins": 1 << 16, "mbes": 1 << 19}  # least bytes at one place: several records, and a sonar's are large
HEAD = 1 << 18  # bytes of a file's start
LOGS = ("novatel", "r2sonic", "gsf", "kmall", "all")
TEXTS = ("inertial_explorer",)


@dataclass(frozen=True)
class SurveyedSensor:
    """A sensor's settings and folders, the same for the survey of each of its files.

    Attributes
    ----------
    sensor : Sensor
        ``ins``, ``laser`` or ``mbes``.
    settings : Ins, Laser or Mbes
        The sensor's block of session.yaml.
    folder : Path
        The session folder.
    number : int
        Number of the sensor's files. They share the limits of points and bytes.
    copies : Path
        The folder for short copies.
    """

    sensor: Sensor
    settings: Ins | Laser | Mbes
    folder: Path
    number: int
    copies: Path


def stretches(parts: Sequence[LasPart], files: int) -> tuple[list[Part], float]:
    """Return parts over evenly spread stretches of one LAS file, and the share of its points in them.

    ``files`` is the number of the sensor's files, which share the limit POINTS.
    """
    total = sum(part.stop - part.start for part in parts)
    packed = any(part.compressed for part in parts)
    if total <= POINTS // files:
        return list(parts), 1.0
    each = PACKED_STRETCH if packed else STRETCH
    places = max(3, (PACKED_PLACES if packed else POINTS // STRETCH) // files)
    if places * each >= total:
        return list(parts), 1.0
    spread: list[Part] = []
    for start in _starts(total - each, places):
        part = next(part for part in parts if part.start <= start < part.stop)
        last = start + each >= total
        spread.append(replace(part, start=start, stop=min(start + each, part.stop), missing=part.missing * last))
    return spread, places * each / total


def _starts(last: int, places: int) -> list[int]:
    """Return the places: 0, ``last``, and between them even steps, each shifted at random by less than half a step.

    Without the random shifts, all places might show the same part of a scan line.
    """
    steps = np.linspace(0.0, 1.0, places)
    steps[1:-1] += np.random.default_rng(0).uniform(-0.45, 0.45, places - 2) / (places - 1)
    return [int(step * last) for step in steps]


@dataclass(frozen=True)
class Excerpt:
    """A short copy of a file, the share of the file that it holds, and the number of places that it was taken from."""

    path: Path
    share: float = 1.0
    places: int = 1


def excerpt(path: Path, name: str, sharing: SurveyedSensor) -> Excerpt:
    """Write a short copy of a file and return it; return the file itself if it is short or cannot be cut.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        The file's name in messages.
    sharing : SurveyedSensor
        The sensor's settings, the number of its files, and the folder for the copy.
    """
    sensor, settings = sharing.sensor, sharing.settings
    allowed = BYTES.get(sensor, 0) // sharing.number
    with opened(path, name) as file:
        size = size_of(file)
        least = LEAST.get(sensor, HEAD)
        if size <= 2 * max(allowed, HEAD + 2 * least) or settings.format not in (*LOGS, *TEXTS, "sbet"):
            return Excerpt(path)
        copy = sharing.copies / f"{sensor}{len(list(sharing.copies.iterdir()))}"
        each = max(allowed // PLACES, least)
        places = max(2, allowed // each)
        with copy.open("wb") as out:
            for piece in _pieces(file, size, each, places, settings.format):
                out.write(piece)
        return Excerpt(copy, copy.stat().st_size / size, places)


def _pieces(file: BinaryIO, size: int, each: int, places: int, form: str) -> Iterator[bytes]:
    """Yield the start of a file, and pieces evenly spread up to its end.

    ``excerpt`` calls this only for files so long that the pieces do not overlap.
    """
    yield from _cut(file, 0, HEAD, form)
    for start in np.linspace(HEAD, size - each, places).astype(int).tolist():
        yield from _cut(file, start, each, form)


def _cut(file: BinaryIO, start: int, count: int, form: str) -> Iterator[bytes]:
    """Yield about ``count`` bytes from byte ``start`` on: whole records of SBET, whole lines of texts."""
    if form == "sbet":
        start, count = -(-start // SBET_RECORD) * SBET_RECORD, count // SBET_RECORD * SBET_RECORD
        data = read_at(file, start, count)
        yield data[: len(data) // SBET_RECORD * SBET_RECORD]
    elif form in TEXTS:
        data = read_at(file, start, count)
        first = data.find(b"\n") + 1 if start else 0
        yield data[first : data.rfind(b"\n") + 1]
    else:
        yield read_at(file, start, count)
