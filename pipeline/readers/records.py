"""Checks that every reader's records go through."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.streams import Chunk
from pipeline.times import NS

Array = NDArray[np.float64]
Times = NDArray[np.int64]


def rows_or_none(rows: Sequence[Sequence[float]], width: int) -> Array:
    return np.array(rows, dtype=np.float64).reshape(-1, width)


def latency(t_ns: Times, latency_s: float) -> Times:
    """True time = recorded time - latency."""
    return t_ns - round(latency_s * NS)


def keep(columns: dict[str, NDArray[np.generic]], good: NDArray[np.bool_]) -> dict[str, NDArray[np.generic]]:
    return {name: values[good] for name, values in columns.items()}


def count(dropped: dict[str, int], reason: str, number: int) -> None:
    if number:
        dropped[reason] = dropped.get(reason, 0) + int(number)


def ins_columns(
    t_ns: Times,
    latency_s: float,
    latitude_deg: Array,
    longitude_deg: Array,
    height_m: Array,
    roll_deg: Array,
    pitch_deg: Array,
    azimuth_deg: Array,
    dropped: dict[str, int],
) -> Chunk:
    """Canonical INS columns from degrees; impossible records are left out and counted."""
    values = (latitude_deg, longitude_deg, height_m, roll_deg, pitch_deg, azimuth_deg)
    finite = np.all(np.isfinite(np.array(values)), axis=0) if len(t_ns) else np.zeros(0, dtype=bool)
    count(dropped, "not a number", int((~finite).sum()))
    possible = (
        finite
        & (np.abs(latitude_deg) < 89.999)
        & (np.abs(longitude_deg) <= 360)
        & (np.abs(height_m) < 20_000)
        & (np.abs(roll_deg) <= 180)
        & (np.abs(pitch_deg) <= 90)
        & (np.abs(azimuth_deg) <= 720)
        & (t_ns > 0)
    )
    count(dropped, "impossible position, attitude or time", int((finite & ~possible).sum()))
    columns: dict[str, NDArray[np.generic]] = {
        "t_ns": latency(t_ns, latency_s),
        "latitude_rad": np.radians(latitude_deg),
        "longitude_rad": np.radians(longitude_deg),
        "height_m": np.asarray(height_m, dtype=np.float64),
        "roll_rad": np.radians(roll_deg),
        "pitch_rad": np.radians(pitch_deg),
        "azimuth_rad": np.radians(azimuth_deg),
    }
    return Chunk(keep(columns, possible), dropped)


def sounding_columns(
    t_ns: Times,
    latency_s: float,
    ping: Times,
    beam: NDArray[np.int16],
    two_way_time_s: Array,
    angle_rad: Array,
    sound_speed_m_s: Array,
    dropped: dict[str, int],
) -> Chunk:
    """Canonical soundings; beams without detection and impossible ones are left out and counted."""
    none = two_way_time_s == 0
    count(dropped, "no detection", int(none.sum()))
    with np.errstate(invalid="ignore"):
        possible = (
            ~none
            & (two_way_time_s > 0)
            & (two_way_time_s < 10)
            & (np.abs(angle_rad) <= 1.9)
            & (sound_speed_m_s >= 1300)
            & (sound_speed_m_s <= 1700)
            & (t_ns > 0)
        )
    count(dropped, "impossible range, angle, sound speed or time", int((~none & ~possible).sum()))
    columns: dict[str, NDArray[np.generic]] = {
        "t_ns": latency(t_ns, latency_s),
        "ping": ping.astype(np.int64),
        "beam": beam.astype(np.int16),
        "two_way_time_s": two_way_time_s.astype(np.float64),
        "angle_rad": angle_rad.astype(np.float64),
        "sound_speed_m_s": sound_speed_m_s.astype(np.float64),
    }
    return Chunk(keep(columns, possible), dropped)
