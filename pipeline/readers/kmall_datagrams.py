"""Find the #MRZ and #IIP datagrams of Kongsberg's .kmall files (little-endian).

A datagram consists of u32 length, '#' and three letters, u8 version, u8 system, u16 sonar, u32 Unix seconds (UTC), u32
nanoseconds, its body, and u32 length again. Where the two lengths differ, or no datagram begins, the reader searches
for the next whole datagram, and counts the gap.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

from pipeline.readers.raw_file import read_at, size_of

KMALL_HEAD = struct.Struct("<I4s2BH2I")
KMALL_LENGTH = struct.Struct("<I")
_MIN_DATAGRAM, _MAX_DATAGRAM = KMALL_HEAD.size + KMALL_LENGTH.size, 1 << 24
_SEARCH_BLOCK = 1 << 16
MRZ, IIP = b"#MRZ", b"#IIP"  # soundings; the installation


def kmall_datagrams(file: BinaryIO, dropped: Counter[str]) -> Iterator[bytes]:
    """Yield the whole #MRZ and #IIP datagrams of a file, one after another."""
    size, position = size_of(file), 0
    while position < size:
        length = _length_at(file, position, size)
        if length is None:
            dropped["truncated datagram" if _cut_off(file, position, size) else "stray bytes"] += 1
            position = _next_start(file, position + 1, size)
            continue
        if read_at(file, position + 4, 4) in (MRZ, IIP):
            yield read_at(file, position, length)
        position += length


def _length_at(file: BinaryIO, position: int, size: int) -> int | None:
    """Return the length of the datagram at ``position``; None if none begins there, or if it is cut off or damaged."""
    head = read_at(file, position, 8)
    length = int.from_bytes(head[:4], "little")
    if not _is_head(head) or position + length > size:
        return None
    return length if read_at(file, position + length - 4, 4) == head[:4] else None


def _is_head(head: bytes) -> bool:
    letters = head[5:8]
    plausible = len(head) == 8 and head[4:5] == b"#" and letters.isalnum() and letters.isupper()
    return plausible and _MIN_DATAGRAM <= int.from_bytes(head[:4], "little") <= _MAX_DATAGRAM


def _cut_off(file: BinaryIO, position: int, size: int) -> bool:
    head = read_at(file, position, 8)
    return _is_head(head) and position + int.from_bytes(head[:4], "little") > size


def _next_start(file: BinaryIO, start: int, size: int) -> int:
    """Return the byte at which the next whole datagram begins; the file's size if there is none."""
    while start < size:
        block = read_at(file, start, _SEARCH_BLOCK + 8)
        mark = block.find(b"#", 4)
        while 0 <= mark < _SEARCH_BLOCK + 4:
            if _length_at(file, start + mark - 4, size) is not None:
                return start + mark - 4
            mark = block.find(b"#", mark + 1)
        start += _SEARCH_BLOCK
    return size
