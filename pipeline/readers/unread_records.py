"""The first records of files that are not read, by which these are known.

A mark of two or three bytes, which other files may begin with by chance, counts only where the record that it begins is
whole: its length leads to its end mark, to a checksum that is right, or to the next record. Little-endian:

    .s7k                   u16 version, u16 offset 60, u32 0x0000FFFF, u32 size, ..., at byte 32 u32 type of record
    EdgeTech .jsf          u16 0x1601, u8 version, u8 session, u16 type, 4 u8, u16, u32 bytes that follow
    Applanix POS           $GRP or $MSG, u16 number, u16 bytes that follow, the last two $#
    SBG                    FF 5A, u8 message, u8 class, u16 length, data, u16 checksum, 33
    Septentrio SBF         $@, u16 checksum, u16 number, u16 length of all, a multiple of 4
    u-blox UBX             B5 62, u8 class, u8 number, u16 length, data, two sums of the bytes from the class on
    Trimble GSOF           STX, u8 status, 40, u8 length, data, sum of the bytes from the status on, ETX
    RIEGL .pof             27 bytes, u16 x 2 version, u32 place of the data, u16 x 3 date, i64 records, f64 x 6 limits
    RIEGL .poq             35 bytes, u16 x 2 version, f64 x 3 mean, greatest and scatter of the steps in time
"""

import struct

import numpy as np

from pipeline.readers.kongsberg_all_datagrams import is_head


def is_all_of_a_sun(head: bytes, size: int) -> bool:
    return is_head(head[:20], ">")


def is_s7k(head: bytes, size: int) -> bool:
    if len(head) < 36 or head[4:8] != b"\xff\xff\0\0":
        return False
    offset, length, record = struct.unpack_from("<2xH4xI20xI", head)
    return bool(offset == 60 and length >= 64 and 1000 <= record < 20_000)


def is_jsf(head: bytes, size: int) -> bool:
    if head[:2] != b"\x01\x16" or len(head) < 16:
        return False
    return _follows(head, size, 16 + struct.unpack_from("<I", head, 12)[0])


def _follows(head: bytes, size: int, end: int) -> bool:
    """The next record begins as the first; or it lies beyond what is seen of the file, or is its end."""
    return end <= size and (end >= len(head) or head[end : end + 2] == head[:2])


def is_applanix(head: bytes, size: int) -> bool:
    if head[:4] not in (b"$GRP", b"$MSG") or len(head) < 8:
        return False
    end = 8 + struct.unpack_from("<H", head, 6)[0]
    return end <= size and (end > len(head) or head[end - 2 : end] == b"$#")


def is_sbg(head: bytes, size: int) -> bool:
    if head[:2] != b"\xff\x5a" or len(head) < 6:
        return False
    length = struct.unpack_from("<H", head, 4)[0]
    return length <= 4086 and head[8 + length : 9 + length] == b"\x33" and _follows(head, size, 9 + length)


def is_sbf(head: bytes, size: int) -> bool:
    if head[:2] != b"$@" or len(head) < 8:
        return False
    length = struct.unpack_from("<H", head, 6)[0]
    return length >= 8 and length % 4 == 0 and _follows(head, size, length)


def is_ubx(head: bytes, size: int) -> bool:
    if head[:2] != b"\xb5\x62" or len(head) < 8:
        return False
    end = 6 + struct.unpack_from("<H", head, 4)[0]
    one = two = 0
    for byte in head[2:end]:
        one = (one + byte) & 0xFF
        two = (two + one) & 0xFF
    return head[end : end + 2] == bytes((one, two))


def is_gsof(head: bytes, size: int) -> bool:
    if len(head) < 6 or head[0] != 2 or head[2] != 0x40:
        return False
    end = 4 + head[3]
    return head[end : end + 2] == bytes((sum(head[1:end]) & 0xFF, 3))


@np.errstate(all="ignore")  # whatever the bytes are as numbers
def is_pof(head: bytes, size: int) -> bool:
    if len(head) < 97:
        return False
    major, minor, data, year, month, day, records = struct.unpack_from("<2HI3Hq", head, 27)
    limits = struct.unpack_from("<6d", head, 49)
    sound = major == 1 and minor < 10 and 97 <= data <= 4096 and records > 0 and 56 * records <= size
    sound = sound and 1990 <= year <= 2100 and 1 <= month <= 12 and 1 <= day <= 31
    return sound and all(np.abs(limits) <= 1e5) and all(low <= high for low, high in (limits[:2], limits[2:4]))


@np.errstate(all="ignore")
def is_poq(head: bytes, size: int) -> bool:
    if len(head) < 63:
        return False
    major, minor, mean, most, scatter = struct.unpack_from("<2H3d", head, 35)
    return bool(major == 1 and minor < 10 and 1e-4 < mean < 100 and mean <= most < 1e6 and 1e-12 < scatter < 1e5)
