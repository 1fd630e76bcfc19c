"""Read NovAtel OEM/SPAN logs as arrays of records, and choose the kinds of records to use.

NovAtel's own decoder (novatel_edie) finds the records in a file, and turns each into its binary form, those in ASCII
too. The layouts below are those of the OEM7 Commands and Logs Reference Manual (INSPVA 507, INSPVAS 508, INSPVAX 1465,
INSSTDEV 2051, INSSTDEVS 2052). The binary header has 28 bytes and begins with the sync bytes 0xAA4412. The short header
has 12 bytes and begins with 0xAA4413. Then come the body, and a CRC of 4 bytes.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, islice
from typing import Any, BinaryIO

import numpy as np

Records = np.ndarray[Any, Any]  # structured, of one layout
_POSE_LOGS = {507: "INSPVA", 508: "INSPVAS", 1465: "INSPVAX"}
_SIGMA_LOGS = {2051: "INSSTDEV", 2052: "INSSTDEVS", 1465: "INSPVAX"}  # by precedence
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
USABLE = (3, 6, 7)  # INS_SOLUTION_GOOD, INS_SOLUTION_FREE, INS_ALIGNMENT_COMPLETE
_LAYOUTS = {  # by their size in bytes
    dtype.itemsize: dtype
    for dtype in (np.dtype([*head, *body, ("crc", "<u4")]) for head in (_LONG, _SHORT) for body in (PVA, PVAX, STDEV))
}
_BLOCK = 32_768  # the decoder's buffer is 262,144 bytes
RECORDS_PER_CHUNK = 65_536
MAX_RESUMES = 100  # restarts after false starts at a file's end; each reads the decoder's buffer at most once
_START = re.compile(rb"\xaa\x44[\x12\x13]|[#%][A-Z]")
_PROMPT = re.compile(rb"[\s\[\]A-Z0-9]{0,24}")  # a receiver's port prompt between records, such as [COM1]


@dataclass(frozen=True)
class RecordKinds:
    """Message numbers of the records to use; None: the file has none."""

    poses: int | None
    sigmas: int | None


def _blocks(file: BinaryIO) -> Iterator[bytes]:
    """Yield the file in blocks that fit the decoder's buffer; end lines of ASCII logs with CR LF for the decoder."""
    first = file.read(_BLOCK)
    if not first.isascii() or b"\0" in first:
        yield first
        while block := file.read(_BLOCK):
            yield block
        return
    block, rest = first, b""
    while block:
        block = rest + block
        rest = block[-1:] if block.endswith(b"\r") else b""
        yield block[: len(block) - len(rest)].replace(b"\r\n", b"\n").replace(b"\n", b"\r\n")
        block = file.read(_BLOCK)
    yield rest + b"\r\n"


def _feed(parser: Any, file: BinaryIO, dropped: Counter[str]) -> Iterator[None]:
    """Feed the file to a decoder, and yield whenever it may have records.

    At the end the decoder may keep back the start of an incomplete message, and with it whole messages after that
    start. The kept bytes are then fed again from the next start on.
    """
    for block in _blocks(file):
        parser.write(block)
        yield
    rest = bytes(parser.flush(True))
    dropped["truncated message"] += bool(rest.strip())
    for _ in range(MAX_RESUMES):
        starts = [match.start() for match in islice(_START.finditer(rest), 2)]
        if len(starts) < 2:
            return
        parser.write(rest[starts[1] :])
        yield
        rest = bytes(parser.flush(True))


def choose_records(file: BinaryIO, dropped: Counter[str]) -> RecordKinds:
    """Choose the records to use for poses and for sigmas.

    Parameters
    ----------
    file : BinaryIO
        The log; read as a whole.
    dropped : Counter
        Counts by reason, changed in place: pose records of the kinds that are not used, and bytes that are no record;
        in a file without pose records all its messages.
    """
    from novatel_edie.oem import Parser

    parser, total = Parser(), Counter[str]()
    names: dict[type, str] = {}
    for _ in _feed(parser, file, dropped):
        for message in parser:
            kind = type(message)
            if kind not in names:
                names[kind] = kind.__name__.partition("_")[0]
            total[names[kind]] += 1
            if names[kind] == "UnknownBytes" and _PROMPT.fullmatch(message.data) is None:
                starts = sum(1 for _ in _START.finditer(message.data))
                text = not starts and message.data.isascii() and b"\0" not in message.data
                dropped["text between records" if text else "undecodable bytes"] += max(starts, 1)
    present = [number for number, name in _POSE_LOGS.items() if total[name]]
    if not present:
        dropped["message other than INSPVA, INSPVAS, INSPVAX"] += total.total() - total["UnknownBytes"]
        return RecordKinds(None, None)
    chosen = present[0] if len(present) == 1 else _most_usable(file, present)
    for number in present:
        if number != chosen:
            dropped[f"{_POSE_LOGS[number]} beside {_POSE_LOGS[chosen]}"] += total[_POSE_LOGS[number]]
    return RecordKinds(chosen, next((number for number, name in _SIGMA_LOGS.items() if total[name]), None))


def _most_usable(file: BinaryIO, numbers: list[int]) -> int:
    """Return the number with the most usable records (INSPVAX needs more than twice as many); if equal the first."""
    usable = {
        number: sum(int(np.isin(records["status"], USABLE).sum()) for records in read_records(file, number))
        for number in numbers
    }
    return max(numbers, key=lambda number: usable[number] * (1 if _POSE_LOGS[number] == "INSPVAX" else 2))


def read_records(file: BinaryIO, number: int) -> Iterator[Records]:
    """Yield the records of one message number as structured arrays, in the order of the file."""
    from novatel_edie import ENCODE_FORMAT
    from novatel_edie.oem import Filter, Parser

    file.seek(0)
    parser, wanted = Parser(), Filter()
    wanted.add_message_id(number)
    parser.filter = wanted
    messages: list[bytes] = []
    for _ in _feed(parser, file, Counter()):
        messages += [record.message for record in parser.iter_convert(ENCODE_FORMAT.BINARY)]
        if len(messages) >= RECORDS_PER_CHUNK:
            yield from _arrays(messages)
            messages = []
    yield from _arrays(messages)


def _arrays(messages: list[bytes]) -> Iterator[Records]:
    for size, group in groupby(messages, key=len):
        if size in _LAYOUTS:
            yield np.frombuffer(b"".join(group), _LAYOUTS[size])
