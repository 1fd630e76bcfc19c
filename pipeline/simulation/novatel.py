"""NovAtel OEM INSPVA and INSPVAS records, binary and ASCII (OEM7 Commands and Logs Reference Manual)."""

import zlib
from dataclasses import dataclass

import numpy as np

from pipeline.gps_time import NS, WEEK_NS
from pipeline.simulation.ins import Columns

SHORT_HEADER = np.dtype([("sync", "u1", 3), ("length", "u1"), ("id", "<u2"), ("week", "<u2"), ("ms", "<u4")])
LONG_HEADER = np.dtype(
    [
        ("sync", "u1", 3), ("header_length", "u1"), ("id", "<u2"), ("type", "u1"), ("port", "u1"), ("length", "<u2"),
        ("sequence", "<u2"), ("idle", "u1"), ("time_status", "u1"), ("week", "<u2"), ("ms", "<u4"),
        ("receiver_status", "<u4"), ("reserved", "<u2"), ("software", "<u2"),
    ]
)
_BODY = np.dtype(
    [
        ("week", "<u4"), ("seconds", "<f8"), ("latitude", "<f8"), ("longitude", "<f8"), ("height", "<f8"),
        ("north", "<f8"), ("east", "<f8"), ("up", "<f8"), ("roll", "<f8"), ("pitch", "<f8"), ("azimuth", "<f8"),
        ("status", "<i4"),
    ]
)
_MESSAGE_IDS = {"inspva": 507, "inspvas": 508}
_ALIGNING, _GOOD = 1, 3
STATUS_NAMES = {_ALIGNING: "INS_ALIGNING", _GOOD: "INS_SOLUTION_GOOD"}
FINE_STEERING = 180
RADIUS_M = 6_378_137.0


@dataclass(frozen=True)
class Velocities:
    """Velocities of the INS, (n,) each, m/s."""

    north: np.ndarray
    east: np.ndarray
    up: np.ndarray


def velocities(ins: Columns) -> Velocities:
    """Return velocities over about a second, from the positions (to a few mm/s; no calibration uses them)."""
    t_ns = ins["t_ns"]
    half = np.searchsorted(t_ns, t_ns[0] + NS // 2) if len(t_ns) else 0
    row = np.arange(len(t_ns))
    before, after = np.maximum(row - half, 0), np.minimum(row + half, len(t_ns) - 1)
    seconds = np.maximum(t_ns[after] - t_ns[before], 1) / NS
    north, east, up = (
        (ins[name][after] - ins[name][before]) / seconds for name in ("latitude_rad", "longitude_rad", "height_m")
    )
    return Velocities(north * RADIUS_M, east * RADIUS_M * np.cos(ins["latitude_rad"]), up)


def inspva_bodies(ins: Columns) -> np.ndarray:
    """Return INSPVA(S) message bodies, angles in degrees, status INS_SOLUTION_GOOD."""
    body = np.zeros(len(ins["t_ns"]), _BODY)
    body["week"], body["seconds"] = ins["t_ns"] // WEEK_NS, ins["t_ns"] % WEEK_NS / NS
    speed = velocities(ins)
    body["north"], body["east"], body["up"] = speed.north, speed.east, speed.up
    for name in ("latitude", "longitude", "roll", "pitch", "azimuth"):
        body[name] = np.degrees(ins[f"{name}_rad"])
    body["height"], body["status"] = ins["height_m"], _GOOD
    return body


def aligning_bodies(first_ns: int, seconds: float) -> np.ndarray:
    """Return message bodies of an aligning INS, once a second before ``first_ns``: no position, latitude -90."""
    count = int(seconds)
    t_ns = first_ns - NS * np.arange(count, 0, -1, dtype=np.int64)
    body = np.zeros(count, _BODY)
    body["week"], body["seconds"] = t_ns // WEEK_NS, t_ns % WEEK_NS / NS
    body["latitude"], body["height"], body["status"] = -90.0, -6_356_752.3142, _ALIGNING
    return body


def crc32(data: bytes) -> int:
    """Return NovAtel's CRC: the usual polynomial, but started from zero and not inverted."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def novatel_bytes(body: np.ndarray, form: str) -> bytes:
    """Return records of the form inspvas, inspva (binary), inspvasa or inspvaa (ASCII)."""
    if form in ("inspvasa", "inspvaa"):
        return b"".join(_ascii(record, form) for record in body)
    header = _headers(body, form)
    stride, bare = header.dtype.itemsize, header.tobytes()
    inside = body.tobytes()
    records = []
    for k in range(len(body)):
        record = bare[k * stride : (k + 1) * stride] + inside[k * _BODY.itemsize : (k + 1) * _BODY.itemsize]
        records.append(record + crc32(record).to_bytes(4, "little"))
    return b"".join(records)


def _headers(body: np.ndarray, form: str) -> np.ndarray:
    header = np.zeros(len(body), SHORT_HEADER if form == "inspvas" else LONG_HEADER)
    header["sync"] = (0xAA, 0x44, 0x13 if form == "inspvas" else 0x12)
    header["length"], header["id"] = _BODY.itemsize, _MESSAGE_IDS[form]
    header["week"], header["ms"] = body["week"], np.rint(body["seconds"] * 1000)
    if form == "inspva":
        header["header_length"], header["port"], header["time_status"] = LONG_HEADER.itemsize, 0x20, FINE_STEERING
    return header


def _ascii(record: np.void, form: str) -> bytes:
    week, seconds = int(record["week"]), float(record["seconds"])
    if form == "inspvasa":
        mark, head = "%", f"INSPVASA,{week},{seconds:.3f}"
    else:
        mark, head = "#", f"INSPVAA,COM1,0,50.0,FINESTEERING,{week},{seconds:.3f},00000000,0000,16248"
    places = [f"{float(record[name]):.12f}" for name in ("latitude", "longitude")]
    values = [f"{float(record[name]):.9f}" for name in ("height", "north", "east", "up", "roll", "pitch", "azimuth")]
    status = STATUS_NAMES[int(record["status"])]
    text = f"{head};" + ",".join([str(week), f"{seconds:.9f}", *places, *values, status])
    return f"{mark}{text}*{crc32(text.encode('ascii')):08x}\r\n".encode("ascii")
