"""What a file is, by its content: never by its name."""

import re
from pathlib import Path

import numpy as np

from pipeline.readers import unread_formats
from pipeline.readers.file_kind import Kind
from pipeline.readers.inertial_explorer_layout import header_line_number
from pipeline.readers.kongsberg_all_datagrams import is_head
from pipeline.readers.r2sonic_packets import BTH0, OTHERS, packet_size
from pipeline.readers.raw_file import opened, size_of
from pipeline.readers.row_checks import through_float32

HEAD = 65_536

LAS = Kind("LAS or LAZ", "las", ("laser",))
NOVATEL = Kind("a NovAtel log", "novatel", ("ins",))
SBET = Kind("SBET", "sbet", ("ins",))
E57 = Kind("E57", "e57", ("laser",))
GSF = Kind("GSF", "gsf", ("mbes",))
KMALL = Kind("Kongsberg .kmall", "kmall", ("mbes",))
ALL = Kind("Kongsberg .all", "all", ("mbes",))
INERTIAL_EXPLORER = Kind("an Inertial Explorer export", "inertial_explorer", ("ins",))
XTF = Kind("XTF", "r2sonic", ("mbes",))
PACKETS = Kind("R2Sonic packets", "r2sonic", ("mbes",))
PARQUET = Kind("a Parquet table", "table", ("ins", "laser", "mbes"))
CSV = Kind("a CSV table", "table", ("ins", "laser", "mbes"))
EMPTY = Kind("empty", advice="copy it again, or take it out of the list")
ACCURACY = Kind(
    "an accuracy file (SMRMSG)", advice="give the SBET that belongs to it, and list this one under ins.accuracy"
)
FLOAT32_TEXT = Kind(
    "a text whose numbers went through float32: times and positions have lost their digits",
    advice="export it again in double precision, as LAS or as a table with the columns that README.md names",
)
TEXT = Kind(
    "a text without the columns of a table",
    advice="name the columns in its first line as README.md has them, or export it in a format of the instrument",
)
TRAJECTORY_TEXT = Kind(
    "a trajectory as text, of a layout that is not read",
    advice="export it as SBET (POSPac, Qinertia, Delph INS, OxTS and Inertial Explorer have it), or as a table with "
    "the columns that README.md names; if it is Inertial Explorer's, export it with its header",
)
UTF16 = Kind("a text in UTF-16", advice="save it as UTF-8")
UNKNOWN = Kind(
    "of no kind that is read",
    advice="export it in one of the formats that README.md names; if it should be one of them, copy it again",
)

MAGICS = ((0, b"LASF", LAS), (0, b"PAR1", PARQUET), (0, b"ASTM-E57", E57), (8, b"GSF-v", GSF))
RDBX = Kind("a RIEGL .rdbx file", advice=f"{unread_formats.CLOUD} (RiSCAN PRO or RiPROCESS)")
NOVATEL_SYNCS = (b"\xaa\x44\x12\x1c", b"\xaa\x44\x13")
_NOVATEL_TEXT = re.compile(rb"(?:^|[\r\n\] \t,])[#%][A-Z][A-Z0-9_]+A,[^\r\n;]*;")


def kind_of(path: Path, name: str) -> Kind:
    """What the file is, from its size and its first 64 kB."""
    with opened(path, name) as file:
        size = size_of(file)
        return kind_of_bytes(file.read(HEAD), size)


@np.errstate(all="ignore")  # whatever the bytes are as numbers
def kind_of_bytes(head: bytes, size: int) -> Kind:
    if not size:
        return EMPTY
    for offset, magic, kind in MAGICS:
        if head[offset : offset + len(magic)] == magic:
            return kind
    if (other := unread_formats.marked(head)) is not None:
        return other
    if re.match(rb"#[A-Z]{3}\x00?", head[4:9]) and int.from_bytes(head[:4], "little") <= max(size, 1 << 20):
        return KMALL
    if is_head(head[:20]):
        return ALL
    if head[:1] == b"\x7b" and _is_xtf(head):  # which a datagram of 123 bytes begins with as well
        return XTF
    if head.startswith(NOVATEL_SYNCS):
        return NOVATEL
    if head[:4] in (BTH0, *OTHERS) or _has_packet(head[:16]):
        return PACKETS
    if b"riegl" in head[:4096].lower() and b"rdb" in head[:4096].lower():
        return RDBX
    if header_line_number(head) is not None:
        return INERTIAL_EXPLORER
    text = _is_text(head)
    if not text and (doubles := _kind_of_doubles(head, size)) is not None:
        return doubles
    if not text and (other := unread_formats.binary(head, size)) is not None:
        return other
    if any(sync in head for sync in NOVATEL_SYNCS) or _NOVATEL_TEXT.search(head):
        return NOVATEL
    if _has_packet(head):
        return PACKETS
    if text:
        return _kind_of_text(head)
    return UTF16 if head[:2] in (b"\xff\xfe", b"\xfe\xff") and b"\0" in head[:64] else UNKNOWN


def _is_xtf(head: bytes) -> bool:
    """Format byte 0x7B, and a record's mark behind the file header of 1024 bytes or a multiple; or cut off before."""
    marks = (head[start : start + 2] for start in range(1024, len(head), 1024))
    return b"\xce\xfa" in marks or (len(head) <= 1024 and not _is_text(head))


def _has_packet(head: bytes) -> bool:
    start = head.find(BTH0)
    while start >= 0:
        if packet_size(head[start : start + 8]) is not None:
            return True
        start = head.find(BTH0, start + 4)
    return False


def _kind_of_doubles(head: bytes, size: int) -> Kind | None:
    """Files of doubles without header: records of 17 (SBET) or 10 (accuracy) whose values make sense."""
    if size >= 80 and size % 80 < 8:
        rows = np.frombuffer(head, "<f8", len(head) // 80 * 10).reshape(-1, 10)[:20]
        if _rising(rows[:, 0]) and np.all(np.isfinite(rows)) and np.all((rows[:, 1:] >= 0) & (rows[:, 1:] < 1e4)):
            return ACCURACY
    if size < 136 or len(head) < 136:
        return None
    rows = np.frombuffer(head, "<f8", len(head) // 136 * 17).reshape(-1, 17)[:20]
    limits = [1.3e6, np.pi / 2, 2 * np.pi, 2e4, 1e3, 1e3, 1e3, np.pi, np.pi / 2, 13, 13, 1e3, 1e3, 1e3, 1e2, 1e2, 1e2]
    first = rows[0]
    possible = np.all(np.isfinite(first)) and np.all(np.abs(first) <= limits)
    normal = possible and not np.any((first != 0) & (np.abs(first) < 1e-290))  # integers read as doubles are tiny
    return SBET if normal and first[0] >= 0 and np.any(first[1:3] != 0) else None


def _rising(seconds: np.ndarray) -> bool:
    steps = np.diff(seconds)
    return bool(np.all((seconds >= 0) & (seconds < 1.3e6)) and np.all((steps > 0) & (steps < 1000)))


def _is_text(head: bytes) -> bool:
    text = head.removesuffix(head[-3:]) if len(head) == HEAD else head  # a letter may be cut in two
    try:
        letters = text.decode("utf-8-sig")
    except UnicodeDecodeError:
        return False
    return all(letter.isprintable() or letter in "\r\n\t\f" for letter in letters)


def _kind_of_text(head: bytes) -> Kind:
    from pipeline.readers.table_columns import csv_header

    lines = [line for line in head.decode("utf-8-sig", "replace").splitlines() if line.strip()]
    rows = [line for line in lines if not line.startswith(("#", "//"))]
    if rows and csv_header(rows[0]) is not None:
        return CSV
    if (other := unread_formats.text("\n".join(lines))) is not None:
        return other
    if any(_names_trajectory(line) for line in lines):
        return TRAJECTORY_TEXT
    numbers = [_floats(row) for row in rows[:-1][:200]]
    width = max((len(row) for row in numbers), default=0)
    whole = np.array([row for row in numbers if width >= 3 and len(row) == width]).reshape(-1, max(width, 1))
    if len(whole) and any(through_float32(column) for column in whole.T):
        return FLOAT32_TEXT
    return TEXT


def _names_trajectory(line: str) -> bool:
    """A line of names of columns: position and attitude, whatever program calls them so."""
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
