"""GSF ("Generic Sensor Format Specification", 03.06, Leidos 98-16v), ping by ping; big-endian, times in UTC.

gsfu decodes a record. It does not lead through the file: its index holds all records and refuses the whole file for the
first damaged one, and its iterator ends there. So records are found by :mod:`pipeline.readers.gsf_records`. Scale
factors are those of the last ping that had any; a file begins with them.

BEAM_ANGLE is, in the specification's words, the "incoming beam angle at transducer face" (table 4-3) and elsewhere the
"rotation from vertical" (4.3.4.9). The writers looked at (CARIS HIPS, gsfu's own converter) put the former there, not
roll corrected, whatever ROLL_COMPENSATED says, which is about depths; and positive to port, the first beam's side,
which the specification leaves open; here starboard +. How the fan was sent is not told, so it must be fixed to the
boat: refused are files that say that pitch or yaw were stabilised, that sectors were tilted, or that there are several
receivers or swaths (Kongsberg's newer sonars say so), and those whose distances along track show it
(:mod:`pipeline.readers.gsf_fans`); of files without such distances nothing is known.

Angles and times are 16-bit numbers in most files, and some writers overflow them: an angle then jumps by 65536 steps.
Pings in which two neighbouring beams lie more than 20 degrees apart, and ten times as far as is usual in the ping, are
left out, as are pings and beams flagged as not usable. The sound speed is the sensor's own of the ping, else that of
the last profile at its top, else session.yaml's.
"""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.readers.gsf_fans import Fans
from pipeline.readers.gsf_records import HEADER, PING, PROFILE, records
from pipeline.readers.raw_file import opened
from pipeline.readers.repeated_pings import Repeats
from pipeline.readers.row_checks import (
    MAX_SPEED_M_S,
    MBES_COLUMNS,
    MIN_SPEED_M_S,
    RowFilter,
    chunk,
    keep_possible_soundings,
    latency_ns,
    no_rows,
    possible_ns,
)

SOUNDINGS = 131_072  # a chunk has at least so many, and at most one ping more
PINGS = 8_192
TIME = struct.Struct(">2I")
MAX_BEAMS = np.iinfo(np.int16).max
UNUSABLE = 1  # bit of a ping's or a beam's flags
MAX_STEP_DEG = 20.0
NO_TILT_DEG = 0.005
STABILISED = 0b11  # of Kongsberg's modeAndStabilisation: pitch, yaw
SPEEDS = ("SurfaceVelocity_mps", "SoundSpeed_mps", "SoundVelocity_mps", "SoundSpeedAtTxDepth_mPerSec")
Scales = dict[int, tuple[float, float, int]]


class Ping(NamedTuple):
    """One ping record's soundings, all of them; degrees positive to port."""

    t_ns: int
    usable: NDArray[np.bool_]
    angle_deg: NDArray[np.float64]
    two_way_time_s: NDArray[np.float64]
    sound_speed_m_s: float | None  # as the sensor's own part of the record has it
    stabilised: bool = False
    tilt_deg: float = 0.0  # of the sector tilted most, where the sensor's own part tells it
    head: tuple[Any, ...] = ()  # receiver and swath, where the sensor's own part tells them
    places: tuple[Any, ...] = ()  # along, across, depth (n,) m each; roll, pitch in degrees; where the record has them
    lacks: str = ""  # what the record has not, without which there are no soundings


@dataclass(frozen=True)
class GsfPart:
    """One file; pings are numbered from 0, for not every sensor's record has a number."""

    path: Path
    name: str
    sound_speed_m_s: float | None  # for pings of a file that has none
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        pings: list[tuple[int, Ping, float]] = []
        waiting = 0
        with opened(self.path, self.name) as file:
            for number, ping, speed in self._pings(file, dropped):
                pings.append((number, ping, speed))
                waiting += len(ping.angle_deg)
                if waiting >= SOUNDINGS or len(pings) >= PINGS:
                    yield _chunk(pings, self.latency_s, dropped)
                    pings, waiting = [], 0
            if waiting:
                yield _chunk(pings, self.latency_s, dropped)
            if dropped:
                yield no_rows(MBES_COLUMNS, dropped)

    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[tuple[int, Ping, float]]:
        """Pings, their numbers, and the sound speeds at the head."""
        version, scales, profile_m_s, number = 3, Scales(), None, -1
        head: tuple[Any, ...] | None = None
        fans, repeats = Fans(), Repeats()
        for kind, body in records(file, dropped):
            if kind == HEADER:
                version = _version(body)
            elif kind == PROFILE:
                profile_m_s = top_of_profile(body)
            elif kind == PING:
                number += 1
                ping = decode(body, version, scales)
                if ping is None or (ping.lacks and number):
                    dropped["damaged record" if ping is None else "ping without times or angles"] += 1
                    continue
                if ping.lacks:
                    raise RawDataError(
                        f"{self.name}: its pings have no {ping.lacks}, only positions of soundings, and cannot be "
                        "used; export it again with travel times and beam angles, or give the sonar's own files"
                    )
                if not repeats.is_new(body, dropped):
                    continue
                head = ping.head if head is None else head
                self._refuse_other_fans(number, ping, head)
                if ping.places and _is_smooth(ping.angle_deg):
                    along, across, depth, *attitude = ping.places
                    fans.add(along[ping.usable], across[ping.usable], depth[ping.usable], *attitude)
                speed = ping.sound_speed_m_s or profile_m_s or self.sound_speed_m_s
                if speed is None:
                    raise RawDataError(
                        f"{self.name}: has no sound speed at the head, neither with its pings nor in a profile; give "
                        "mbes.sound_speed_m_s in session.yaml, the one that its beams were steered with"
                    )
                yield number, ping, speed
        fans.refuse(self.name)

    def _refuse_other_fans(self, number: int, ping: Ping, head: tuple[Any, ...]) -> None:
        if ping.stabilised:
            raise RawDataError(
                f"{self.name}: ping {number} was sent with pitch or yaw stabilisation: its fan has another direction "
                "in each ping, which GSF does not tell; give the sonar's own .kmall or .all, or switch both off and "
                "sail again"
            )
        if abs(ping.tilt_deg) > NO_TILT_DEG:
            raise RawDataError(
                f"{self.name}: ping {number} has sectors tilted by {ping.tilt_deg:.2f} degrees, and GSF does not tell "
                "which way the transmitter looks; give the sonar's own .kmall or .all"
            )
        if not number and len(ping.angle_deg) == 1:
            raise RawDataError(
                f"{self.name}: its pings are of one beam (a single-beam echo sounder), which sees no planes; give the "
                "files of a multibeam sonar"
            )
        if ping.head != head:
            raise RawDataError(
                f"{self.name}: has soundings of several receivers or swaths, each with a mount of its own; log one "
                "head alone, without dual swath"
            )


def _version(body: bytes) -> int:
    """The format's major version, from "GSF-v03.06"."""
    digits = body[5:7]
    return int(digits) if digits.isdigit() else 3


@np.errstate(all="ignore")
def decode(body: bytes, version: int, scales: Scales) -> Ping | None:
    """A ping record's contents; None where they contradict themselves. ``scales`` are carried from ping to ping."""
    from GSFU.gsfu import _decode_swath_bathymetry_ping

    try:
        seconds, nanoseconds = TIME.unpack_from(body)
        record: dict[str, Any] = _decode_swath_bathymetry_ping(body, version, scales)
    except (struct.error, LookupError, ValueError, OverflowError, ArithmeticError, OSError):
        return None
    beams, count = record["Beams"], record["NumberBeams"]
    undecoded = " ".join(record["Notes"])
    t_ns = int(gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0])
    for label, what in (("TravelTime_s", "travel times"), ("BeamAngle_deg", "beam angles")):
        if beams[label] is None and label not in undecoded:
            return Ping(t_ns, np.empty(0, bool), np.empty(0), np.empty(0), None, lacks=what)
    angles, times, flags = beams["BeamAngle_deg"], beams["TravelTime_s"], beams["BeamFlags"]
    if nanoseconds >= NS or any(values is None or len(values) != count for values in (angles, times)):
        return None
    if count > MAX_BEAMS:
        return None
    good = np.ones(count, dtype=bool) if flags is None or len(flags) != count else flags & UNUSABLE == 0
    usable = good & (record["PingFlags"] & UNUSABLE == 0)
    sensor = record.get("SensorSpecific") or {}
    stabilised = bool(sensor.get("ModeAndStabilisation", 0) & STABILISED)
    head = tuple(sensor.get(name) for name in ("RxTransducerInd", "SwathAlongPosition"))
    return Ping(t_ns, usable, angles, times, _speed_of(sensor), stabilised, _tilt_of(sensor), head, _places_of(record))


def _tilt_of(sensor: dict[str, Any]) -> float:
    """The largest tilt of a sector that a sensor's own part tells; 0 where it tells none."""
    sectors = sensor.get("TxSectors") or {}
    tilts = np.ravel(np.asarray(sectors.get("TiltAngleReTx_deg", sectors.get("TiltAngle_deg", 0.0)), dtype=np.float64))
    return float(tilts[np.argmax(np.abs(tilts))]) if len(tilts) else 0.0


def _places_of(record: dict[str, Any]) -> tuple[Any, ...]:
    found = [record["Beams"][name] for name in ("AlongTrack_m", "AcrossTrack_m", "Depth_m")]
    if any(values is None or len(values) != record["NumberBeams"] for values in found):
        return ()
    return (*found, record["Roll_deg"], record["Pitch_deg"])


def _speed_of(sensor: dict[str, Any]) -> float | None:
    """The sound speed in a sensor's own part of a ping, if it has one."""
    found = (float(sensor.get(name) or 0.0) for name in SPEEDS)
    return next((speed for speed in found if MIN_SPEED_M_S <= speed <= MAX_SPEED_M_S), None)


def top_of_profile(body: bytes) -> float | None:
    """The sound speed at the top of a profile, if it is one of water."""
    from GSFU.gsfu import _decode_sound_velocity_profile

    try:
        profile = _decode_sound_velocity_profile(body)
    except (struct.error, ValueError, OverflowError, OSError):
        return None
    depths, speeds = profile["Depth_m"], profile["SoundSpeed_mPerSec"]
    top = float(speeds[np.argmin(depths)]) if len(depths) else 0.0
    return top if MIN_SPEED_M_S <= top <= MAX_SPEED_M_S else None


@np.errstate(all="ignore")  # damaged numbers
def _is_smooth(angle_deg: NDArray[np.float64]) -> bool:
    steps = np.abs(np.diff(angle_deg))
    return bool(len(steps) < 2 or steps.max() <= max(MAX_STEP_DEG, 10 * float(np.median(steps))))


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(pings: list[tuple[int, Ping, float]], latency_s: float, dropped: Counter[str]) -> Chunk:
    counts = np.array([len(ping.angle_deg) for _, ping, _ in pings])

    def spread(values: Any, dtype: Any) -> NDArray[Any]:
        return np.repeat(np.asarray(values, dtype=dtype), counts)

    smooth = [_is_smooth(ping.angle_deg) for _, ping, _ in pings]
    sieve = RowFilter(
        {
            "t_ns": spread([ping.t_ns for _, ping, _ in pings], np.int64),
            "ping": spread([number for number, _, _ in pings], np.int64),
            "beam": np.concatenate([np.arange(count, dtype=np.int16) for count in counts]),
            "two_way_time_s": np.concatenate([ping.two_way_time_s for _, ping, _ in pings]),
            "angle_rad": -np.radians(np.concatenate([ping.angle_deg for _, ping, _ in pings])),
            "transmit_tilt_rad": np.zeros(counts.sum()),
            "sound_speed_m_s": spread([speed for _, _, speed in pings], np.float64),
            "usable": np.concatenate([ping.usable for _, ping, _ in pings]),
            "smooth": spread(smooth, bool),
        },
        dropped,
    )
    sieve.keep(sieve["usable"], "flagged as not usable")
    sieve.keep(sieve["smooth"], "angles of the ping jump")
    sieve.keep(possible_ns(sieve["t_ns"]), "impossible time (clock not set)")
    keep_possible_soundings(sieve)
    sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(latency_s)
    return chunk(sieve.columns, MBES_COLUMNS, dropped)
