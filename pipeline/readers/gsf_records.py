"""Find the header, ping and profile records in GSF files (big-endian).

A record begins with u32 size, and u32 with a checksum flag (bit 31) and the kind (bits 0 to 21). If the flag is set,
the u32 sum of the contents' bytes follows. Then come the contents. Where no record begins, the reader searches for the
next ping or profile, and counts the gap.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

from pipeline.readers.raw_file import read_at, size_of

RECORD_HEAD = struct.Struct(">2I")
CHECKED, KIND = 1 << 31, (1 << 22) - 1
HEADER, PING, PROFILE, KINDS = 1, 2, 3, 12
_MAX_RECORD = 524_288
_SEARCH_BLOCK = 1 << 16


def gsf_records(file: BinaryIO, dropped: Counter[str]) -> Iterator[tuple[int, bytes]]:
    """Yield the kind and the contents of each header, ping and profile record."""
    size, position = size_of(file), 0
    while position < size:
        head = read_at(file, position, RECORD_HEAD.size + 4)
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
    """Return the bytes, from a record's start, at which its contents begin and end; None where no record begins."""
    if len(head) < RECORD_HEAD.size:
        return None
    size, word = RECORD_HEAD.unpack_from(head)
    start = RECORD_HEAD.size + (4 if word & CHECKED else 0)
    return (start, start + size) if 0 < size <= _MAX_RECORD and 0 < word & KIND <= KINDS else None


def _next_start(file: BinaryIO, start: int, size: int) -> int:
    """Return the byte at which the next whole ping or profile begins; the file's size if there is none.

    A record is whole if another record, or the end of the file, follows it.
    """
    marks = [struct.pack(">I", flag | kind) for kind in (PING, PROFILE) for flag in (0, CHECKED)]
    while start < size:
        block = read_at(file, start, _SEARCH_BLOCK + 8)
        candidates = {at for mark in marks for at in _positions_of(mark, block) if 4 <= at < _SEARCH_BLOCK + 4}
        for at in sorted(candidates):
            if _is_record(file, start + at - 4, size):
                return start + at - 4
        start += _SEARCH_BLOCK
    return size


def _positions_of(mark: bytes, block: bytes) -> Iterator[int]:
    at = block.find(mark)
    while at >= 0:
        yield at
        at = block.find(mark, at + 1)


def _is_record(file: BinaryIO, position: int, size: int) -> bool:
    span = _span(read_at(file, position, RECORD_HEAD.size))
    if span is None or position + span[1] > size:
        return False
    following = position + span[1]
    return following == size or _span(read_at(file, following, RECORD_HEAD.size)) is not None
