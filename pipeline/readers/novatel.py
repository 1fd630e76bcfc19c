"""NovAtel OEM/SPAN logs, binary and ASCII: INSPVA, INSPVAS and INSPVAX records, and the INS's own sigmas.

Framing and ASCII are left to NovAtel's own decoder (novatel_edie), which turns every record into its binary form;
the layouts below are those of the OEM7 Commands and Logs Reference Manual (INSPVA 507, INSPVAS 508, INSPVAX 1465,
INSSTDEV 2051, INSSTDEVS 2052; binary header 28 bytes after sync 0xAA4412, short header 12 bytes after 0xAA4413, CRC
4 bytes behind the body).

Where a file holds several of the three, one is used: that with the most usable records, but INSPVA or INSPVAS, whose
heights are ellipsoidal, unless INSPVAX has more than twice as many. INSPVAX heights are above sea level: its own
undulation is added. Usable: status INS_SOLUTION_GOOD, INS_ALIGNMENT_COMPLETE or INS_SOLUTION_FREE.

The sigmas (latitude, longitude, height [m], velocities, roll, pitch, azimuth [degrees]) are those of INSSTDEV, else of
INSSTDEVS, at the header's milliseconds, else those of usable INSPVAX.
"""

import re
import threading
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby, islice
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from pipeline.artefacts.streams import Chunk
from pipeline.gps_time import gps_ns_from_week_seconds
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import (
    INS_COLUMNS,
    SIGMA_COLUMNS,
    Order,
    Sieve,
    chunk,
    keep_possible_poses,
    latency_ns,
    no_rows,
    possible_week_time,
    sigma_rows,
)

NAMES = {507: "INSPVA", 508: "INSPVAS", 1465: "INSPVAX"}
SIGMAS = {2051: "INSSTDEV", 2052: "INSSTDEVS", 1465: "INSPVAX"}  # the first that is there
GOOD, FREE, COMPLETE = 3, 6, 7
USABLE = (GOOD, FREE, COMPLETE)
STATUS = {
    0: "INS_INACTIVE", 1: "INS_ALIGNING", 2: "INS_HIGH_VARIANCE", 3: "INS_SOLUTION_GOOD", 6: "INS_SOLUTION_FREE",
    7: "INS_ALIGNMENT_COMPLETE", 8: "DETERMINING_ORIENTATION", 9: "WAITING_INITIALPOS", 10: "WAITING_AZIMUTH",
    11: "INITIALIZING_BIASES", 12: "MOTION_DETECT", 14: "WAITING_ALIGNMENTORIENTATION",
}
STATES = {"status": STATUS, "type": {
    52: "INS_SBAS", 53: "INS_PSRSP", 54: "INS_PSRDIFF", 55: "INS_RTKFLOAT", 56: "INS_RTKFIXED", 68: "PPP_CONVERGING",
    69: "PPP", 73: "INS_PPP_CONVERGING", 74: "INS_PPP",
}}  # what is told of each record: the filter's state, and in INSPVAX the kind of position
_POSE = [("roll", "<f8"), ("pitch", "<f8"), ("azimuth", "<f8")]
_PLACE = [("latitude", "<f8"), ("longitude", "<f8"), ("height", "<f8")]
PVA = [("week", "<u4"), ("seconds", "<f8"), *_PLACE, ("velocity", "<f8", 3), *_POSE, ("status", "<u4")]
PVAX = [
    ("status", "<u4"), ("type", "<u4"), *_PLACE, ("undulation", "<f4"), ("velocity", "<f8", 3), *_POSE,
    ("sigmas", "<f4", 9), ("extended", "<u4"), ("since_update", "<u2"),
]
STDEV = [("sigmas", "<f4", 9), ("extended", "<u4"), ("since_update", "<u2"), ("reserved", "V10")]
_LONG = [("sync", "V14"), ("header_week", "<u2"), ("header_ms", "<u4"), ("rest", "V8")]
_SHORT = [("sync", "V6"), ("header_week", "<u2"), ("header_ms", "<u4")]
RECORDS = {
    dtype.itemsize: dtype
    for dtype in (np.dtype([*head, *body, ("crc", "<u4")]) for head in (_LONG, _SHORT) for body in (PVA, PVAX, STDEV))
}
TOLD = dict(zip(SIGMA_COLUMNS[1:], (0, 1, 2, 6, 7, 8), strict=True))  # places among the nine
ANGLES = ("latitude", "longitude", "roll", "pitch", "azimuth")
BLOCK = 32_768  # the decoder's buffer is 262,144 bytes
RECORDS_PER_CHUNK = 65_536
MAX_RESUMES = 100  # looks behind false starts at the end of a file; each costs a pass over at most the decoder's buffer
# Two decoders at work in two threads lose a record now and then. A whole file is taken at once (its records become a
# table in memory anyway), so that nobody can hold the lock while waiting for something else.
_DECODER = threading.Lock()
_START = re.compile(rb"\xaa\x44[\x12\x13]|[#%][A-Z]")
_PROMPT = re.compile(rb"[\s\[\]A-Z0-9]{0,24}")  # what a receiver's port says between records, such as [COM1]


@dataclass(frozen=True)
class NovatelPart:
    """One log file."""

    path: Path
    name: str
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        with _DECODER:
            found = list(self._decode())
        yield from found

    def _decode(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        with opened(self.path, self.name) as file:
            number, telling = _survey(file, dropped)
            order = Order(self.name)
            if number is not None:
                for records in _records(file, number):
                    yield _chunk(records, order, self.latency_s, dropped, telling == number)
            if number is not None and telling is not None and telling != number:
                for records in _records(file, telling):
                    sigmas = _sigmas(records, self.latency_s, dropped)
                    yield chunk({name: np.empty(0) for name in INS_COLUMNS}, INS_COLUMNS, dropped, sigmas)
            if dropped:
                yield no_rows(INS_COLUMNS, dropped)
            order.check()


def _blocks(file: BinaryIO) -> Iterator[bytes]:
    """The file in blocks the decoder can take; in ASCII logs lines end as it wants them, by CR LF."""
    first = file.read(BLOCK)
    if not first.isascii() or b"\0" in first:
        yield first
        while block := file.read(BLOCK):
            yield block
        return
    block, held = first, b""
    while block:
        block = held + block
        held = block[-1:] if block.endswith(b"\r") else b""
        yield block[: len(block) - len(held)].replace(b"\r\n", b"\n").replace(b"\n", b"\r\n")
        block = file.read(BLOCK)
    yield held + b"\r\n"


def _fed(parser: Any, file: BinaryIO, dropped: Counter[str]) -> Iterator[None]:
    """Feeds the file to a decoder, and yields whenever it may have something to give.

    At the end it may hold bytes back for a message of which only the start came. There may be whole ones behind that.
    """
    for block in _blocks(file):
        parser.write(block)
        yield
    rest = bytes(parser.flush(True))
    dropped["truncated message"] += bool(rest.strip())
    for _ in range(MAX_RESUMES):
        starts = [found.start() for found in islice(_START.finditer(rest), 2)]
        if len(starts) < 2:
            return
        parser.write(rest[starts[1] :])
        yield
        rest = bytes(parser.flush(True))


def _survey(file: BinaryIO, dropped: Counter[str]) -> tuple[int | None, int | None]:
    """Which record to use, by its number, and which for the sigmas; the others, and what is no record at all, are
    counted."""
    from novatel_edie.oem import Parser

    parser, total = Parser(), Counter[str]()
    names: dict[type, str] = {}
    for _ in _fed(parser, file, dropped):
        for message in parser:
            kind = type(message)
            if kind not in names:
                names[kind] = kind.__name__.partition("_")[0]
            total[names[kind]] += 1
            if names[kind] == "UnknownBytes" and _PROMPT.fullmatch(message.data) is None:
                starts = sum(1 for _ in _START.finditer(message.data))
                text = not starts and message.data.isascii() and b"\0" not in message.data
                dropped["text between records" if text else "undecodable bytes"] += max(starts, 1)
    there = [number for number, name in NAMES.items() if total[name]]
    if not there:
        dropped["message other than INSPVA, INSPVAS, INSPVAX"] += total.total() - total["UnknownBytes"]
        return None, None
    chosen = there[0] if len(there) == 1 else _best(file, there)
    for number in there:
        if number != chosen:
            dropped[f"{NAMES[number]} beside {NAMES[chosen]}"] += total[NAMES[number]]
    return chosen, next((number for number, name in SIGMAS.items() if total[name]), None)


def _best(file: BinaryIO, numbers: list[int]) -> int:
    """The kind with the most usable records; INSPVAX must have more than twice as many. Equal: the first."""
    usable = {
        number: sum(int(np.isin(records["status"], USABLE).sum()) for records in _records(file, number))
        for number in numbers
    }
    return max(numbers, key=lambda number: usable[number] * (1 if NAMES[number] == "INSPVAX" else 2))


def _records(file: BinaryIO, number: int) -> Iterator[np.ndarray[Any, Any]]:
    """Records of one kind as arrays, in the order of the file."""
    from novatel_edie import ENCODE_FORMAT
    from novatel_edie.oem import Filter, Parser

    file.seek(0)
    parser, wanted = Parser(), Filter()
    wanted.add_message_id(number)
    parser.filter = wanted
    waiting: list[bytes] = []
    for _ in _fed(parser, file, Counter()):
        waiting += [record.message for record in parser.iter_convert(ENCODE_FORMAT.BINARY)]
        if len(waiting) >= RECORDS_PER_CHUNK:
            yield from _arrays(waiting)
            waiting = []
    yield from _arrays(waiting)


def _arrays(records: list[bytes]) -> Iterator[np.ndarray[Any, Any]]:
    for size, alike in groupby(records, key=len):
        if size in RECORDS:
            yield np.frombuffer(b"".join(alike), RECORDS[size])


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(
    records: np.ndarray[Any, Any], order: Order, latency_s: float, dropped: Counter[str], telling: bool
) -> Chunk:
    """Poses, and, where these records are those ``telling`` them, the sigmas."""
    bad = ~np.isin(records["status"], USABLE)
    for status, count in zip(*np.unique(records["status"][bad], return_counts=True), strict=True):
        dropped[f"ins status {STATUS.get(int(status), int(status))}"] += int(count)
    records = records[~bad]
    names = records.dtype.names or ()
    own_time = "week" in names
    undulation = records["undulation"] if "undulation" in names else 0.0
    sieve = Sieve(
        {
            "week": records["week" if own_time else "header_week"].astype(np.int64),
            "seconds": records["seconds"].astype(float) if own_time else records["header_ms"] / 1000.0,
            "height_m": records["height"] + undulation,
            **{f"{name}_rad": np.radians(records[name]) for name in ANGLES},
            **{name: records[name].astype(np.uint8) for name in STATES if name in names},
        },
        dropped,
    )
    keep_possible_poses(sieve)
    sieve.keep(possible_week_time(sieve["week"], sieve["seconds"]), "impossible time")
    t_ns = gps_ns_from_week_seconds(sieve["week"], sieve["seconds"])
    sieve.columns["t_ns"] = t_ns - latency_ns(latency_s)
    order.keep(sieve)
    sigmas = _sigmas(records, latency_s, dropped) if telling else {}
    told = {name: sieve[name] for name in STATES if name in names}
    return replace(chunk(sieve.columns, INS_COLUMNS, dropped, sigmas), states=told)


@np.errstate(all="ignore")
def _sigmas(records: np.ndarray[Any, Any], latency_s: float, dropped: Counter[str]) -> dict[str, np.ndarray[Any, Any]]:
    if "status" in (records.dtype.names or ()):
        records = records[np.isin(records["status"], USABLE)]
    week, seconds = records["header_week"].astype(np.int64), records["header_ms"] / 1000.0
    good = possible_week_time(week, seconds)
    dropped["accuracy at an impossible time"] += int(np.count_nonzero(~good))
    t_ns = gps_ns_from_week_seconds(week[good], seconds[good]) - latency_ns(latency_s)
    told = records["sigmas"][good].T
    return sigma_rows(t_ns, {name: told[place] for name, place in TOLD.items()}, dropped)
