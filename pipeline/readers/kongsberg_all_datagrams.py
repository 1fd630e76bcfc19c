"""Where the datagrams of Kongsberg's .all files lie (little-endian; old ones of other computers are big-endian).

A datagram: u32 length of what follows, 2, u8 type, u16 model, u32 date (year month day), u32 milliseconds of the day,
u16 number, u16 serial number, its body, 3, u16 sum of the bytes between 2 and 3. Where none begins the next whole one
is searched, and that is counted.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

from pipeline.readers.raw_file import read_at, size_of

HEAD = struct.Struct("<IBBHIIHH")  # with the length
INNER = struct.Struct("<BBHIIHH")  # without
BEGIN, END = 2, 3
TAIL = 3  # bytes of the end and the sum
LARGEST = 1 << 20
BLOCK = 1 << 16
TYPES = frozenset(b"0123ACDEFGHIJKLMNOPQRSTUVWXYabcdfhijklmnprsv")  # of the datagrams of all models


def datagrams(file: BinaryIO, wanted: bytes, dropped: Counter[str]) -> Iterator[bytes]:
    """The whole datagrams of the ``wanted`` types, one after another, without their length."""
    size, position = size_of(file), 0
    while position < size:
        head = read_at(file, position, HEAD.size)
        length = _length(file, position, head, size)
        if length is None:
            cut = is_head(head) and position + 4 + int.from_bytes(head[:4], "little") > size
            dropped["truncated datagram" if cut else "stray bytes"] += 1
            position = _next_start(file, position + 1, size)
            continue
        if head[5] in wanted:
            datagram = read_at(file, position + 4, length)
            if sum(datagram[1:-TAIL]) & 0xFFFF == int.from_bytes(datagram[-2:], "little"):
                yield datagram
            else:
                dropped["damaged datagram"] += 1
        position += 4 + length


def is_head(head: bytes, order: str = "<") -> bool:
    """Whether a datagram begins here."""
    if len(head) < HEAD.size:
        return False
    length, begin, kind, _, date, milliseconds, _, _ = struct.unpack(order + HEAD.format[1:], head[: HEAD.size])
    dated = 19_900_000 < date < 21_000_000 and milliseconds < 86_400_000
    return begin == BEGIN and kind in TYPES and HEAD.size <= length <= LARGEST and dated


def _length(file: BinaryIO, position: int, head: bytes, size: int) -> int | None:
    length = int.from_bytes(head[:4], "little")
    if not is_head(head) or position + 4 + length > size:
        return None
    return length if read_at(file, position + 4 + length - TAIL, 1) == bytes([END]) else None


def _next_start(file: BinaryIO, start: int, size: int) -> int:
    """Where the next whole datagram begins, or the file's end."""
    while start < size:
        block = read_at(file, start, BLOCK + HEAD.size)
        found = block.find(BEGIN, 4)
        while 0 <= found < BLOCK + 4:
            head = block[found - 4 : found - 4 + HEAD.size]
            if _length(file, start + found - 4, head, size) is not None:
                return start + found - 4
            found = block.find(BEGIN, found + 1)
        start += BLOCK
    return size
