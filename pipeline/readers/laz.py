"""LAZ: the largest number of points that a file's tables allow, and its points, unpacked by ``laz_worker``.

The layout is that of the LASzip specification, little-endian. Offsets in the LASzip record (user "laszip encoded",
number 22204): 12 u32 points per chunk, 32 u16 number of items. Then come u16 type, u16 size, u16 version of each item.
The point data begin with i64 byte at which the table of chunks begins (u32 version, u32 number of chunks, ...). Then
come the chunks. Each chunk begins with its first point in the form of LAS: i32 x, y, z, as multiples of the scales from
the offsets in the header (131 f64 x 3 and 155 f64 x 3), and f64 GPS time.
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.decoder_process import REMEDY, decoded_records
from pipeline.readers.raw_file import opened, read_at

Array = NDArray[np.float64]
Rows = NDArray[np.int64] | slice
LAZ_WORKER = Path(__file__).with_name("laz_worker.py")
VLR_HEAD = 54
TIME_AT = {**dict.fromkeys((1, 3, 4, 5), 20), **dict.fromkeys((6, 7, 8, 9, 10), 22)}  # byte in a point, by its format
_VARIABLE = 0xFFFFFFFF  # points per chunk if the chunks have different lengths
MAX_POINTS_PER_BYTE = 1024  # LASzip reaches this if all points are the same
MAX_CHUNK_POINTS = 10_000_000  # LASzip's own is 50,000


@dataclass(frozen=True)
class LazTables:
    """Places of a LAZ file's tables, from its LAS header, and the file's size."""

    records: int  # number of variable-length records after the header
    header_size: int  # bytes
    offset: int  # byte at which the points begin
    size: int  # of the file, bytes


def max_point_count(file: BinaryIO, name: str, tables: LazTables) -> int:
    """Return the largest number of points that the chunks can hold.

    Parameters
    ----------
    file : BinaryIO
        The LAZ file.
    name : str
        Its path in the session folder, for messages.
    tables : LazTables
        Places of its tables.

    Raises
    ------
    RawDataError
        The tables contradict the file, which is cut off or damaged.
    """
    chunk_points = _chunk_points(file, tables)
    offset, size = tables.offset, tables.size
    if chunk_points is None:
        raise RawDataError(f"{name}: its LASzip record is missing or damaged; {REMEDY}")
    (table,) = struct.unpack("<q", read_at(file, offset, 8).ljust(8, b"\0"))
    if not offset + 8 <= table <= size - 8:
        raise RawDataError(f"{name}: is cut off: its table of LAZ chunks should be at byte {table} of {size}; {REMEDY}")
    (chunks,) = struct.unpack("<4xI", read_at(file, table, 8))
    if chunks > table - offset:
        raise RawDataError(f"{name}: its chunk table is damaged ({chunks} chunks in {size} bytes); {REMEDY}")
    return min(int(chunks) * chunk_points, size * MAX_POINTS_PER_BYTE)


def _chunk_points(file: BinaryIO, tables: LazTables) -> int | None:
    """Return the number of points per chunk from the LASzip record; None if the record is missing or damaged."""
    at, length = _laszip_record(file, tables.header_size, tables.records)
    if not length:
        return None
    (points,) = struct.unpack("<I", read_at(file, at + 12, 4))
    return int(points) if 0 < points <= MAX_CHUNK_POINTS or points == _VARIABLE else None


def _laszip_record(file: BinaryIO, start: int, records: int) -> tuple[int, int]:
    """Return the byte at which the LASzip record begins, behind its head, and its length; 0, 0: there is none.

    Parameters
    ----------
    file : BinaryIO
        The LAZ file.
    start, records : int
        The byte at which the variable-length records begin, and their number.
    """
    for _ in range(min(records, 65_536)):
        head = read_at(file, start, VLR_HEAD + 16)
        if len(head) < VLR_HEAD + 16:
            break
        number, length = struct.unpack_from("<HH", head, 18)
        if head[2:18].rstrip(b"\0") == b"laszip encoded" and number == 22204 and length >= 34:
            return start + VLR_HEAD, length
        start += VLR_HEAD + length
    return 0, 0


@dataclass(frozen=True)
class DecodedPoints:
    """A batch of points: times_s (n,), 0 without a GPS time; places: a function that returns x, y, z of chosen rows.

    Places are converted when they are asked for, because a sample needs few of them.
    """

    times_s: Array
    places: Callable[[Rows], tuple[Array, ...]]


def decompressed_points(path: Path, name: str, start: int, stop: int, batch: int) -> Iterator[DecodedPoints]:
    """Yield points ``start`` to ``stop``, batch by batch.

    Parameters
    ----------
    path : Path
        The LAZ file, whose header has been checked.
    name : str
        Its path in the session folder, for messages.
    start, stop : int
        Numbers of the first point, and of the one after the last.
    batch : int
        Largest number of points in a batch.

    Raises
    ------
    RawDataError
        The file is damaged.
    """
    with opened(path, name) as file:
        head = read_at(file, 0, 227)
        header_size, points, records, point_format, size = struct.unpack_from("<HIIBH", head, 94)
        record, length = _laszip_record(file, header_size, records)
    scales, offsets = struct.unpack_from("<3d", head, 131), struct.unpack_from("<3d", head, 155)
    fields: dict[str, tuple[str, int]] = {"x": ("<i4", 0), "y": ("<i4", 4), "z": ("<i4", 8)}
    if point_format & 0x3F in TIME_AT:
        fields["time"] = "<f8", TIME_AT[point_format & 0x3F]
    formats, places = zip(*fields.values(), strict=True)
    layout = np.dtype({"names": list(fields), "formats": formats, "offsets": places, "itemsize": size})
    numbers = [str(number) for number in (start, stop, batch, size, points, record, length)]
    for data in decoded_records(LAZ_WORKER, [str(path), *numbers], name, size, batch):
        points = np.frombuffer(data, layout)
        times_s = points["time"].astype(np.float64) if "time" in fields else np.zeros(len(points))
        yield DecodedPoints(times_s, partial(_places, points, scales, offsets))


def _places(points: NDArray[Any], scales: Sequence[float], offsets: Sequence[float], rows: Rows) -> tuple[Array, ...]:
    if not isinstance(rows, slice):  # whole points are gathered, as bytes: field by field takes three times as long
        points, rows = np.take(points.view(f"V{points.itemsize}"), rows).view(points.dtype), slice(None)
    axes = zip("xyz", scales, offsets, strict=True)
    return tuple(points[axis][rows] * scale + offset for axis, scale, offset in axes)
