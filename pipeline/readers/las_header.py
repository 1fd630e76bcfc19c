"""Header of a LAS or LAZ file (ASPRS, "LAS Specification 1.4 R15"), checked against the file before laspy reads it.

A damaged header may claim billions of points or of variable-length records (VLRs). They must cost neither memory nor
time. Offsets in the header (little-endian): 6 u16 global encoding (bit 0: adjusted standard GPS time, else seconds of
week), 24 u8 x 2 version, 94 u16 header size, 96 u32 offset to points, 100 u32 number of VLRs, 104 u8 point format (bit
7: LAZ), 105 u16 record length, 107 u32 number of points, 131 f64 x 3 scales, 155 f64 x 3 offsets, 247 u64 number of
points (from version 1.4 on).
"""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.config.recording import LasTime
from pipeline.errors import RawDataError
from pipeline.readers.laz import TIME_AT, LazTables, max_point_count
from pipeline.readers.raw_file import opened, read_at, size_of

MAX_OFFSET = 1 << 26
_RECORD_LENGTHS = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)  # bytes at least, by point format


@dataclass(frozen=True)
class LasHeader:
    """A LAS header, checked against the file's size."""

    adjusted_time: bool
    declared_time: LasTime  # laser.time of session.yaml, which takes precedence over the flag
    compressed: bool
    size: int  # of the file, bytes
    claimed: int  # number of points by the header
    present: int  # the smaller of ``claimed`` and the number of points that the file can hold
    first_s: float  # GPS time of the first point
    scales: tuple[float, ...]


def read_header(path: Path, name: str, declared_time: LasTime = None, timed: bool = True) -> LasHeader:
    """Read and check a file's header.

    Parameters
    ----------
    path : Path
        The LAS or LAZ file.
    name : str
        Its path in the session folder, for messages.
    declared_time : LasTime
        ``laser.time`` of session.yaml; None: the header's flag decides.
    timed : bool
        Whether a point format without GPS time is refused.

    Raises
    ------
    RawDataError
        The header contradicts itself or the file, or its point format has no time.
    """
    with opened(path, name) as file:
        size = size_of(file)
        head = file.read(375).ljust(375, b"\0")
        encoding, major, minor = struct.unpack_from("<H16x2B", head, 6)
        header_size, offset, records, point_format, length, claimed = struct.unpack_from("<HIIBHI", head, 94)
        scales = struct.unpack_from("<3d", head, 131)
        if minor >= 4:
            (claimed,) = struct.unpack_from("<Q", head, 247)
        compressed, point_format = bool(point_format & 0x80), point_format & 0x3F
        sound = major == 1 and minor <= 5 and 227 <= header_size <= offset <= min(size, MAX_OFFSET)
        sound = sound and point_format < len(_RECORD_LENGTHS) and length >= _RECORD_LENGTHS[point_format]
        sound = sound and 54 * records <= offset - header_size
        if not sound or not all(np.isfinite(scale) and scale > 0 for scale in scales):
            raise RawDataError(f"{name}: its LAS header is damaged, or cut off; copy or export it again")
        if timed and point_format not in TIME_AT:
            raise RawDataError(
                f"{name}: its point format {point_format} has no GPS time; export it again in point format 1, 3 or 6 "
                "to 10"
            )
        present = (size - offset) // length
        first = offset
        if compressed:
            present = max_point_count(file, name, LazTables(records, header_size, offset, size))
            first = offset + 8
        time_at = first + TIME_AT.get(point_format, 0)
        (first_s,) = struct.unpack("<d", read_at(file, time_at, 8).ljust(8, b"\0"))
        present = min(claimed, present)
        adjusted = declared_time == "adjusted_standard" if declared_time else bool(encoding & 1)
        return LasHeader(
            adjusted_time=adjusted,
            declared_time=declared_time,
            compressed=compressed,
            size=size,
            claimed=claimed,
            present=present,
            first_s=first_s if present and np.isfinite(first_s) else 0.0,
            scales=scales,
        )
