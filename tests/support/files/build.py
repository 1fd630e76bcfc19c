"""Instrument files made byte by byte from their published layouts, independent of readers and simulator."""

import struct
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.config.mount import Mount
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.readers.dispatch import raw_parts

MOUNT = Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, x_m=0.0, y_m=0.0, z_m=0.0)
WEEK = 2300
UTC_2024 = 1_714_521_600  # Unix time of 2024-05-01 00:00:00 UTC
GPS_2024 = UTC_2024 - 315_964_800 + 18


# --- reading ---------------------------------------------------------------------------------------------------------
def settings(sensor: str, files: Iterable[str], kind: Any, **more: Any) -> Ins | Laser | Mbes:
    if sensor == "ins":
        return Ins(files=list(files), format=kind, **more)
    if sensor == "laser":
        return Laser(files=list(files), format=kind, mount=MOUNT, **more)
    return Mbes(files=list(files), format=kind, mount=MOUNT, **more)


def read(sensor: Any, path: Path, kind: str, **more: Any) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    """All rows of a file, and what was left out by reason."""
    dropped: dict[str, int] = {}
    columns: list[Any] = []
    for part in raw_parts(sensor, settings(sensor, [path.name], kind, **more), path.parent):
        for chunk in part.chunks():
            assert len({len(values) for values in chunk.columns.values()}) <= 1
            columns += [chunk.columns] if chunk.columns else []
            for reason, number in chunk.dropped.items():
                assert number > 0
                dropped[reason] = dropped.get(reason, 0) + number
    names = columns[0] if columns else {}
    return {name: np.concatenate([piece[name] for piece in columns]) for name in names}, dropped


def rows(columns: dict[str, np.ndarray]) -> int:
    return len(next(iter(columns.values()), []))


# --- R2Sonic ---------------------------------------------------------------------------------------------------------
def section(name: bytes, body: bytes) -> bytes:
    body += bytes(-len(body) % 4)
    return struct.pack(">2sH", name, 4 + len(body)) + body


def bth0(*sections: bytes, stream: int = 0) -> bytes:
    inside = b"".join(sections)
    return struct.pack(">4sII", b"BTH0", 12 + len(inside), stream) + inside


def h0(
    ping: int,
    points: int,
    seconds: int = UTC_2024,
    nanoseconds: int = 0,
    sound_speed: float = 1500.0,
    steering: float = 0.0,
) -> bytes:
    head = b"2024".ljust(12, b"\0") + b"100017".ljust(12, b"\0")
    head += struct.pack(">III", seconds, nanoseconds, ping) + struct.pack(">ff", 0.05, sound_speed)
    head += struct.pack(">7f", 400e3, 191.0, 15e-6, 0.017, 2.2, steering, 0.0) + struct.pack(">Hh", 29315, 0)
    head += struct.pack(">7f", 60e3, 78125.0, 30.0, 5.0, 20.0, 100.0, 0.0) + struct.pack(">IHH", 0, 0, points)
    return section(b"H0", head)


def scaled(name: bytes, scale: float, values: Sequence[int]) -> bytes:
    return section(name, struct.pack(f">f{len(values)}H", scale, *values))


def a0(first: float, last: float) -> bytes:
    return section(b"A0", struct.pack(">8f", first, last, 0.01, 0.119, 0.0, 0.0, 0.0, 0.0))


def a2(first: float, scale: float, steps: Sequence[int]) -> bytes:
    return section(b"A2", struct.pack(f">8f{len(steps)}H", first, scale, 0.01, 0.119, 0.0, 0.0, 0.0, 0.0, *steps))


def ping(number: int, points: int = 5, **head: Any) -> bytes:
    """A whole packet as the sonar sends it: equidistant angles, intensities, gates, quality flags."""
    ticks = [1000 + 10 * beam for beam in range(points)]
    return bth0(
        h0(number, points, **head),
        scaled(b"R0", 4e-6, ticks),
        a2(-0.5, 1e-4, [0] + [min(2000, 16_000 // points)] * (points - 1)),
        scaled(b"I1", 1000.0, [2000] * points),
        section(b"G0", struct.pack(">3f", 1e-4, 0.1, 0.0)),
        section(b"Q0", bytes((points + 7) // 8 * 4)),
    )


def xtf_header() -> bytes:
    return struct.pack("<BB8s8s16sH", 0x7B, 1, b"test", b"1", b"sonar", 0).ljust(1024, b"\0")


def xtf_record(kind: int, body: bytes) -> bytes:
    body += bytes(-(len(body) + 14) % 64)
    return struct.pack("<HBBHHHI", 0xFACE, kind, 0, 1, 0, 0, 14 + len(body)) + body


def xtf(*packets: bytes, kind: int = 65) -> bytes:
    return xtf_header() + b"".join(xtf_record(kind, bytes(242) + packet) for packet in packets)


# --- NovAtel ---------------------------------------------------------------------------------------------------------
GOOD, ALIGNING, HIGH_VARIANCE, FREE, COMPLETE = 3, 1, 2, 6, 7
STATUS = {GOOD: "INS_SOLUTION_GOOD", ALIGNING: "INS_ALIGNING", FREE: "INS_SOLUTION_FREE"}


def crc(data: bytes) -> int:
    """As in NovAtel's manual, bit by bit."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ (0xEDB88320 if value & 1 else 0)
    return value


def with_crc(record: bytes) -> bytes:
    return record + struct.pack("<I", crc(record))


def short(number: int, week: int, seconds: float, body: bytes) -> bytes:
    return with_crc(struct.pack("<3sBHHI", b"\xaa\x44\x13", len(body), number, week, round(seconds * 1000)) + body)


def long(number: int, week: int, seconds: float, body: bytes) -> bytes:
    head = struct.pack("<3sBHBBHHBBHIIHH", b"\xaa\x44\x12", 28, number, 0, 0x20, len(body), 0, 0, 180, week,
                       round(seconds * 1000), 0, 0, 16248)  # fmt: skip
    return with_crc(head + body)


def pva(seconds: float, week: int = WEEK, status: int = GOOD, height: float = 50.0, **angles: float) -> bytes:
    """Body of INSPVA and INSPVAS."""
    values = (angles.get("latitude", 36.0), angles.get("longitude", 120.0), height, 0.1, 0.2, 0.3)
    attitude = (angles.get("roll", 1.0), angles.get("pitch", 2.0), angles.get("azimuth", 3.0))
    return struct.pack("<Id3d3d3dI", week, seconds, *values, *attitude, status)


def pvax(
    status: int = GOOD, height: float = 40.0, undulation: float = 10.0, sigmas: Sequence[float] = (0.01,) * 9
) -> bytes:
    """Body of INSPVAX: height above sea level, and undulation."""
    return struct.pack(
        "<II3df3d3d9fIH", status, 56, 36.0, 120.0, height, undulation, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0, *sigmas, 0, 0
    )


def inspvas(seconds: float, **body: Any) -> bytes:
    return short(508, body.get("week", WEEK), seconds, pva(seconds, **body))


def inspva(seconds: float, **body: Any) -> bytes:
    return long(507, body.get("week", WEEK), seconds, pva(seconds, **body))


def inspvax(seconds: float, week: int = WEEK, **body: Any) -> bytes:
    return long(1465, week, seconds, pvax(**body))


SIGMAS = (0.011, 0.012, 0.023, 0.1, 0.2, 0.3, 0.006, 0.007, 0.031)  # N, E, up; velocities; roll, pitch, azimuth


def stdev(sigmas: Sequence[float] = SIGMAS) -> bytes:
    """Body of INSSTDEV and INSSTDEVS."""
    return struct.pack("<9fIHHII", *sigmas, 0, 0, 0, 0, 0)


def insstdev(seconds: float, sigmas: Sequence[float] = SIGMAS, week: int = WEEK) -> bytes:
    return long(2051, week, seconds, stdev(sigmas))


def insstdevs(seconds: float, sigmas: Sequence[float] = SIGMAS, week: int = WEEK) -> bytes:
    return short(2052, week, seconds, stdev(sigmas))


def insstdeva(seconds: float, sigmas: Sequence[float] = SIGMAS, week: int = WEEK) -> bytes:
    told = ",".join(f"{sigma:.4f}" for sigma in sigmas)
    head = f"INSSTDEVA,COM1,0,0.0,FINESTEERING,{week},{seconds:.3f},00000000,3deb,16248"
    inside = f"{head};{told},00000000,0,0,00000000,0"
    return f"#{inside}*{crc(inside.encode()):08x}\r\n".encode()


def bestpos(seconds: float) -> bytes:
    place = (36.0, 120.0, 40.0, 10.0, 61.0)
    body = struct.pack("<II3dff3f4sff8B", 0, 56, *place, 1.0, 1.0, 1.0, b"0\0\0\0", 0.0, 0.0, *[9] * 8)
    return long(42, WEEK, seconds, body)


def inspvasa(seconds: float, week: int = WEEK, status: int = GOOD) -> bytes:
    inside = (
        f"INSPVASA,{week},{seconds:.3f};{week},{seconds:.9f},36.00000000000,120.00000000000,50.0000,"
        f"0.1000,0.2000,0.3000,1.000000000,2.000000000,3.000000000,{STATUS[status]}"
    )
    return f"%{inside}*{crc(inside.encode()):08x}\r\n".encode()


# --- SBET ------------------------------------------------------------------------------------------------------------
def sbet_row(seconds: float, heading: float = 1.0, wander: float = 0.25) -> list[float]:
    return [seconds, 0.6, 2.0, 50.0, 0.1, 0.2, 0.3, 0.01, 0.02, heading, wander, 0.0, 0.0, -9.8, 0.0, 0.0, 0.0]


def sbet(*seconds: float) -> bytes:
    return b"".join(struct.pack("<17d", *sbet_row(second)) for second in seconds)


def smrmsg(*seconds: float, rms: Sequence[float] = (0.01, 0.02, 0.03, 0.1, 0.1, 0.1, 0.6, 0.9, 1.8)) -> bytes:
    """Accuracies: north, east, down; velocities; roll, pitch, heading in arc-minutes."""
    return b"".join(struct.pack("<10d", second, *rms) for second in seconds)


# --- LAS -------------------------------------------------------------------------------------------------------------
def las(
    points: Sequence[tuple[int, int, int, float]],
    adjusted: bool = True,
    claimed: int | None = None,
    point_format: int = 6,
    scale: float = 0.001,
) -> bytes:
    """LAS 1.4 with integer coordinates and GPS times."""
    length = 30 if point_format == 6 else 20
    count = len(points) if claimed is None else claimed
    head = struct.pack("<4sHH16sBB32s32sHHHII", b"LASF", 0, int(adjusted), b"", 1, 4, b"", b"", 1, 2024, 375, 375, 0)
    head += struct.pack("<BHI5I", point_format, length, min(count, 2**32 - 1) if point_format < 6 else 0, *[0] * 5)
    head += struct.pack("<12d", scale, scale, scale, 0.0, 0.0, 0.0, *[0.0] * 6)
    head += struct.pack("<QQIQ15Q", 0, 0, 0, count, *[0] * 15)
    assert len(head) == 375
    if point_format == 6:
        body = [struct.pack("<3iHBBBBhHd", x, y, z, 7, 0x11, 0, 1, 0, 0, 0, time) for x, y, z, time in points]
    else:
        body = [struct.pack("<3iHBBbBH", x, y, z, 7, 9, 1, 0, 0, 0) for x, y, z, _ in points]
    return head + b"".join(body)
