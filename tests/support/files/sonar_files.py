"""GSF, .kmall and .all files made byte by byte from their published layouts, independent of readers and libraries."""

import struct
from collections.abc import Sequence

from tests.support.files.build import UTC_2024


# --- GSF -------------------------------------------------------------------------------------------------------------
def record(kind: int, body: bytes, checked: bool = False) -> bytes:
    body += bytes(-len(body) % 4)
    total = struct.pack(">I", sum(body) & 0xFFFFFFFF) if checked else b""
    return struct.pack(">II", len(body), kind | (checked << 31)) + total + body


def gsf_header() -> bytes:
    return record(1, b"GSF-v03.06\0\0")


def profile(*points: tuple[float, float]) -> bytes:
    """A sound velocity profile: depth [m], speed [m/s]."""
    body = struct.pack(">4I2iI", UTC_2024, 0, UTC_2024, 0, 0, 0, len(points))
    return record(3, body + b"".join(struct.pack(">2I", round(d * 100), round(c * 100)) for d, c in points))


def subrecord(number: int, body: bytes) -> bytes:
    return struct.pack(">I", number << 24 | len(body)) + body


def scale_factors(**factors: tuple[int, int]) -> bytes:
    """Multiplier and offset of times and angles."""
    numbers = {"depth": 1, "across": 2, "along": 3, "time": 4, "angle": 5}
    table = [struct.pack(">BBHIi", numbers[name], 0, 0, *pair) for name, pair in factors.items()]
    return subrecord(100, struct.pack(">I", len(table)) + b"".join(table))


def seabat(speed_m_s: float) -> bytes:
    """A SeaBat's part of a ping: number, surface velocity in 0.1 m/s, mode, range, power, gain."""
    return subrecord(110, struct.pack(">HHBBBB", 7, round(speed_m_s * 10), 0, 50, 3, 4))


SCALES = scale_factors(time=(1_000_000, 0), angle=(100, 0))


def gsf_ping(
    k: int = 0,
    times: Sequence[int] | None = (9000, 8000, 7000, 8000, 9000),
    angles: Sequence[int] | None = (6000, 3000, 0, -3000, -6000),
    extra: bytes = b"",
    flags: Sequence[int] = (),
    ping_flags: int = 0,
    seconds: int = UTC_2024,
    beams: int = 5,
    checked: bool = False,
    unix_ns: int | None = None,
    wide: bool = False,
    attitude_deg: tuple[float, float] = (0.0, 0.0),
) -> bytes:
    """By SCALES times are in microseconds and angles in hundredths of a degree, port +. ``wide``: times in 4 bytes;
    ``attitude_deg``: pitch and roll."""
    place = (1_201_000_000, 360_000_000)
    when = divmod(unix_ns, 10**9) if unix_ns is not None else (seconds + k, 250_000_000)
    body = struct.pack(">2I2i4H", *when, *place, beams, beams // 2, ping_flags, 0)
    pitch, roll = (round(angle * 100) for angle in attitude_deg)
    body += struct.pack(">hiH3h2H3ih", 0, 0, 9000, pitch, roll, 0, 0, 0, 0, 0, 0, 0)
    body += extra
    if times is not None:
        body += subrecord(4, struct.pack(f">{len(times)}{'I' if wide else 'H'}", *times))
    if angles is not None:
        body += subrecord(5, struct.pack(f">{len(angles)}h", *angles))
    if flags:
        body += subrecord(16, bytes(flags))
    return record(2, body, checked)


PLACED = scale_factors(depth=(1000, 0), across=(1000, 0), along=(1000, 0), time=(1_000_000, 0), angle=(100, 0))


def gsf_placed(k: int, places_m: Sequence[Sequence[float]], attitude_deg: tuple[float, float]) -> bytes:
    """A ping that tells where its beams lie: along track, across track, depth of each."""
    along, across, depth = ([round(1000 * value) for value in values] for values in zip(*places_m, strict=True))
    beams = len(along)
    extra = PLACED + seabat(1480.0)
    extra += subrecord(1, struct.pack(f">{beams}H", *depth)) + subrecord(2, struct.pack(f">{beams}h", *across))
    extra += subrecord(3, struct.pack(f">{beams}h", *along))
    angles = [6000 - 12_000 * n // (beams - 1) for n in range(beams)]
    return gsf_ping(k, [9000] * beams, angles, extra, beams=beams, attitude_deg=attitude_deg)


def gsf(count: int = 6, speed_m_s: float = 1480.0) -> bytes:
    """Pings a second apart; the first alone has the scale factors."""
    pings = [gsf_ping(k, extra=(SCALES if not k else b"") + seabat(speed_m_s)) for k in range(count)]
    return gsf_header() + b"".join(pings)


# --- Kongsberg -------------------------------------------------------------------------------------------------------
def datagram(kind: bytes, body: bytes, seconds: int = UTC_2024, nanoseconds: int = 0, version: int = 3) -> bytes:
    size = 20 + len(body) + 4
    head = struct.pack("<I4sBBHII", size, kind, version, 0, 2040, seconds, nanoseconds)
    return head + body + struct.pack("<I", size)


def sounding(index: int, angle_deg: float, time_s: float, sector: int = 0, kind: int = 0, size: int = 120) -> bytes:
    """One of an #MRZ datagram; what the reader has no use for holds a number that would be seen."""
    head = struct.pack("<H8BH", index, sector, kind, 1, 0, 0, 0, 0, 0, 0)
    quality = struct.pack("<6f2H", *[77.0] * 6, 0, 0)
    levels = struct.pack("<8f", *[88.0] * 8)
    geometry = struct.pack("<4f", angle_deg, 0.0, time_s, 0.0)
    place = struct.pack("<6f4H", *[99.0] * 6, 0, 0, 0, 0)
    return (head + quality + levels + geometry + place).ljust(size, b"\0")


def mrz(
    ping: int,
    soundings: Sequence[bytes],
    delays_s: Sequence[float] = (0.0,),
    tilts_deg: Sequence[float] = (),
    subarrays: Sequence[int] = (),
    speed_m_s: float = 1480.0,
    mode: int = 0,
    swath: int = 0,
    receiver: int = 0,
    parts: int = 1,
    size: int = 120,
    extra: int = 0,
    **head: int,
) -> bytes:
    """``extra``: how many of the soundings are extra detections; ``tilts_deg``: in the transmitter's frame."""
    tilts = tilts_deg or [0.0] * len(delays_s)
    parts_of_array = subarrays or [1] * len(delays_s)
    common = struct.pack("<2H2H8B", parts, 1, 12, ping, 1, receiver, 1, swath, 0, receiver, 1, 0)
    info = struct.pack("<2Hf6BH11f", 152, 0, 20.0, 0, 0, 0, 0, 0, 0, 0, *[55.0] * 11)
    info += struct.pack("<2h2BHI3f2Hf2H", 0, 0, mode, 0, 0, 0, 1.0, 1.0, 0.0, 0, 0, 0.0, len(delays_s), 48)
    info += struct.pack("<6f4B2df", 90.0, speed_m_s, 1.0, 0.0, 0.0, 0.0, 0, 0, 0, 0, 36.0, 120.1, 12.0)
    info = info.ljust(152, b"\0")
    sectors = [
        struct.pack("<4B7f2BH3f", k, 0, part, 0, delay, tilt, *[44.0] * 5, 0, 0, 0, *[33.0] * 3)
        for k, (delay, tilt, part) in enumerate(zip(delays_s, tilts, parts_of_array, strict=True))
    ]
    receive = struct.pack("<4H4f4H", 32, len(soundings) - extra, len(soundings), size, *[22.0] * 4, 0, extra, 1, 4)
    body = common + info + b"".join(sectors) + receive + bytes(4) + b"".join(soundings)
    return datagram(b"#MRZ", body, **head)


def iip(transmitter: str, receiver: str, name: str = "X1") -> bytes:
    """An installation with one array of each kind: "X=0.1;Y=0;Z=0;R=0;P=0;H=180" and so on."""
    text = f"OSCV:Empty,EMXV:EM2042,TRAI_T{name}:N=1;{transmitter},TRAI_R{name}:N=2;{receiver},ATTI_1:X=9.0;R=9.0,"
    return datagram(b"#IIP", struct.pack("<3H", 6 + len(text), 0, 0) + text.encode(), version=0)


ANGLES_DEG = (60.0, 30.0, 0.0, -30.0, -60.0)  # port +


def kmall(count: int = 6) -> bytes:
    """Pings a second apart, with other datagrams between them."""
    found = [datagram(b"#IIP", b"\x10\0\0\0\0\0" + b"OSCV:Empty", version=0)]
    for k in range(count):
        fan = [sounding(n, angle, 0.007 + 1e-4 * n) for n, angle in enumerate(ANGLES_DEG)]
        found += [mrz(500 + k, fan, seconds=UTC_2024 + k, nanoseconds=250_000_000), datagram(b"#SKM", bytes(40))]
    return b"".join(found)


def kmall_sectors(count: int = 3) -> bytes:
    """Sectors of their own tilts, of a transmitter that looks aft and lies apart from the receiver."""
    found = [iip("X=0.3;Y=-0.1;Z=0;R=1;P=2;H=181;IPY=-0.05;ISY=0.05", "X=0;Y=0;Z=0;R=0;P=-1;H=0.5")]
    for k in range(count):
        fan = [sounding(n, angle, 0.007, sector=n // 2) for n, angle in enumerate(ANGLES_DEG)]
        found.append(mrz(k, fan, (0.0, 2e-4, 4e-4), (-0.45, -0.75, -0.45), (2, 1, 0), seconds=UTC_2024 + k))
    return b"".join(found)


# --- Kongsberg .all --------------------------------------------------------------------------------------------------
def all_datagram(kind: str, number: int, body: bytes, **head: int) -> bytes:
    """UTC_2024 is 2024-05-12 00:00:00 UTC or later on that day: seconds count from there."""
    told = {"model": 2040, "date": 20240512, "milliseconds": 36_000_000, "serial": 77} | head
    inside = struct.pack(
        "<BHIIHH", ord(kind), told["model"], told["date"], told["milliseconds"], number, told["serial"]
    )
    inside += body
    inside += b"\0" * (len(inside) % 2 == 0)  # an even length of the whole
    whole = b"\2" + inside + b"\3" + struct.pack("<H", sum(inside) & 0xFFFF)
    return struct.pack("<I", len(whole)) + whole


TRANSMITTER = "S1X=0.00,S1Y=0.00,S1Z=0.00,S1H=0.00,S1P=0.00,S1R=0.00"
RECEIVER = TRANSMITTER.replace("S1", "S2")


def all_installation(text: str = f"STC=0,{TRANSMITTER},{RECEIVER}", **head: int) -> bytes:
    return all_datagram("I", 1, struct.pack("<H", 0) + f"WLZ=0.00,SMH=77,{text},".encode(), **head)


def raw_ranges(
    number: int,
    beams: Sequence[tuple[float, int, float]],
    tilts_deg: Sequence[float] = (0.0,),
    delays_s: Sequence[float] = (),
    parts: Sequence[int] = (),
    flags: Sequence[tuple[int, int]] = (),
    speed_m_s: float = 1480.0,
    **head: int,
) -> bytes:
    """Datagram N. ``beams``: angle [degrees, port +], sector, two-way time [s]; ``flags``: detection info, cleaning."""
    delays, places = delays_s or [0.0] * len(tilts_deg), parts or [1] * len(tilts_deg)
    body = struct.pack("<4HfI", round(speed_m_s * 10), len(tilts_deg), len(beams), len(beams), 30_000.0, 0)
    for tilt, delay, place in zip(tilts_deg, delays, places, strict=True):
        body += struct.pack("<hH3fH2Bf", round(tilt * 100), 322, 44.0, delay, 55.0, 66, 0, place, 77.0)
    for (angle, sector, time), (info, cleaning) in zip(beams, flags or [(0, 0)] * len(beams), strict=True):
        body += struct.pack("<hBBHBbfhbB", round(angle * 100), sector, info, 99, 9, -9, time, -99, cleaning, 0)
    return all_datagram("N", number, body, **head)


def kongsberg_all(count: int = 6) -> bytes:
    """Pings a second apart, with other datagrams between them; a transmitter that looks aft."""
    found = [all_installation(f"STC=0,{TRANSMITTER.replace('S1H=0', 'S1H=180')},{RECEIVER}")]
    for k in range(count):
        fan = [(angle, n // 2, 0.007 + 1e-4 * n) for n, angle in enumerate(ANGLES_DEG)]
        when = 36_000_000 + 1000 * k + 250
        found.append(raw_ranges(500 + k, fan, (0.5, 1.25, -0.5), (0.0, 2e-4, 4e-4), (2, 1, 0), milliseconds=when))
        found.append(all_datagram("A", k, bytes(30), milliseconds=when))
    return b"".join(found)
