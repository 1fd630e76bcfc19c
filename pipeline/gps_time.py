"""Time scales. Inside the program a time is int64 nanoseconds since the GPS epoch, 1980-01-06, without leap seconds."""

from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

NS = 1_000_000_000
WEEK_NS = 604_800 * NS
WEEK_S = WEEK_NS / NS
GPS_EPOCH_UNIX_S = 315_964_800  # 1980-01-06 00:00:00 UTC as a Unix time
ADJUSTED_STANDARD_OFFSET_S = 1_000_000_000  # LAS: "adjusted standard GPS time" is GPS seconds - 1e9

# Pairs: a Unix time, and GPS - UTC in seconds from that time on (IERS Bulletin C; last: 2017-01-01).
LEAP_SECONDS: tuple[tuple[int, int], ...] = (
    (315_964_800, 0),  # 1980-01-06
    (362_793_600, 1),  # 1981-07-01
    (394_329_600, 2),  # 1982-07-01
    (425_865_600, 3),  # 1983-07-01
    (489_024_000, 4),  # 1985-07-01
    (567_993_600, 5),  # 1988-01-01
    (631_152_000, 6),  # 1990-01-01
    (662_688_000, 7),  # 1991-01-01
    (709_948_800, 8),  # 1992-07-01
    (741_484_800, 9),  # 1993-07-01
    (773_020_800, 10),  # 1994-07-01
    (820_454_400, 11),  # 1996-01-01
    (867_715_200, 12),  # 1997-07-01
    (915_148_800, 13),  # 1999-01-01
    (1_136_073_600, 14),  # 2006-01-01
    (1_230_768_000, 15),  # 2009-01-01
    (1_341_100_800, 16),  # 2012-07-01
    (1_435_708_800, 17),  # 2015-07-01
    (1_483_228_800, 18),  # 2017-01-01
)


def gps_ns_from_unix_utc(seconds: NDArray[np.int64], nanoseconds: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return GPS nanoseconds from Unix UTC seconds and nanoseconds, with the leap seconds of that instant.

    >>> int(gps_ns_from_unix_utc(np.array([1483228800]), np.array([0]))[0]) // NS - (1483228800 - GPS_EPOCH_UNIX_S)
    18
    """
    starts = np.array([start for start, _ in LEAP_SECONDS], dtype=np.int64)
    leaps = np.array([leap for _, leap in LEAP_SECONDS], dtype=np.int64)
    seconds = np.asarray(seconds, dtype=np.int64)
    index = np.maximum(np.searchsorted(starts, seconds, side="right") - 1, 0)
    return (seconds - GPS_EPOCH_UNIX_S + leaps[index]) * NS + np.asarray(nanoseconds, dtype=np.int64)


def unix_ns_from_gps(t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return Unix UTC nanoseconds from GPS nanoseconds: the inverse of :func:`gps_ns_from_unix_utc`."""
    starts = np.array([start + leap for start, leap in LEAP_SECONDS], dtype=np.int64)
    leaps = np.array([leap for _, leap in LEAP_SECONDS], dtype=np.int64)
    unix = np.asarray(t_ns, dtype=np.int64) + GPS_EPOCH_UNIX_S * NS
    return unix - leaps[np.maximum(np.searchsorted(starts, unix // NS, side="right") - 1, 0)] * NS


def utc_text(t_ns: int) -> str:
    """Return GPS nanoseconds as UTC text, to the second.

    >>> utc_text(1_462_608_018 * NS)
    '2026-05-12T08:00:00Z'
    """
    unix = int(unix_ns_from_gps(np.array([t_ns]))[0]) // NS
    return f"{datetime.fromtimestamp(unix, UTC):%Y-%m-%dT%H:%M:%SZ}"


def gps_ns_from_week_seconds(week: int | NDArray[np.int64], seconds: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return GPS nanoseconds from GPS week and seconds of week.

    >>> int(gps_ns_from_week_seconds(1, np.array([0.25]))[0])
    604800250000000
    """
    seconds = np.asarray(seconds, dtype=np.float64)
    whole = np.floor(seconds)
    fraction_ns = np.rint((seconds - whole) * NS).astype(np.int64)
    return np.asarray(week, dtype=np.int64) * WEEK_NS + whole.astype(np.int64) * NS + fraction_ns
