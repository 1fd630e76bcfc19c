"""Recognise the kind of a file by its content, never by its name."""

import re
from pathlib import Path

import numpy as np

from pipeline.readers import unread_formats
from pipeline.readers.file_kind import (
    CSV,
    E57,
    EMPTY_FILE,
    FLOAT32_TEXT,
    GSF,
    INERTIAL_EXPLORER,
    KMALL,
    KONGSBERG_ALL,
    LAS,
    NOVATEL,
    PARQUET,
    R2SONIC_PACKETS,
    SBET,
    SMRMSG,
    TEXT,
    TRAJECTORY_TEXT,
    UNKNOWN,
    UTF16_TEXT,
    XTF,
    FileKind,
)
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.inertial_explorer_layout import header_line_number
from pipeline.readers.kongsberg_all_datagrams import is_datagram_header
from pipeline.readers.r2sonic_framing import BTH0, OTHER_PACKETS, packet_size
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.table_columns import csv_header

HEAD_BYTES = 65_536  # length of the file's beginning from which its kind is recognised

_MAGICS = ((0, b"LASF", LAS), (0, b"PAR1", PARQUET), (0, b"ASTM-E57", E57), (8, b"GSF-v", GSF))
RDBX = FileKind("a RIEGL .rdbx file", advice=f"{unread_formats.EXPORT_LAS} (RiSCAN PRO or RiPROCESS)")
_NOVATEL_SYNCS = (b"\xaa\x44\x12\x1c", b"\xaa\x44\x13")
_NOVATEL_TEXT = re.compile(rb"(?:^|[\r\n\] \t,])[#%][A-Z][A-Z0-9_]+A,[^\r\n;]*;")


def kind_of(path: Path, name: str) -> FileKind:
    """Return the kind of a file, from its size and its first 64 kB."""
    with opened(path, name) as file:
        size = size_of(file)
        return kind_of_bytes(file.read(HEAD_BYTES), size)


@np.errstate(all="ignore")  # any bytes may be read as numbers
def kind_of_bytes(head: bytes, size: int) -> FileKind:
    """Return the kind of a file of ``size`` bytes that begins with ``head``, its first HEAD_BYTES bytes.

    The most certain tests come first: marks of several bytes at a fixed place, then whole headers, then the shape of
    the data.
    """
    if not size:
        return EMPTY_FILE
    for offset, magic, kind in _MAGICS:
        if head[offset : offset + len(magic)] == magic:
            return kind
    if (unread_kind := unread_formats.kind_by_mark(head)) is not None:
        return unread_kind
    if re.match(rb"#[A-Z]{3}\x00?", head[4:9]) and int.from_bytes(head[:4], "little") <= max(size, 1 << 20):
        return KMALL
    if is_datagram_header(head[:20]):
        return KONGSBERG_ALL
    if head[:1] == b"\x7b" and _is_xtf(head):  # a datagram of 123 bytes begins with 0x7B as well
        return XTF
    if head.startswith(_NOVATEL_SYNCS):
        return NOVATEL
    if head[:4] in (BTH0, *OTHER_PACKETS) or _has_packet(head[:16]):
        return R2SONIC_PACKETS
    if b"riegl" in head[:4096].lower() and b"rdb" in head[:4096].lower():
        return RDBX
    if header_line_number(head) is not None:
        return INERTIAL_EXPLORER
    text = _is_text(head)
    if not text and (doubles := _kind_of_doubles(head, size)) is not None:
        return doubles
    if not text and (unread_kind := unread_formats.kind_by_first_record(head, size)) is not None:
        return unread_kind
    if any(sync in head for sync in _NOVATEL_SYNCS) or _NOVATEL_TEXT.search(head):
        return NOVATEL
    if _has_packet(head):
        return R2SONIC_PACKETS
    if text:
        return _kind_of_text(head)
    return UTF16_TEXT if head[:2] in (b"\xff\xfe", b"\xfe\xff") and b"\0" in head[:64] else UNKNOWN


def _is_xtf(head: bytes) -> bool:
    """Return whether a file that begins with XTF's format byte 0x7B is XTF.

    A record's mark must follow the file header of 1024 bytes or a multiple, or the file must end within the header and
    be no text.
    """
    marks = (head[start : start + 2] for start in range(1024, len(head), 1024))
    return b"\xce\xfa" in marks or (len(head) <= 1024 and not _is_text(head))


def _has_packet(head: bytes) -> bool:
    start = head.find(BTH0)
    while start >= 0:
        if packet_size(head[start : start + 8]) is not None:
            return True
        start = head.find(BTH0, start + 4)
    return False


def _kind_of_doubles(head: bytes, size: int) -> FileKind | None:
    """Return SBET or SMRMSG if the file has records of 17 or 10 doubles with possible values; None otherwise."""
    if size >= 80 and size % 80 < 8:
        rows = np.frombuffer(head, "<f8", len(head) // 80 * 10).reshape(-1, 10)[:20]
        if _rising(rows[:, 0]) and np.all(np.isfinite(rows)) and np.all((rows[:, 1:] >= 0) & (rows[:, 1:] < 1e4)):
            return SMRMSG
    if size < 136 or len(head) < 136:
        return None
    rows = np.frombuffer(head, "<f8", len(head) // 136 * 17).reshape(-1, 17)[:20]
    limits = [1.3e6, np.pi / 2, 2 * np.pi, 2e4, 1e3, 1e3, 1e3, np.pi, np.pi / 2, 13, 13, 1e3, 1e3, 1e3, 1e2, 1e2, 1e2]
    first = rows[0]
    possible = np.all(np.isfinite(first)) and np.all(np.abs(first) <= limits)
    normal = possible and not np.any((first != 0) & (np.abs(first) < 1e-290))  # integers are tiny if read as doubles
    return SBET if normal and first[0] >= 0 and np.any(first[1:3] != 0) else None


def _rising(seconds: np.ndarray) -> bool:
    """Return whether times [s] lie within two weeks, and ascend in steps below 1000 s."""
    steps = np.diff(seconds)
    return bool(np.all((seconds >= 0) & (seconds < 1.3e6)) and np.all((steps > 0) & (steps < 1000)))


def _is_text(head: bytes) -> bool:
    # HEAD_BYTES may end within a letter of several bytes
    whole_letters = head.removesuffix(head[-3:]) if len(head) == HEAD_BYTES else head
    try:
        letters = whole_letters.decode("utf-8-sig")
    except UnicodeDecodeError:
        return False
    return all(letter.isprintable() or letter in "\r\n\t\f" for letter in letters)


def _kind_of_text(head: bytes) -> FileKind:
    lines = [line for line in head.decode("utf-8-sig", "replace").splitlines() if line.strip()]
    rows = [line for line in lines if not line.startswith(("#", "//"))]
    if rows and csv_header(rows[0]) is not None:
        return CSV
    if (unread_kind := unread_formats.kind_of_text("\n".join(lines))) is not None:
        return unread_kind
    if any(_names_trajectory(line) for line in lines):
        return TRAJECTORY_TEXT
    numbers = [_floats(row) for row in rows[:-1][:200]]
    width = max((len(row) for row in numbers), default=0)
    complete = np.array([row for row in numbers if width >= 3 and len(row) == width]).reshape(-1, max(width, 1))
    if len(complete) and any(through_float32(column) for column in complete.T):
        return FLOAT32_TEXT
    return TEXT


def _names_trajectory(line: str) -> bool:
    """Return whether a line names columns of position and attitude, in the words that programs use for them."""
    words = re.findall(r"[a-z]+", line.lower())
    return all(
        any(word.startswith(start) for word in words for start in starts)
        for starts in (("lat", "north", "poslat"), ("lon", "east", "poslon"), ("roll", "angleroll"), ("head", "yaw"))
    )


def _floats(row: str) -> list[float]:
    try:
        return [float(word) for word in re.split(r"[\s,;]+", row.strip()) if word]
    except ValueError:
        return []
