"""LAZ: what a file's own tables promise, and its points by way of a process of their own (:mod:`laz_worker`).

LASzip specification; all little-endian. The LASzip record (user "laszip encoded", number 22204): 12 u32 points a chunk,
32 u16 items, then each item u16 type, u16 size, u16 version. At the start of the points: i64 where the table of chunks
is (u32 version, u32 chunks, ...), then the chunks, each beginning with its first point as it is in LAS.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from pipeline.errors import RawDataError
from pipeline.readers.decoder_process import ADVICE, Numbers, batches
from pipeline.readers.raw_file import read_at

WORKER = Path(__file__).with_name("laz_worker.py")
VLR_HEAD = 54
VARIABLE = 0xFFFFFFFF
MAX_POINTS_PER_BYTE = 1024  # what LASzip makes of points that are all the same
MAX_CHUNK_POINTS = 10_000_000  # LASzip's own is 50,000


def points_at_most(file: BinaryIO, name: str, records: int, header_size: int, offset: int, size: int) -> int:
    """How many points the chunks can hold at most.

    Raises
    ------
    RawDataError
        The tables contradict the file, which is cut off or damaged.
    """
    chunk_points = _chunk_points(file, records, header_size)
    if chunk_points is None:
        raise RawDataError(f"{name}: its LASzip record is missing or damaged; {ADVICE}")
    (table,) = struct.unpack("<q", read_at(file, offset, 8).ljust(8, b"\0"))
    if not offset + 8 <= table <= size - 8:
        raise RawDataError(f"{name}: is cut off: its table of LAZ chunks should be at byte {table} of {size}; {ADVICE}")
    (chunks,) = struct.unpack("<4xI", read_at(file, table, 8))
    if chunks > table - offset:
        raise RawDataError(f"{name}: its chunk table is damaged ({chunks} chunks in {size} bytes); {ADVICE}")
    return min(int(chunks) * chunk_points, size * MAX_POINTS_PER_BYTE)


def _chunk_points(file: BinaryIO, records: int, header_size: int) -> int | None:
    """Points a chunk, from the LASzip record."""
    start = header_size
    for _ in range(min(records, 65_536)):
        head = read_at(file, start, VLR_HEAD + 16)
        if len(head) < VLR_HEAD + 16:
            return None
        number, length = struct.unpack_from("<HH", head, 18)
        if head[2:18].rstrip(b"\0") == b"laszip encoded" and number == 22204 and length >= 34:
            (points,) = struct.unpack_from("<I", head, VLR_HEAD + 12)
            return int(points) if 0 < points <= MAX_CHUNK_POINTS or points == VARIABLE else None
        start += VLR_HEAD + length
    return None


def unpack(path: Path, name: str, start: int, stop: int, batch: int) -> Iterator[Numbers]:
    """GPS time, x, y, z of points ``start`` to ``stop``, batch by batch; fewer where the file ends before.

    Raises
    ------
    RawDataError
        The file is damaged.
    """
    return batches(WORKER, [str(path), str(start), str(stop), str(batch)], name, 4, batch)
