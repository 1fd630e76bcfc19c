"""Recognise formats that are not read, each by the first record of the file.

Other files may begin with a mark of two or three bytes by chance. Therefore a short mark counts only if its record is
whole: the length leads to the end mark, to a correct checksum, or to the next record. Each function has the parameters
``head``, the beginning of a file, and ``size``, the file's size in bytes. The layouts are (little-endian):

    .s7k                   u16 version, u16 offset 60, u32 0x0000FFFF, u32 size, ..., at byte 32 u32 type of record
    EdgeTech .jsf          u16 0x1601, u8 version, u8 session, u16 type, 4 u8, u16, u32 count of bytes that follow
    Applanix POS           $GRP or $MSG, u16 number, u16 count of bytes that follow, the last two $#
    SBG                    FF 5A, u8 message, u8 class, u16 length, data, u16 checksum, 33
    Septentrio SBF         $@, u16 checksum, u16 number, u16 length of all, a multiple of 4
    u-blox UBX             B5 62, u8 class, u8 number, u16 length, data, two sums of the bytes from the class on
    Trimble GSOF           STX, u8 status, 40, u8 length, data, sum of the bytes from the status on, ETX
    RIEGL .pof             27 bytes, u16 x 2 version, u32 place of the data, u16 x 3 date, i64 records, f64 x 6 limits
    RIEGL .poq             35 bytes, u16 x 2 version, f64 x 3 mean, greatest and scatter of the steps in time
"""

import struct

import numpy as np

from pipeline.readers.kongsberg_all_datagrams import is_datagram_header


def is_big_endian_all(head: bytes, size: int) -> bool:
    """Return whether the file is a Kongsberg .all file written in big-endian order (on a Sun)."""
    return is_datagram_header(head[:20], ">")


def is_s7k(head: bytes, size: int) -> bool:
    """Return whether the file is a .s7k file of Teledyne Reson."""
    if len(head) < 36 or head[4:8] != b"\xff\xff\0\0":
        return False
    offset, length, record = struct.unpack_from("<2xH4xI20xI", head)
    return bool(offset == 60 and length >= 64 and 1000 <= record < 20_000)


def is_jsf(head: bytes, size: int) -> bool:
    """Return whether the file is a .jsf file of EdgeTech."""
    if head[:2] != b"\x01\x16" or len(head) < 16:
        return False
    return _follows(head, size, 16 + struct.unpack_from("<I", head, 12)[0])


def _follows(head: bytes, size: int, end: int) -> bool:
    """Return whether ``end`` is in the file and, if ``head`` reaches it, the next record begins there with the mark."""
    return end <= size and (end >= len(head) or head[end : end + 2] == head[:2])


def is_applanix(head: bytes, size: int) -> bool:
    """Return whether the file is a log of an Applanix POS."""
    if head[:4] not in (b"$GRP", b"$MSG") or len(head) < 8:
        return False
    end = 8 + struct.unpack_from("<H", head, 6)[0]
    return end <= size and (end > len(head) or head[end - 2 : end] == b"$#")


def is_sbg(head: bytes, size: int) -> bool:
    """Return whether the file is a log of an SBG INS."""
    if head[:2] != b"\xff\x5a" or len(head) < 6:
        return False
    length = struct.unpack_from("<H", head, 4)[0]
    return length <= 4086 and head[8 + length : 9 + length] == b"\x33" and _follows(head, size, 9 + length)


def is_sbf(head: bytes, size: int) -> bool:
    """Return whether the file is a log of a Septentrio receiver (SBF)."""
    if head[:2] != b"$@" or len(head) < 8:
        return False
    length = struct.unpack_from("<H", head, 6)[0]
    return length >= 8 and length % 4 == 0 and _follows(head, size, length)


def is_ubx(head: bytes, size: int) -> bool:
    """Return whether the file is a log of a u-blox receiver (UBX)."""
    if head[:2] != b"\xb5\x62" or len(head) < 8:
        return False
    end = 6 + struct.unpack_from("<H", head, 4)[0]
    first_sum = second_sum = 0
    for byte in head[2:end]:
        first_sum = (first_sum + byte) & 0xFF
        second_sum = (second_sum + first_sum) & 0xFF
    return head[end : end + 2] == bytes((first_sum, second_sum))


def is_gsof(head: bytes, size: int) -> bool:
    """Return whether the file is a log of a Trimble receiver (GSOF)."""
    if len(head) < 6 or head[0] != 2 or head[2] != 0x40:
        return False
    end = 4 + head[3]
    return head[end : end + 2] == bytes((sum(head[1:end]) & 0xFF, 3))


@np.errstate(all="ignore")  # any bytes may be read as numbers
def is_pof(head: bytes, size: int) -> bool:
    """Return whether the file is a trajectory of RIEGL (.pof)."""
    if len(head) < 97:
        return False
    major, minor, data, year, month, day, records = struct.unpack_from("<2HI3Hq", head, 27)
    limits = struct.unpack_from("<6d", head, 49)
    plausible = major == 1 and minor < 10 and 97 <= data <= 4096 and records > 0 and 56 * records <= size
    plausible = plausible and 1990 <= year <= 2100 and 1 <= month <= 12 and 1 <= day <= 31
    return plausible and all(np.abs(limits) <= 1e5) and all(low <= high for low, high in (limits[:2], limits[2:4]))


@np.errstate(all="ignore")
def is_poq(head: bytes, size: int) -> bool:
    """Return whether the file holds the accuracies of a RIEGL trajectory (.poq)."""
    if len(head) < 63:
        return False
    major, minor, mean, greatest, scatter = struct.unpack_from("<2H3d", head, 35)
    return bool(major == 1 and minor < 10 and 1e-4 < mean < 100 and mean <= greatest < 1e6 and 1e-12 < scatter < 1e5)
