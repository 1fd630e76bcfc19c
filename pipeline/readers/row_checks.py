"""Checks of the rows of all readers: values must be finite and possible. Nothing is repaired.

Rows that fail are left out and counted under a reason. The limits are those of instruments and water, and the same for
all sessions.
"""

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers.row_filter import SIGMA_COLUMNS, Columns, Mask, RowFilter

FIRST_WEEK, LAST_WEEK = 1000, 5000  # as in config/recording.py: March 1999 to November 2075
MAX_ANGLE_RAD = 1.2 * np.pi / 2
MAX_TILT_RAD = np.pi / 4
MIN_SPEED_M_S, MAX_SPEED_M_S = 1300.0, 1700.0
MAX_TRAVEL_S = 20.0
MAX_HEIGHT_M = 20_000.0
MAX_SIGMA = {"m": 10.0, "deg": 45.0}  # as in config


def possible_week_time(week: NDArray[Any], seconds: NDArray[Any]) -> Mask:
    """Return a mask (n,): true for possible GPS weeks and seconds of week.

    The limits of weeks are those of session.yaml. Seconds may continue beyond the end of their week, by less than one
    week.
    """
    good: Mask = (week >= FIRST_WEEK) & (week <= LAST_WEEK) & (seconds >= 0) & (seconds < 2 * WEEK_NS / NS)
    return good


def possible_ns(t_ns: NDArray[np.int64]) -> Mask:
    """Return a mask (n,): true for GPS times in the weeks that session.yaml accepts."""
    good: Mask = (t_ns >= FIRST_WEEK * WEEK_NS) & (t_ns <= LAST_WEEK * WEEK_NS)
    return good


def latency_ns(latency_s: float) -> int:
    """Return the latency in whole nanoseconds."""
    return round(latency_s * NS)


def keep_possible_poses(rows: RowFilter) -> None:
    """Keep the INS rows with a possible position, height and attitude; bring azimuths into [0, 2 pi).

    The rows need not have a column t_ns yet.
    """
    rows.keep_finite()
    latitude, longitude = rows["latitude_rad"], rows["longitude_rad"]
    on_earth = (latitude > -np.pi / 2) & (latitude < np.pi / 2) & (np.abs(longitude) <= 2 * np.pi)
    rows.keep(on_earth & ((latitude != 0) | (longitude != 0)), "no position")
    rows.keep(np.abs(rows["height_m"]) < MAX_HEIGHT_M, "impossible height")
    angles = (np.abs(rows["roll_rad"]) <= np.pi) & (np.abs(rows["pitch_rad"]) <= np.pi / 2)
    rows.keep(angles & (np.abs(rows["azimuth_rad"]) <= 4 * np.pi), "impossible attitude")
    rows.columns["azimuth_rad"] = np.mod(rows["azimuth_rad"], 2 * np.pi)


def sigma_rows(t_ns: NDArray[np.int64], recorded: Mapping[str, NDArray[Any]], dropped: Counter[str]) -> Columns:
    """Return an INS's own sigmas as the columns SIGMA_COLUMNS; an empty dictionary if none are recorded.

    Parameters
    ----------
    t_ns
        GPS times (n,).
    recorded
        Standard deviations (n,) by the names of SIGMA_COLUMNS; columns that are not recorded become NaN.
    dropped
        Counts by reason, changed in place: rows with an impossible sigma, such as 0.
    """
    if not recorded or not len(t_ns):
        return {}
    columns = {name: np.asarray(values, np.float64) for name, values in recorded.items()}
    rows = RowFilter({"t_ns": t_ns} | columns, dropped)
    good = np.ones(len(rows), dtype=bool)
    for name in recorded:
        good &= (rows[name] > 0) & (rows[name] <= MAX_SIGMA[name.rpartition("_")[2]])
    rows.keep(good, "impossible accuracy")
    return {name: rows.columns.get(name, np.full(len(rows), np.nan)) for name in SIGMA_COLUMNS}


def keep_possible_soundings(rows: RowFilter) -> None:
    """Keep the soundings that have a detection and a possible travel time, possible angles and sound speed."""
    rows.keep_finite()
    speed = rows["sound_speed_m_s"]
    rows.keep((speed >= MIN_SPEED_M_S) & (speed <= MAX_SPEED_M_S), "impossible sound speed")
    rows.keep(rows["two_way_time_s"] != 0, "no detection")
    time = rows["two_way_time_s"]
    rows.keep((time > 0) & (time < MAX_TRAVEL_S), "impossible travel time")
    rows.keep(np.abs(rows["angle_rad"]) <= MAX_ANGLE_RAD, "impossible angle")
    rows.keep(np.abs(rows["transmit_tilt_rad"]) <= MAX_TILT_RAD, "impossible tilt")


