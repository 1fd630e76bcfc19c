"""Kinds of files that are not read: how they are recognised, and what the user should export in their place.

Marks at a fixed place are taken from the formats' documents or from public readers. A kind with a short mark, or with
none, is recognised by the shape of its first record (:mod:`pipeline.readers.unread_records`).
"""

import re
from collections.abc import Callable

import numpy as np

from pipeline.readers import unread_records
from pipeline.readers.file_kind import FileKind

EXPORT_LAS = "export it to LAS or LAZ with GPS time stamps"
EXPORT_PINGS = (
    "give the sonar's own files (R2Sonic packets, Kongsberg .kmall or .all), or export GSF with travel times and beam "
    "angles, of one head"
)
EXPORT_SOLUTION = (
    "export the INS's solution as SBET, as a text of Inertial Explorer, or as a table with docs/your-files.md's columns"
)
EXPORT_BY_SENSOR = {"ins": EXPORT_SOLUTION, "laser": EXPORT_LAS, "mbes": EXPORT_PINGS}
PROCESS_GNSS = (
    "process it together with the IMU's data (Inertial Explorer, POSPac, Qinertia and the like), and export the "
    "solution as SBET, as a text of Inertial Explorer, or as a table with docs/your-files.md's columns"
)


def _recorded(title: str) -> FileKind:
    """Return a kind of file that may hold the data of any sensor."""
    return FileKind(
        title,
        advice="export each sensor's data in a format that docs/your-files.md names",
        advice_by_sensor=EXPORT_BY_SENSOR,
    )


def _packed(title: str) -> FileKind:
    return FileKind(title, advice="unpack it, and list what was in it")


CAPTURE = FileKind(
    "a capture of network traffic",
    advice="export each sensor's data in a format that docs/your-files.md names",
    advice_by_sensor=EXPORT_BY_SENSOR
    | {
        "laser": f"{EXPORT_LAS} by the scanner's own software (of Velodyne, Hesai, Ouster, Livox and the like)",
        "mbes": "take the packets of the sonar's bathymetry port out of it, or give the sonar's own files",
    },
)
BIG_ENDIAN_ALL = FileKind(
    "Kongsberg .all in big-endian order",
    advice="convert it to the order that the sonars of today write, or export GSF with travel times and beam angles",
    advice_by_sensor={"ins": EXPORT_SOLUTION, "laser": EXPORT_LAS},
)
S7K = FileKind("a .s7k file (Teledyne Reson, Norbit)", advice=EXPORT_PINGS)
JSF = FileKind("an EdgeTech .jsf file", advice=EXPORT_PINGS)
HYPACK = FileKind(
    "a HYPACK file (.RAW, .HSX, .VEL)",
    advice="give the sonar's own files that were logged beside it (.R2S), or export GSF with travel times and angles",
    advice_by_sensor={"ins": EXPORT_SOLUTION, "laser": EXPORT_LAS},
)
POSPAC = FileKind("a log of an Applanix POS", advice=f"{PROCESS_GNSS} (POSPac: SBET)")
SBG = FileKind("a log of an SBG INS", advice=f"{PROCESS_GNSS} (Qinertia: SBET)")
SBF = FileKind("a log of a Septentrio receiver (SBF)", advice=PROCESS_GNSS)
UBX = FileKind("a log of a u-blox receiver (UBX)", advice=PROCESS_GNSS)
GSOF = FileKind("a log of a Trimble receiver (GSOF)", advice=PROCESS_GNSS)
RINEX = FileKind("RINEX, observations of a GNSS receiver", advice=PROCESS_GNSS)
NMEA = FileKind("a log of NMEA sentences", advice=f"these have no angles of the full precision: {EXPORT_SOLUTION}")
POF = FileKind("a trajectory of RIEGL (.pof)", advice=f"{EXPORT_SOLUTION}: it was made from one of these")
POQ = FileKind("a trajectory's accuracies of RIEGL (.poq)", advice=f"{EXPORT_SOLUTION}: it was made from one of these")
PTX = FileKind("a PTX file", advice=f"its points have no times: {EXPORT_LAS}")

_MARKS: tuple[tuple[int, bytes, FileKind], ...] = (
    (8, b"RieglLMS", FileKind("a RIEGL .rxp file", advice=f"{EXPORT_LAS} (RiSCAN PRO, RiPROCESS, or RiVLib)")),
    (0, b"ply\n", FileKind("a PLY file", advice=EXPORT_LAS)),
    (0, b"ply\r\n", FileKind("a PLY file", advice=EXPORT_LAS)),
    (0, b"# .PCD", FileKind("a PCD file", advice=EXPORT_LAS)),
    (0, b"VERSION 0.7\nFIELDS", FileKind("a PCD file", advice=EXPORT_LAS)),
    (0, b"VERSION .7\nFIELDS", FileKind("a PCD file", advice=EXPORT_LAS)),
    (0, b"#ROSBAG V", _recorded("a ROS bag")),
    (0, b"\x89MCAP0\r\n", _recorded("a ROS bag (MCAP)")),
    (0, b"SQLite format 3\0", _recorded("a database (SQLite: QINSy, ROS 2 and others)")),
    (0, b"\x89HDF\r\n\x1a\n", _recorded("an HDF5 file (NetCDF, BAG and others)")),
    (0, b"FTP NEW 2", HYPACK),
    (0, b"[SVP_VERSION_", FileKind("a cast of sound speed (CARIS .svp)", advice="give the cast under mbes.svp")),
    (0, b"PK\x03\x04", FileKind("a ZIP archive", advice="unpack it; if it is a workbook, save the sheet as CSV")),
    (0, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", FileKind("a document of Office", advice="save the sheet as CSV")),
    (0, b"\x1f\x8b\x08", _packed("a gzip archive")),
    (0, b"7z\xbc\xaf\x27\x1c", _packed("a 7z archive")),
    (0, b"Rar!\x1a\x07", _packed("a RAR archive")),
    (0, b"\xfd7zXZ\0", _packed("an xz archive")),
    (0, b"\x28\xb5\x2f\xfd", _packed("a Zstandard archive")),
    (257, b"ustar", _packed("a tar archive")),
    (0, b"\xd4\xc3\xb2\xa1", CAPTURE),
    (0, b"\xa1\xb2\xc3\xd4", CAPTURE),
    (0, b"\x4d\x3c\xb2\xa1", CAPTURE),
    (0, b"\xa1\xb2\x3c\x4d", CAPTURE),
    (0, b"\x0a\x0d\x0d\x0a", CAPTURE),
)


def kind_by_mark(head: bytes) -> FileKind | None:
    """Return the kind whose mark the file has; None without a mark. Files of other kinds do not have these marks."""
    return next((kind for at, magic, kind in _MARKS if head[at : at + len(magic)] == magic), None)


def kind_by_first_record(head: bytes, size: int) -> FileKind | None:
    """Return the kind of a binary file of ``size`` bytes by the shape of its first record; None if no shape fits."""
    return next((kind for has_shape, kind in _SHAPES if has_shape(head, size)), None)


def kind_of_text(head: str) -> FileKind | None:
    """Return the kind of a text by its first lines; None if no kind fits."""
    lines = [line.rstrip() for line in head.splitlines()]
    first = lines[0] if lines else ""
    if first[60:].strip() in ("RINEX VERSION / TYPE", "CRINEX VERS   / TYPE"):
        return RINEX
    if sum(_is_sentence(line) for line in lines[:50]) > len(lines[:50]) / 2:
        return NMEA
    widths = [len(line.split()) for line in lines[:10]]
    if widths == [1, 1, 3, 3, 3, 3, 4, 4, 4, 4] and all(re.fullmatch(r"[-+.\deE\s]+", line) for line in lines[:10]):
        return PTX
    return None


_SENTENCE = re.compile(r"[$!]([A-Z]{2}[A-Z0-9]{3,},[^*$]*)\*([0-9A-Fa-f]{2})")


def _is_sentence(line: str) -> bool:
    """Return whether the line has an NMEA 0183 sentence: talker and type, fields, and their correct exclusive or."""
    sentence = _SENTENCE.search(line)
    if sentence is None or not sentence[1].isascii():
        return False
    return int(np.bitwise_xor.reduce(np.frombuffer(sentence[1].encode(), np.uint8))) == int(sentence[2], 16)


_SHAPES: tuple[tuple[Callable[[bytes, int], bool], FileKind], ...] = (
    (unread_records.is_big_endian_all, BIG_ENDIAN_ALL),
    (unread_records.is_s7k, S7K),
    (unread_records.is_jsf, JSF),
    (unread_records.is_applanix, POSPAC),
    (unread_records.is_sbg, SBG),
    (unread_records.is_sbf, SBF),
    (unread_records.is_ubx, UBX),
    (unread_records.is_gsof, GSOF),
    (unread_records.is_pof, POF),
    (unread_records.is_poq, POQ),
)
