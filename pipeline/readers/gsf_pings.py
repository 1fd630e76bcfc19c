"""Contents of GSF's ping and profile records, decoded by gsfu.

A ping without scale factors uses those of the last ping that has them; the first ping of a file has them. The
sensor-specific subrecord of a ping may hold the sound speed, stabilisation modes, tilts of sectors, and receiver.
"""

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.readers.gsf_fans import BeamPositions
from pipeline.readers.row_checks import MAX_SPEED_M_S, MIN_SPEED_M_S
from pipeline.readers.sounding_chunks import MAX_BEAMS

TIME = struct.Struct(">2I")
UNUSABLE = 1  # bit of a ping's or a beam's flags
MAX_STEP_DEG = 20.0
STABILISED = 0b11  # bits of Kongsberg's modeAndStabilisation: pitch, yaw
SPEEDS = ("SurfaceVelocity_mps", "SoundSpeed_mps", "SoundVelocity_mps", "SoundSpeedAtTxDepth_mPerSec")
GsfScales = dict[int, tuple[float, float, int]]


@dataclass(frozen=True)
class GsfPing:
    """All soundings (n,) of one ping record; angles are positive to port."""

    t_ns: int
    usable: NDArray[np.bool_]
    angle_deg: NDArray[np.float64]
    two_way_time_s: NDArray[np.float64]
    sound_speed_m_s: float | None = None  # None: not recorded
    stabilised: bool = False
    tilt_deg: float = 0.0  # of the sector with the largest tilt; 0: not recorded
    receiver_and_swath: tuple[Any, ...] = ()  # two numbers; None in place of a number that is not recorded
    positions: BeamPositions | None = None  # None: not recorded
    missing: str = ""  # values that the record lacks, and without which it has no soundings; empty: none


@np.errstate(all="ignore")  # damaged numbers
def angles_are_smooth(angle_deg: NDArray[np.float64]) -> bool:
    """Return whether the angles of a ping are free of jumps, which the overflow of a 16-bit number causes."""
    steps_deg = np.abs(np.diff(angle_deg))
    return bool(len(steps_deg) < 2 or steps_deg.max() <= max(MAX_STEP_DEG, 10 * float(np.median(steps_deg))))


def major_version(header: bytes) -> int:
    """Return the format's major version from a header record such as "GSF-v03.06"; 3 if it has no digits."""
    digits = header[5:7]
    return int(digits) if digits.isdigit() else 3


@np.errstate(all="ignore")
def decoded_record(body: bytes, version: int, scales: GsfScales) -> dict[str, Any] | None:
    """Return a ping record as gsfu decodes it; None if the record is damaged. Parameters as of decode_gsf_ping."""
    from GSFU.gsfu import _decode_swath_bathymetry_ping

    try:
        TIME.unpack_from(body)
        record: dict[str, Any] = _decode_swath_bathymetry_ping(body, version, scales)
    except (struct.error, LookupError, ValueError, OverflowError, ArithmeticError, OSError):
        return None
    return record


@np.errstate(all="ignore")
def decode_gsf_ping(body: bytes, version: int, scales: GsfScales) -> GsfPing | None:
    """Return a ping record's contents; None if the record is damaged.

    Parameters
    ----------
    body
        The record's bytes.
    version
        The format's major version.
    scales
        Scale factors of the preceding pings; changed in place if the record has its own.
    """
    record = decoded_record(body, version, scales)
    if record is None:
        return None
    seconds, nanoseconds = TIME.unpack_from(body)
    beams, count = record["Beams"], record["NumberBeams"]
    undecoded = " ".join(record["Notes"])
    t_ns = int(gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0])
    for label, title in (("TravelTime_s", "travel times"), ("BeamAngle_deg", "beam angles")):
        if beams[label] is None and label not in undecoded:
            return GsfPing(t_ns, np.empty(0, bool), np.empty(0), np.empty(0), missing=title)
    angles, times, flags = beams["BeamAngle_deg"], beams["TravelTime_s"], beams["BeamFlags"]
    if nanoseconds >= NS or any(values is None or len(values) != count for values in (angles, times)):
        return None
    if count > MAX_BEAMS:
        return None
    unflagged = np.ones(count, dtype=bool) if flags is None or len(flags) != count else flags & UNUSABLE == 0
    sensor = record.get("SensorSpecific") or {}
    return GsfPing(
        t_ns=t_ns,
        usable=unflagged & (record["PingFlags"] & UNUSABLE == 0),
        angle_deg=angles,
        two_way_time_s=times,
        sound_speed_m_s=_sound_speed(sensor),
        stabilised=bool(sensor.get("ModeAndStabilisation", 0) & STABILISED),
        tilt_deg=_largest_tilt_deg(sensor),
        receiver_and_swath=tuple(sensor.get(name) for name in ("RxTransducerInd", "SwathAlongPosition")),
        positions=_positions(record),
    )


def _largest_tilt_deg(sensor: dict[str, Any]) -> float:
    """Return the largest tilt of a sector in a sensor-specific subrecord; 0 if it has no tilts."""
    sectors = sensor.get("TxSectors") or {}
    tilts = np.ravel(np.asarray(sectors.get("TiltAngleReTx_deg", sectors.get("TiltAngle_deg", 0.0)), dtype=np.float64))
    return float(tilts[np.argmax(np.abs(tilts))]) if len(tilts) else 0.0


def _positions(record: dict[str, Any]) -> BeamPositions | None:
    along_m, across_m, depth_m = (record["Beams"][name] for name in ("AlongTrack_m", "AcrossTrack_m", "Depth_m"))
    if any(values is None or len(values) != record["NumberBeams"] for values in (along_m, across_m, depth_m)):
        return None
    return BeamPositions(along_m, across_m, depth_m, record["Roll_deg"], record["Pitch_deg"])


def _sound_speed(sensor: dict[str, Any]) -> float | None:
    """Return the sound speed [m/s] in a sensor-specific subrecord; None if it has no possible one."""
    speeds = (float(sensor.get(name) or 0.0) for name in SPEEDS)
    return next((speed for speed in speeds if MIN_SPEED_M_S <= speed <= MAX_SPEED_M_S), None)


def top_of_profile(body: bytes) -> float | None:
    """Return the sound speed [m/s] at the top of a profile record; None if it is impossible in water, or damaged."""
    from GSFU.gsfu import _decode_sound_velocity_profile

    try:
        profile = _decode_sound_velocity_profile(body)
    except (struct.error, ValueError, OverflowError, OSError):
        return None
    depths, speeds = profile["Depth_m"], profile["SoundSpeed_mPerSec"]
    top = float(speeds[np.argmin(depths)]) if len(depths) else 0.0
    return top if MIN_SPEED_M_S <= top <= MAX_SPEED_M_S else None
