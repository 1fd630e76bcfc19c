"""Files of kinds that are not read: what marks them, and what to export in their place.

Marks at a fixed place are those of the formats' documents or of public readers. What has only a short mark, or none, is
known by the shape of its first record (:mod:`pipeline.readers.unread_records`).
"""

import re
from collections.abc import Callable

import numpy as np

from pipeline.readers import unread_records as shape
from pipeline.readers.file_kind import Kind

CLOUD = "export it to LAS or LAZ with GPS time stamps"
SONAR = (
    "give the sonar's own files (R2Sonic packets, Kongsberg .kmall or .all), or export GSF with travel times and beam "
    "angles, of one head"
)
TRACK = "export the INS's solution as SBET, as a text of Inertial Explorer, or as a table with README.md's columns"
BY_SENSOR = {"ins": TRACK, "laser": CLOUD, "mbes": SONAR}
PROCESS = (
    "process it together with the IMU's data (Inertial Explorer, POSPac, Qinertia and the like), and export the "
    "solution as SBET, as a text of Inertial Explorer, or as a table with README.md's columns"
)


def _recorded(title: str) -> Kind:
    """Something that may hold each sensor's data."""
    return Kind(title, advice="export each sensor's data in a format that README.md names", advices=BY_SENSOR)


def _packed(title: str) -> Kind:
    return Kind(title, advice="unpack it, and list what was in it")


CAPTURE = Kind(
    "a capture of network traffic",
    advice="export each sensor's data in a format that README.md names",
    advices=BY_SENSOR
    | {
        "laser": f"{CLOUD} by the scanner's own software (of Velodyne, Hesai, Ouster, Livox and the like)",
        "mbes": "take the packets of the sonar's bathymetry port out of it, or give the sonar's own files",
    },
)
ALL_OF_A_SUN = Kind(
    "Kongsberg .all in big-endian order",
    advice="convert it to the order that the sonars of today write, or export GSF with travel times and beam angles",
    advices={"ins": TRACK, "laser": CLOUD},
)
S7K = Kind("a .s7k file (Teledyne Reson, Norbit)", advice=SONAR)
JSF = Kind("an EdgeTech .jsf file", advice=SONAR)
HYPACK = Kind(
    "a HYPACK file (.RAW, .HSX, .VEL)",
    advice="give the sonar's own files that were logged beside it (.R2S), or export GSF with travel times and angles",
    advices={"ins": TRACK, "laser": CLOUD},
)
POSPAC = Kind("a log of an Applanix POS", advice=f"{PROCESS} (POSPac: SBET)")
SBG = Kind("a log of an SBG INS", advice=f"{PROCESS} (Qinertia: SBET)")
SBF = Kind("a log of a Septentrio receiver (SBF)", advice=PROCESS)
UBX = Kind("a log of a u-blox receiver (UBX)", advice=PROCESS)
GSOF = Kind("a log of a Trimble receiver (GSOF)", advice=PROCESS)
RINEX = Kind("RINEX, observations of a GNSS receiver", advice=PROCESS)
NMEA = Kind("a log of NMEA sentences", advice=f"these have no angles of the full precision: {TRACK}")
POF = Kind("a trajectory of RIEGL (.pof)", advice=f"{TRACK}: it was made from one of these")
POQ = Kind("a trajectory's accuracies of RIEGL (.poq)", advice=f"{TRACK}: it was made from one of these")
PTX = Kind("a PTX file", advice=f"its points have no times: {CLOUD}")

MAGICS: tuple[tuple[int, bytes, Kind], ...] = (
    (8, b"RieglLMS", Kind("a RIEGL .rxp file", advice=f"{CLOUD} (RiSCAN PRO, RiPROCESS, or RiVLib)")),
    (0, b"ply\n", Kind("a PLY file", advice=CLOUD)),
    (0, b"ply\r\n", Kind("a PLY file", advice=CLOUD)),
    (0, b"# .PCD", Kind("a PCD file", advice=CLOUD)),
    (0, b"VERSION 0.7\nFIELDS", Kind("a PCD file", advice=CLOUD)),
    (0, b"VERSION .7\nFIELDS", Kind("a PCD file", advice=CLOUD)),
    (0, b"#ROSBAG V", _recorded("a ROS bag")),
    (0, b"\x89MCAP0\r\n", _recorded("a ROS bag (MCAP)")),
    (0, b"SQLite format 3\0", _recorded("a database (SQLite: QINSy, ROS 2 and others)")),
    (0, b"\x89HDF\r\n\x1a\n", _recorded("an HDF5 file (NetCDF, BAG and others)")),
    (0, b"FTP NEW 2", HYPACK),
    (0, b"[SVP_VERSION_", Kind("a cast of sound speed (CARIS .svp)", advice="give the cast under mbes.svp")),
    (0, b"PK\x03\x04", Kind("a ZIP archive", advice="unpack it; if it is a workbook, save the sheet as CSV")),
    (0, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", Kind("a document of Office", advice="save the sheet as CSV")),
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


def marked(head: bytes) -> Kind | None:
    """By a mark that no other file begins with."""
    return next((kind for at, magic, kind in MAGICS if head[at : at + len(magic)] == magic), None)


def binary(head: bytes, size: int) -> Kind | None:
    """By the shape of its first record."""
    return next((kind for is_one, kind in SHAPES if is_one(head, size)), None)


def text(head: str) -> Kind | None:
    """Of text by its first lines."""
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
    """NMEA 0183: talker and sentence, fields, and the exclusive or of their letters."""
    found = _SENTENCE.search(line)
    if found is None or not found[1].isascii():
        return False
    return int(np.bitwise_xor.reduce(np.frombuffer(found[1].encode(), np.uint8))) == int(found[2], 16)


SHAPES: tuple[tuple[Callable[[bytes, int], bool], Kind], ...] = (
    (shape.is_all_of_a_sun, ALL_OF_A_SUN),
    (shape.is_s7k, S7K),
    (shape.is_jsf, JSF),
    (shape.is_applanix, POSPAC),
    (shape.is_sbg, SBG),
    (shape.is_sbf, SBF),
    (shape.is_ubx, UBX),
    (shape.is_gsof, GSOF),
    (shape.is_pof, POF),
    (shape.is_poq, POQ),
)
