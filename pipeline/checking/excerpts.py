"""Large files read in pieces: parts over evenly spread stretches, or over a short copy made of head, pieces and tail.

LAS is read at any point. The readers of binary logs find their next record after a cut, so that a copy of some pieces
in order is a log with holes; pieces of SBET are cut between records, of texts between lines. Other files (E57, Parquet)
are read from their start for as long as allowed: of those the end stays unseen.
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

POINTS = 4_000_000  # of a laser, over all its files
STRETCH = 8_192  # points read at one place
PACKED_STRETCH, PACKED_PLACES = 50_000, 24  # of LAZ each place costs a process
BYTES = {"ins": 64 << 20, "mbes": 48 << 20}  # of a sensor, over all its files
PLACES = 128
LEAST = {"ins": 1 << 16, "mbes": 1 << 19}  # read at one place: some records at least, of which a sonar's are large
HEAD = 1 << 18  # at least so much of a file's start
LOGS = ("novatel", "r2sonic", "gsf", "kmall", "all")
TEXTS = ("inertial_explorer",)


@dataclass(frozen=True)
class SurveyedSensor:
    """What the survey of one sensor's files has in common.

    Attributes
    ----------
    sensor : Sensor
        ``ins``, ``laser`` or ``mbes``.
    settings : Ins, Laser or Mbes
        The sensor's block of session.yaml.
    folder : Path
        The session folder.
    number : int
        How many files there are, which share what may be read.
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

    ``files`` is the number of the sensor's files, which share what may be read.
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
    """Return the first place, the last, and between them one at random in each step.

    At even steps always the same part of a scan's line might be read.
    """
    steps = np.linspace(0.0, 1.0, places)
    steps[1:-1] += np.random.default_rng(0).uniform(-0.45, 0.45, places - 2) / (places - 1)
    return [int(step * last) for step in steps]


@dataclass(frozen=True)
class Excerpt:
    """A short copy of a file, the share of the file in it, and from how many places it comes."""

    path: Path
    share: float = 1.0
    places: int = 1


def excerpt(path: Path, name: str, sharing: SurveyedSensor) -> Excerpt:
    """Return a short copy of a file; the file itself where it is short, or cannot be cut.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        What messages call it.
    sharing : SurveyedSensor
        The sensor's files, and where the copy goes.
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
    """Yield pieces of a file that is at least twice as long as they are together, so that they do not overlap."""
    yield from _cut(file, 0, HEAD, form)
    for start in np.linspace(HEAD, size - each, places).astype(int).tolist():
        yield from _cut(file, start, each, form)


def _cut(file: BinaryIO, start: int, count: int, form: str) -> Iterator[bytes]:
    """Yield about ``count`` bytes from ``start`` on: whole records or whole lines, if the format needs it."""
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
