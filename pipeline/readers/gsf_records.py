"""Where headers, pings and profiles lie in GSF files (big-endian).

A record: u32 size, u32 of checksum flag (bit 31) and kind (bits 0 to 21), with the flag the u32 sum of the bytes, then
the bytes. Where none begins the next ping or profile is searched, and that is counted.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

from pipeline.readers.raw_file import read_at, size_of

HEAD = struct.Struct(">2I")
CHECKED, KIND = 1 << 31, (1 << 22) - 1
HEADER, PING, PROFILE, KINDS = 1, 2, 3, 12
LARGEST = 524_288
BLOCK = 1 << 16


def records(file: BinaryIO, dropped: Counter[str]) -> Iterator[tuple[int, bytes]]:
    """Headers, pings and profiles: kind and bytes."""
    size, position = size_of(file), 0
    while position < size:
        head = read_at(file, position, HEAD.size + 4)
        span = _span(head)
        if span is None or position + span[1] > size:
            cut = span is not None
            dropped["truncated record" if cut else "stray bytes"] += 1
            position = _next_start(file, position + 1, size)
            continue
        start, length = span
        (word,) = struct.unpack_from(">I", head, 4)
        if word & KIND in (HEADER, PING, PROFILE):
            body = read_at(file, position + start, length - start)
            if word & CHECKED and sum(body) & 0xFFFFFFFF != int.from_bytes(head[8:12], "big"):
                dropped["damaged record"] += 1
            else:
                yield word & KIND, body
        position += length


def _span(head: bytes) -> tuple[int, int] | None:
    """Where a record's bytes begin, and where they end, from its start; None where none begins."""
    if len(head) < HEAD.size:
        return None
    size, word = HEAD.unpack_from(head)
    start = HEAD.size + (4 if word & CHECKED else 0)
    return (start, start + size) if 0 < size <= LARGEST and 0 < word & KIND <= KINDS else None


def _next_start(file: BinaryIO, start: int, size: int) -> int:
    """Where the next ping or profile begins that another record or the end follows, or the file's end."""
    marks = [struct.pack(">I", flag | kind) for kind in (PING, PROFILE) for flag in (0, CHECKED)]
    while start < size:
        block = read_at(file, start, BLOCK + 8)
        found = {at for mark in marks for at in _all_of(block, mark) if 4 <= at < BLOCK + 4}
        for at in sorted(found):
            if _is_record(file, start + at - 4, size):
                return start + at - 4
        start += BLOCK
    return size


def _all_of(block: bytes, mark: bytes) -> Iterator[int]:
    at = block.find(mark)
    while at >= 0:
        yield at
        at = block.find(mark, at + 1)


def _is_record(file: BinaryIO, position: int, size: int) -> bool:
    span = _span(read_at(file, position, HEAD.size))
    if span is None or position + span[1] > size:
        return False
    following = position + span[1]
    return following == size or _span(read_at(file, following, HEAD.size)) is not None
