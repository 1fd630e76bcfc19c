"""Find R2Sonic's BTH0 packets in a file of bare packets, a HYPACK .R2S file or an XTF file.

:mod:`pipeline.readers.r2sonic` decodes the packets.

Bare packets follow one another. Each begins with its name and its size (u32, big-endian). In HYPACK .R2S the size also
stands before each packet (u32, little-endian). Other packets of the sonar (snippets, water column, ...) have the same
header, and are skipped.

XTF (Triton, "XTF File Format", rev. 40; little-endian) begins with a file header of 1024 bytes (or a multiple). Then
come records: u16 0xFACE, u8 type, u8, u16, 2 x u16, u32 length of the whole record. R2Sonic's packets are in records of
type 65 (QINSy) and 68 (Triton), after a ping header. The functions do not rely on the length of the ping header, but
search for the packet's name. They use no library for XTF: the existing one unpickles an index file that lies beside the
data, and never returns from a record of length 0. It is not safe for files of unknown origin.

If the next packet or record does not begin at its place, the functions search for its mark, and count the gap.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

from pipeline.readers.raw_file import find, read_at, size_of

BTH0 = b"BTH0"
OTHER_PACKETS = (b"SNI0", b"WCD0", b"AID0", b"TPX0", b"TPX1", b"STH0")
MIN_PACKET, MAX_PACKET = 12, 65_535  # the sonar sends each as one UDP datagram
SECTION = struct.Struct(">2sH")
XTF_HEADER, XTF_MAGIC, XTF_RECORD = 1024, b"\xce\xfa", 14
XTF_TYPES = (65, 68)
XTF_MAX = 1 << 24
Sections = dict[bytes, bytes]


def packet_size(head: bytes) -> int | None:
    """Return the packet size in a packet's first eight bytes; None if they are not the beginning of a packet."""
    size = int.from_bytes(head[4:8], "big")
    return size if len(head) >= 8 and head[:4] in (BTH0, *OTHER_PACKETS) and MIN_PACKET <= size <= MAX_PACKET else None


def sections_of(packet: bytes) -> Sections | None:
    """Return a packet's sections by name, with their heads; None if a section's size does not fit the packet."""
    sections: Sections = {}
    offset = MIN_PACKET
    while offset + SECTION.size <= len(packet):
        name, size = SECTION.unpack_from(packet, offset)
        if size < SECTION.size or offset + size > len(packet):
            return None
        sections.setdefault(name, packet[offset : offset + size])
        offset += size
    return sections


def bare_packets(file: BinaryIO, dropped: Counter[str]) -> Iterator[Sections]:
    """Yield the sections of each BTH0 packet in a file of bare packets, with or without HYPACK's size before each."""
    size, position = size_of(file), 0
    while position < size:
        head = read_at(file, position, 12)
        prefix = 4 if _prefixed(head) else 0
        start = position + prefix
        length = packet_size(head[prefix : prefix + 8])
        if length is not None and start + length <= size:
            is_bathymetry = head[prefix : prefix + 4] == BTH0
            sections = sections_of(read_at(file, start, length)) if is_bathymetry else {}
            if sections is not None:
                if sections:
                    yield sections
                position = start + length
                continue
            dropped["damaged packet"] += 1
        else:
            dropped["stray bytes" if length is None else "truncated packet"] += 1
        following = find(file, BTH0, start + 1)
        position = size if following < 0 else following


def _prefixed(head: bytes) -> bool:
    return len(head) == 12 and packet_size(head[4:]) == int.from_bytes(head[:4], "little")


def xtf_packets(file: BinaryIO, dropped: Counter[str]) -> Iterator[Sections]:
    """Yield the sections of each BTH0 packet in an XTF file; count the other records if the file has no packet."""
    size = size_of(file)
    position = find(file, XTF_MAGIC, XTF_HEADER)
    packets = other_records = 0
    while 0 <= position < size:
        head = read_at(file, position, XTF_RECORD)
        length = int.from_bytes(head[10:14], "little")
        whole = len(head) == XTF_RECORD and head[:2] == XTF_MAGIC and XTF_RECORD <= length <= XTF_MAX
        following = position + length if whole and position + length <= size else find(file, XTF_MAGIC, position + 2)
        broken = not whole or (following != position + length)
        if broken:
            dropped["truncated record" if following < 0 else "stray bytes"] += 1
        if whole and head[2] not in XTF_TYPES:
            other_records += 1
        elif whole and (not broken or following < 0):
            sections = _sections_in(read_at(file, position, length))
            if sections is not None:
                packets += 1
                yield sections
            elif not broken:
                dropped["damaged packet"] += 1
        position = following
    if not packets:
        dropped["XTF record other than R2Sonic bathymetry"] += other_records


def _sections_in(record: bytes) -> Sections | None:
    """Return the sections of the first whole BTH0 packet in a record; None without one."""
    start = record.find(BTH0)
    while start >= 0:
        length = packet_size(record[start : start + 8])
        if length is not None and start + length <= len(record):
            sections = sections_of(record[start : start + length])
            if sections is not None:
                return sections
        start = record.find(BTH0, start + 4)
    return None
