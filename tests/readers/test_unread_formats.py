"""Files of widespread kinds that are not read: named for what they are, with what to export; never called damaged."""

import re
import struct
from functools import reduce
from operator import xor
from pathlib import Path

import pytest

from pipeline.errors import RawDataError
from pipeline.readers import file_kind, unread_formats
from pipeline.readers.detect import HEAD_BYTES, kind_of_bytes
from pipeline.readers.dispatch import raw_parts
from tests.support.files import build
from tests.support.files.whole_files import WHOLE

REST = bytes(range(7, 250)) * 30


def _all(kind: bytes, body: bytes) -> bytes:
    inside = struct.pack(">BcHIIHH", 2, kind, 2040, 20230421, 64_092_662, 115, 2004) + body + b"\x03\0\0"
    return struct.pack(">I", len(inside)) + inside


def _s7k() -> bytes:
    head = struct.pack("<2H4I2Hf2BHI", 5, 60, 0x0000FFFF, 500, 0, 0, 2023, 111, 1.5, 10, 30, 0, 7200)
    return head + bytes(500 - len(head)) + REST


def _jsf() -> bytes:
    message = struct.pack("<H2BH4BHI", 0x1601, 13, 0, 2020, 0, 20, 0, 0, 0, 40) + bytes(40)
    return message * 30


def _applanix(tag: bytes) -> bytes:
    return (tag + struct.pack("<2H", 1, 132) + bytes(128) + b"\x12\x34$#") * 20


def _sbg() -> bytes:
    return (b"\xff\x5a" + struct.pack("<2BH", 6, 0, 32) + bytes(32) + b"\xab\xcd\x33") * 40


def _sbf() -> bytes:
    return (b"$@" + struct.pack("<3H", 0xBEEF, 4007, 96) + bytes(88)) * 40


def _ubx() -> bytes:
    body = struct.pack("<2BH", 1, 7, 92) + bytes(range(92))
    one = two = 0
    for byte in body:
        one = (one + byte) % 256
        two = (two + one) % 256
    return (b"\xb5\x62" + body + bytes((one, two))) * 30


def _gsof() -> bytes:
    inside = bytes((0x28, 0x40, 40, *range(40)))
    return (b"\x02" + inside + bytes((sum(inside) % 256, 3))) * 40


def _pof() -> bytes:
    head = b"POSITION".ljust(27, b" ") + struct.pack("<2HI3Hq", 1, 1, 350, 2023, 4, 21, 200)
    head += struct.pack("<6d", 120.0, 120.2, 35.9, 36.1, 5.0, 20.0)
    return head.ljust(350, b"\0") + struct.pack("<8d", 1e5, 120.1, 36.0, 12.0, 0.1, 0.2, 90.0, 0.0) * 200


def _poq() -> bytes:
    return b"QUALITY".ljust(35, b" ") + struct.pack("<2H3d", 1, 0, 0.005, 0.0051, 1e-6) + REST


def _nmea() -> bytes:
    lines = []
    for k in range(30):
        body = f"GPGGA,0915{k:02d}.00,3600.0000,N,12006.0000,E,4,12,0.8,12.0,M,5.0,M,,"
        lines.append(f"${body}*{reduce(xor, body.encode()):02X}\r\n")
    return "".join(lines).encode()


def _ptx() -> bytes:
    lines = ["3", "2", "0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1"]
    return "\n".join([*lines, *["1.111 2.222 3.333 0.5"] * 6, ""]).encode()


HSX = b"FTP NEW 2\r\nHSX 8\r\nVER 12.0.0.0\r\n" + b"RMB 2 35000.1 3 100 256 0 1500 1\r\n" * 20
RINEX = b"     3.04           OBSERVATION DATA    M                   RINEX VERSION / TYPE\nG   18 C1C\n"
CRINEX = b"3.0                 COMPACT RINEX FORMAT                    CRINEX VERS   / TYPE\nRNX2CRX\n"

FILES = {  # content, words of what it is
    "all of a Sun": (_all(b"I", b"WLZ=1.18,") + _all(b"N", REST), r"Kongsberg \.all in big-endian"),
    "s7k": (_s7k(), r"\.s7k"),
    "jsf": (_jsf(), r"EdgeTech \.jsf"),
    "bag": (b"#ROSBAG V2.0\nE\0\0\0" + REST, "ROS bag"),
    "mcap": (b"\x89MCAP0\r\n\x01" + REST, "ROS bag"),
    "sqlite": (b"SQLite format 3\0\x10\0" + REST, "database"),
    "7z": (b"7z\xbc\xaf\x27\x1c\0\4" + REST, "7z archive"),
    "rar": (b"Rar!\x1a\x07\x01\0" + REST, "RAR archive"),
    "gzip": (b"\x1f\x8b\x08\0" + REST, "gzip archive"),
    "tar": (b"mbes/line1.xtf".ljust(257, b"\0") + b"ustar\x0000" + REST, "tar archive"),
    "xlsx": (b"PK\x03\x04\x14\0" + REST, "ZIP archive"),
    "hsx": (HSX, "HYPACK"),
    "raw": (b"FTP NEW 2\nVER 21.0.0.0\nTND 10:00:00 04/21/2023\n" * 9, "HYPACK"),
    "pos": (_applanix(b"$GRP"), "Applanix"),
    "pos message": (_applanix(b"$MSG"), "Applanix"),
    "sbg": (_sbg(), "SBG"),
    "sbf": (_sbf(), "Septentrio"),
    "ubx": (_ubx(), "u-blox"),
    "gsof": (_gsof(), "Trimble"),
    "rinex": (RINEX * 20, "RINEX"),
    "compact rinex": (CRINEX * 20, "RINEX"),
    "nmea": (_nmea(), "NMEA"),
    "pof": (_pof(), r"RIEGL \(\.pof\)"),
    "poq": (_poq(), r"RIEGL \(\.poq\)"),
    "ptx": (_ptx(), "PTX"),
    "ply": (b"ply\r\nformat ascii 1.0\r\n" * 20, "PLY"),
    "cast": (b"[SVP_VERSION_2]\nx.svp\nSection 2020-195 18:00:00 48:00:00 -068:00:00\n0.5 1450.1\n", "cast of sound"),
    "pcap": (b"\xd4\xc3\xb2\xa1\2\0\4\0" + REST, "network traffic"),
    "pcap of nanoseconds": (b"\x4d\x3c\xb2\xa1\2\0\4\0" + REST, "network traffic"),
    "pcapng": (b"\x0a\x0d\x0d\x0a\x1c\0\0\0" + REST, "network traffic"),
}
FORMATS = {"ins": "novatel", "laser": "las", "mbes": "r2sonic"}


def refusal(content: bytes, sensor: str, folder: Path) -> str:
    (folder / "data.bin").write_bytes(content)
    with pytest.raises(RawDataError) as error:
        raw_parts(sensor, build.settings(sensor, ["data.bin"], FORMATS[sensor]), folder)
    return str(error.value)


@pytest.mark.parametrize("sensor", FORMATS)
@pytest.mark.parametrize("name", FILES)
def test_named_with_advice(name: str, sensor: str, tmp_path: Path) -> None:
    content, words = FILES[name]
    told = refusal(content, sensor, tmp_path)
    assert re.match(rf"data\.bin: is .*{words}.*, not {FORMATS[sensor]}; \S", told), told
    assert "\n" not in told
    assert "copy it again" not in told  # a sound file is not damaged
    assert "damaged" not in told


def test_advice_is_for_the_sensor(tmp_path: Path) -> None:
    """A capture under ins or laser does not hold the sonar's packets; a bag may hold anything."""
    capture = FILES["pcap"][0]
    assert "sonar" in refusal(capture, "mbes", tmp_path)
    for name in ("pcap", "bag", "mcap", "sqlite"):
        assert "sonar" not in refusal(FILES[name][0], "laser", tmp_path)
        assert "LAS or LAZ" in refusal(FILES[name][0], "laser", tmp_path)
        assert "sonar" not in refusal(FILES[name][0], "ins", tmp_path)
        assert "SBET" in refusal(FILES[name][0], "ins", tmp_path)


@pytest.mark.parametrize("form", WHOLE)
def test_what_is_read_is_not_taken_for_another(form: str) -> None:
    sensor, kind, whole = WHOLE[form]
    found = kind_of_bytes(whole[:HEAD_BYTES], len(whole))
    assert found.format == kind
    assert sensor in found.sensors
    assert unread_formats.kind_by_mark(whole) is None
    assert unread_formats.kind_by_first_record(whole, len(whole)) is None


MARKS = {"jsf": b"\x01\x16", "sbg": b"\xff\x5a", "sbf": b"$@", "ubx": b"\xb5\x62", "gsof": b"\x02\x28\x40\x28"}


@pytest.mark.parametrize("name", MARKS)
def test_two_bytes_are_no_mark(name: str) -> None:
    """Other files begin with them by chance; a record whose end is wrong is none."""
    content = FILES[name][0]
    assert kind_of_bytes(MARKS[name] + REST, 9999) is file_kind.UNKNOWN
    damaged = bytearray(content[:HEAD_BYTES])
    for k in range(len(MARKS[name]) + 6, len(damaged)):
        damaged[k] ^= 0x55
    assert kind_of_bytes(bytes(damaged), len(damaged)) is file_kind.UNKNOWN


def test_an_sbet_may_begin_with_any_two_bytes() -> None:
    """Its first number is a time, whose last digits can be anything."""
    sbet = bytearray(build.sbet(*(1000.0 + 0.005 * k for k in range(40))))
    for mark in (*MARKS.values(), b"\x1f\x8b"):
        sbet[: len(mark)] = mark
        assert kind_of_bytes(bytes(sbet), len(sbet)).format == "sbet"


def test_damaged_sentences_are_a_text() -> None:
    """A checksum that is wrong in most lines: whatever that is, no log of NMEA."""
    wrong = _nmea().replace(b",N,", b",S,")
    assert kind_of_bytes(wrong, len(wrong)) is file_kind.TEXT


def test_a_novatel_log_among_sentences_is_novatel() -> None:
    content = _nmea() + b"".join(build.inspvasa(9.0 + k) for k in range(4))
    assert kind_of_bytes(content, len(content)).format == "novatel"


def test_numbers_are_no_ptx() -> None:
    text = b"3\n2\n0 0 0\n" + b"1 2 3\n" * 50
    assert kind_of_bytes(text, len(text)) is file_kind.TEXT
