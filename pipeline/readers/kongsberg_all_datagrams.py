"""Find the datagrams of Kongsberg's .all files (little-endian; some old files are big-endian, and are not read).

A datagram consists of u32 length of the bytes that follow, the start byte STX (2), u8 type, u16 model, u32 date (year
month day), u32 milliseconds of the day, u16 number, u16 serial number, its body, the end byte ETX (3), and u16 sum of
the bytes between STX and ETX. Where no datagram begins, the reader searches for the next whole one, and counts the gap.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

from pipeline.readers.raw_file import read_at, size_of

ALL_HEAD = struct.Struct("<IBBHIIHH")  # with the length
HEAD_WITHOUT_LENGTH = struct.Struct("<BBHIIHH")
STX, ETX = 2, 3
TAIL = 3  # bytes of ETX and the sum
_MAX_DATAGRAM = 1 << 20
_SEARCH_BLOCK = 1 << 16
DATAGRAM_TYPES = frozenset(b"0123ACDEFGHIJKLMNOPQRSTUVWXYabcdfhijklmnprsv")  # of all sonar models


def kongsberg_all_datagrams(file: BinaryIO, types: bytes, dropped: Counter[str]) -> Iterator[bytes]:
    """Yield the whole datagrams of the ``types``, one after another, from STX on (without the length)."""
    size, position = size_of(file), 0
    while position < size:
        head = read_at(file, position, ALL_HEAD.size)
        length = _whole_length(file, position, head, size)
        if length is None:
            cut = is_datagram_header(head) and position + 4 + int.from_bytes(head[:4], "little") > size
            dropped["truncated datagram" if cut else "stray bytes"] += 1
            position = _next_start(file, position + 1, size)
            continue
        if head[5] in types:
            datagram = read_at(file, position + 4, length)
            if sum(datagram[1:-TAIL]) & 0xFFFF == int.from_bytes(datagram[-2:], "little"):
                yield datagram
            else:
                dropped["damaged datagram"] += 1
        position += 4 + length


def is_datagram_header(head: bytes, order: str = "<") -> bool:
    """Return whether ``head`` begins with the header of a datagram; ``order``: byte order, as in :mod:`struct`."""
    if len(head) < ALL_HEAD.size:
        return False
    length, begin, kind, _, date, milliseconds, _, _ = struct.unpack(order + ALL_HEAD.format[1:], head[: ALL_HEAD.size])
    dated = 19_900_000 < date < 21_000_000 and milliseconds < 86_400_000
    return begin == STX and kind in DATAGRAM_TYPES and ALL_HEAD.size <= length <= _MAX_DATAGRAM and dated


def _whole_length(file: BinaryIO, position: int, head: bytes, size: int) -> int | None:
    """Return the length of the datagram with this head at ``position``; None if it is damaged or cut off."""
    length = int.from_bytes(head[:4], "little")
    if not is_datagram_header(head) or position + 4 + length > size:
        return None
    return length if read_at(file, position + 4 + length - TAIL, 1) == bytes([ETX]) else None


def _next_start(file: BinaryIO, start: int, size: int) -> int:
    """Return the byte at which the next whole datagram begins; the file's size if there is none."""
    while start < size:
        block = read_at(file, start, _SEARCH_BLOCK + ALL_HEAD.size)
        mark = block.find(STX, 4)
        while 0 <= mark < _SEARCH_BLOCK + 4:
            head = block[mark - 4 : mark - 4 + ALL_HEAD.size]
            if _whole_length(file, start + mark - 4, head, size) is not None:
                return start + mark - 4
            mark = block.find(STX, mark + 1)
        start += _SEARCH_BLOCK
    return size
