"""What every reader asks of its rows, whatever the format: finite, possible, in order of time. Nothing is repaired."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS

Columns = dict[str, NDArray[Any]]
Mask = NDArray[np.bool_]

INS_COLUMNS = ("t_ns", "latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")
LASER_COLUMNS = ("t_ns", "x_m", "y_m", "z_m")
MBES_COLUMNS = ("t_ns", "ping", "beam", "two_way_time_s", "angle_rad", "transmit_tilt_rad", "sound_speed_m_s")
SIGMA_COLUMNS = ("t_ns", "north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
TYPES = {"t_ns": np.int64, "ping": np.int64, "beam": np.int16}

FIRST_WEEK, LAST_WEEK = 1000, 5000  # as in config: March 1999 to 2075
MAX_ANGLE_RAD = 1.2 * np.pi / 2
MAX_TILT_RAD = np.pi / 4
MIN_SPEED_M_S, MAX_SPEED_M_S = 1300.0, 1700.0
MAX_TRAVEL_S = 20.0
MAX_HEIGHT_M = 20_000.0
MAX_BACKWARDS_SHARE = 0.01
MAX_SIGMA = {"m": 10.0, "deg": 45.0}  # as in config


def chunk(
    columns: Mapping[str, NDArray[Any]],
    names: tuple[str, ...],
    dropped: Counter[str],
    sigmas: Mapping[str, NDArray[Any]] | None = None,
) -> Chunk:
    """A chunk with exactly the canonical columns and types; ``dropped`` starts again from nothing."""
    typed = {name: np.ascontiguousarray(columns[name], dtype=TYPES.get(name, np.float64)) for name in names}
    counts = {reason: number for reason, number in dropped.items() if number}
    dropped.clear()
    return Chunk(typed, counts, sigmas or {})


def no_rows(names: tuple[str, ...], dropped: Counter[str]) -> Chunk:
    """A chunk that only tells what was left out."""
    return chunk({name: np.empty(0) for name in names}, names, dropped)


@dataclass
class RowFilter:
    """Equally long columns that lose rows, test by test; each test's losses are counted under its reason."""

    columns: Columns
    dropped: Counter[str]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def keep(self, good: Mask, reason: str) -> None:
        lost = len(good) - int(np.count_nonzero(good))
        if lost:
            self.dropped[reason] += lost
            self.columns = {name: values[good] for name, values in self.columns.items()}

    def keep_finite(self) -> None:
        good = np.ones(len(self), dtype=bool)
        for values in self.columns.values():
            if values.dtype.kind == "f":
                good &= np.isfinite(values)
        self.keep(good, "not a finite number")


def possible_week_time(week: NDArray[Any], seconds: NDArray[Any]) -> Mask:
    """Weeks as accepted in session.yaml; seconds may run on beyond the end of their week, by one week at most."""
    good: Mask = (week >= FIRST_WEEK) & (week <= LAST_WEEK) & (seconds >= 0) & (seconds < 2 * WEEK_NS / NS)
    return good


def possible_ns(t_ns: NDArray[np.int64]) -> Mask:
    good: Mask = (t_ns >= FIRST_WEEK * WEEK_NS) & (t_ns <= LAST_WEEK * WEEK_NS)
    return good


def latency_ns(latency_s: float) -> int:
    return round(latency_s * NS)


def keep_possible_poses(sieve: RowFilter) -> None:
    """INS rows (t_ns not needed yet): a position on the earth, angles of an attitude. Azimuths go to [0, 2 pi)."""
    sieve.keep_finite()
    latitude, longitude = sieve["latitude_rad"], sieve["longitude_rad"]
    somewhere = (latitude > -np.pi / 2) & (latitude < np.pi / 2) & (np.abs(longitude) <= 2 * np.pi)
    sieve.keep(somewhere & ((latitude != 0) | (longitude != 0)), "no position")
    sieve.keep(np.abs(sieve["height_m"]) < MAX_HEIGHT_M, "impossible height")
    angles = (np.abs(sieve["roll_rad"]) <= np.pi) & (np.abs(sieve["pitch_rad"]) <= np.pi / 2)
    sieve.keep(angles & (np.abs(sieve["azimuth_rad"]) <= 4 * np.pi), "impossible attitude")
    sieve.columns["azimuth_rad"] = np.mod(sieve["azimuth_rad"], 2 * np.pi)


def sigma_rows(t_ns: NDArray[np.int64], given: Mapping[str, NDArray[Any]], dropped: Counter[str]) -> Columns:
    """What an INS says of its own accuracy, columns SIGMA_COLUMNS (NaN: it does not say); nothing where it says
    nothing. Zero is no standard deviation."""
    if not given or not len(t_ns):
        return {}
    columns = {name: np.asarray(values, np.float64) for name, values in given.items()}
    sieve = RowFilter({"t_ns": t_ns} | columns, dropped)
    good = np.ones(len(sieve), dtype=bool)
    for name in given:
        good &= (sieve[name] > 0) & (sieve[name] <= MAX_SIGMA[name.rpartition("_")[2]])
    sieve.keep(good, "impossible accuracy")
    return {name: sieve.columns.get(name, np.full(len(sieve), np.nan)) for name in SIGMA_COLUMNS}


def keep_possible_soundings(sieve: RowFilter) -> None:
    """Soundings: a detection, with a travel time, an angle and a sound speed that water and sonar can have."""
    sieve.keep_finite()
    speed = sieve["sound_speed_m_s"]
    sieve.keep((speed >= MIN_SPEED_M_S) & (speed <= MAX_SPEED_M_S), "impossible sound speed")
    sieve.keep(sieve["two_way_time_s"] != 0, "no detection")
    time = sieve["two_way_time_s"]
    sieve.keep((time > 0) & (time < MAX_TRAVEL_S), "impossible travel time")
    sieve.keep(np.abs(sieve["angle_rad"]) <= MAX_ANGLE_RAD, "impossible angle")
    sieve.keep(np.abs(sieve["transmit_tilt_rad"]) <= MAX_TILT_RAD, "impossible tilt")


@dataclass
class Order:
    """Holds the INS records of one file in ascending order of time; small steps back are left out and counted."""

    name: str
    last_ns: int = field(default=np.iinfo(np.int64).min)
    records: int = 0
    backwards: int = 0

    def keep(self, sieve: RowFilter) -> None:
        t_ns = sieve["t_ns"]
        latest = np.maximum.accumulate(np.concatenate([[self.last_ns], t_ns]))
        back = t_ns < latest[:-1]
        self.records += len(t_ns)
        self.backwards += int(np.count_nonzero(back))
        self.last_ns = int(latest[-1])
        new = t_ns > latest[:-1]
        sieve.keep(new | back, "repeated time")
        sieve.keep(new[new | back], "time running backwards")

    def check(self) -> None:
        if self.backwards > MAX_BACKWARDS_SHARE * self.records:
            raise RawDataError(
                f"{self.name}: time runs backwards in {self.backwards} of {self.records} records; "
                "export the file again in order of time, one log a file"
            )


@np.errstate(all="ignore")
def through_float32(values: NDArray[np.float64]) -> bool:
    """Whether times (or other large numbers) have lost their digits by being stored as float32.

    All values are then float32 numbers, which by chance happens only to multiples of 1/8 s and the like.

    >>> through_float32(np.array([76892.6953125, 76892.703125])), through_float32(np.array([76892.5, 76893.0]))
    (True, False)
    """
    values = values[np.isfinite(values) & (np.abs(values) < 1e30)]
    if not len(values) or not np.array_equal(values, values.astype(np.float32)):
        return False
    step = float(np.spacing(np.float32(np.abs(values).max())))
    if step < 1e-4:
        return False
    if step < 1:
        return bool(np.any(np.mod(values * 8, 1) != 0))
    return len(values) >= 100 and step >= 8


@np.errstate(all="ignore")
def refuse_float32(columns: Mapping[str, NDArray[Any]], name: str) -> None:
    """RawDataError where seconds_of_week, latitude_deg or longitude_deg have lost their digits as float32."""
    seconds = columns.get("seconds_of_week")
    degraded = seconds is not None and through_float32(seconds)
    for column in ("latitude_deg", "longitude_deg"):
        values = columns.get(column)
        if values is not None and len(values) >= 20 and len(np.unique(values)) > 1:
            degraded = degraded or bool(np.all(np.abs(values - values.astype(np.float32)) < 1e-11))
    if degraded:
        raise RawDataError(f"{name}: its times or positions went through float32; export it again in double precision")
