"""NovAtel OEM/SPAN logs, binary and ASCII, short and long headers, by NovAtel's own decoder.

INSPVA, INSPVAS and INSPVAX are read. INSPVA(S) heights are ellipsoidal; INSPVAX heights are above sea level, the
undulation is added. Roll is right-handed about forward (starboard down +), pitch bow up +, azimuth clockwise from
north: the frames of this program already (NovAtel APN-037).
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import RawDataError
from pipeline.readers.records import ins_columns, rows_or_none
from pipeline.streams import Chunk
from pipeline.times import gps_ns_from_week_seconds

ELLIPSOIDAL = ("INSPVA", "INSPVAS")
TYPES = (*ELLIPSOIDAL, "INSPVAX")
USABLE = {3, 6, 7}  # INS_SOLUTION_GOOD, INS_SOLUTION_FREE, INS_ALIGNMENT_COMPLETE
READ_BYTES = 1 << 15
ROWS = 100_000


@dataclass(frozen=True)
class NovatelPart:
    """One log file."""

    path: Path
    name: str
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        wanted, dropped = self._choose()
        rows: list[tuple[float, ...]] = []
        for message in _messages(self.path):
            if _type_of(message) != wanted:
                continue
            status = message.ins_solution_status if hasattr(message, "ins_solution_status") else message.ins_status
            if int(status) not in USABLE:
                dropped[f"INS status {getattr(status, 'name', int(status))}"] += 1
                continue
            height = message.height + (message.undulation if wanted == "INSPVAX" else 0.0)
            week, seconds = (
                (message.week, message.seconds)
                if wanted != "INSPVAX"
                else (message.header.week, message.header.milliseconds / 1000)
            )
            rows.append(
                (week, seconds, message.latitude, message.longitude, height, message.roll, message.pitch, message.azimuth)
            )
            if len(rows) == ROWS:
                yield self._chunk(rows, dropped)
                rows, dropped = [], Counter()
        yield self._chunk(rows, dropped)

    def _chunk(self, rows: list[tuple[float, ...]], dropped: Counter[str]) -> Chunk:
        table = rows_or_none(rows, 8)
        t_ns = gps_ns_from_week_seconds(table[:, 0].astype(np.int64), table[:, 1])
        return ins_columns(t_ns, self.latency_s, *table[:, 2:5].T, *table[:, 5:].T, dropped=dict(dropped))

    def _choose(self) -> tuple[str, Counter[str]]:
        """The message type to use: ellipsoidal heights first, of these the more frequent. Counts what is unreadable."""
        found: Counter[str] = Counter()
        dropped: Counter[str] = Counter()
        for message in _messages(self.path):
            kind = _type_of(message)
            if kind == "UnknownBytes":
                dropped["undecodable bytes"] += 1
            elif kind in TYPES:
                found[kind] += 1
        if not found:
            raise RawDataError(f"{self.path}: holds no INSPVA, INSPVAS or INSPVAX; log one of them, at 50 Hz or more")
        best = max((kind for kind in ELLIPSOIDAL if found[kind]), key=lambda kind: found[kind], default="INSPVAX")
        return best, dropped


def _type_of(message: Any) -> str:
    return type(message).__name__.split("_")[0]


def _messages(path: Path) -> Iterator[Any]:
    """All messages; ASCII with bare line feeds is given carriage returns (the decoder yields nothing without)."""
    from novatel_edie.oem import Parser

    parser = Parser()
    parser.return_unknown_bytes = True
    try:
        with path.open("rb") as file:
            text = not _is_binary(file.read(8192))
            file.seek(0)
            while block := file.read(READ_BYTES):
                if text:
                    block = block.replace(b"\r", b"").replace(b"\n", b"\r\n")
                view = memoryview(block)
                while view:
                    view = view[parser.write(bytes(view)) :]
                    yield from parser
            yield from parser
    except OSError as error:
        raise RawDataError(f"{path}: cannot be read ({error.strerror}); copy it again") from error


def _is_binary(head: bytes) -> bool:
    return b"\xaaD\x12" in head or b"\xaaD\x13" in head
