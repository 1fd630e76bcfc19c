"""What tells the time in an Inertial Explorer export, and rows' times.

``GPSTime`` (or ``CorrTime``) is in seconds of the week or of the day, both with the unit (sec), or in hours, minutes,
seconds; it may stand there twice. From 86 400 s on it is of the week. Below, it is of the day or of a Sunday's week:
a date, UTC with its date, a second column of time, or the day of the week tells which. Where nothing does, Sunday is
taken, as Week says, and ``poolcal check`` says so where the other sensors ran whole days later.

Beside a date seconds of the week and of the day are the same, but those of the week must fall on the date's own day of
the week: rows in which two columns contradict each other are left out and counted.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.gps_time import GPS_EPOCH_UNIX_S, NS, gps_ns_from_unix_utc, gps_ns_from_week_seconds
from pipeline.readers.inertial_explorer_names import ORDERS, Names
from pipeline.readers.row_checks import Sieve, possible_ns, possible_week_time

Array = NDArray[np.float64]
Clock = Literal["week", "gpsdate", "utcdate", "gps_week"]
DAY_S = 86_400
WEEKDAY_OF_1970 = 4  # Thursday; Sunday is 0
SECOND = "gpstime 2"  # the name of a second column GPSTime
SAME_S = 0.02  # two times printed of one moment differ by less
MOST_S = 14 * DAY_S  # of the week; beyond it they are of some other count


def choose(given: Names, sample: Mapping[int, Array], file: str) -> tuple[list[tuple[str, int]], Clock]:
    """The columns that tell the time, with their numbers, and the clock; nothing of the time where there is none.

    ``sample``: by number of a column of times what its first rows say, in seconds.

    Raises
    ------
    RawDataError
        Times that contradict each other, or lack a date.
    """
    names, units = given.names, given.units
    times = [k for k, name in enumerate(names) if name == "gpstime"]
    dates: dict[str, int] = {n: names.index(n) for n in ("gpsdate", "utcdate") if n in names}
    utc = [("utctime", names.index("utctime")), ("utcdate", dates["utcdate"])] if _has_utc(names) else []
    if not times:
        return utc, "utcdate" if utc else "gps_week"
    _refuse_contradictory(times, sample, file)
    counted = sorted((k for k in times if units[k] != "hms"), key=lambda k: -_largest(sample[k]))
    first = (counted or times)[0]
    columns = [("gpstime", first), *((SECOND, k) for k in times if k != first)]
    week: list[tuple[str, int]] = [("week", names.index("week"))] if "week" in names else []
    clock: Clock = "week" if week else "gps_week"
    of_week = bool(counted) and _largest(sample[first]) >= DAY_S
    if of_week and (week or not (utc or "gpsdate" in dates)):
        return columns + week, clock
    if "gpsdate" in dates and (units[dates["gpsdate"]] in ORDERS or not (counted and (week or utc))):
        return [*columns, ("gpsdate", dates["gpsdate"])], "gpsdate"
    if utc and (of_week or not counted or np.any(sample[utc[0][1]] < MOST_S)):
        return utc, "utcdate"
    if not counted:
        raise RawDataError(
            f"{file}: GPSTime is in hours, minutes, seconds, without a date; export GPSDate as well, or GPSTime in "
            "seconds of the week"
        )
    if "weekday" in names:
        return [*columns, *week, ("weekday", names.index("weekday"))], clock
    _refuse_of_day(sample[first], [sample[k] for k, name in enumerate(names) if name == "utctime"], file)
    return columns + week, clock


@np.errstate(all="ignore")
def _largest(seconds: Array) -> float:
    """Of times that are possible."""
    return float(np.max(seconds[(seconds >= 0) & (seconds < MOST_S)], initial=0.0))


def _has_utc(names: Sequence[str]) -> bool:
    return {"utctime", "utcdate"} <= set(names)


def _refuse_contradictory(times: Sequence[int], sample: Mapping[int, Array], file: str) -> None:
    if len(times) > 2:
        raise RawDataError(f"{file}: has column GPSTime {len(times)} times; take all but one out of the export profile")
    if len(times) == 2:
        one, other = (sample[k] for k in times)
        apart = np.abs(_apart(one, other))
        if np.any(apart > SAME_S):
            raise RawDataError(
                f"{file}: has column GPSTime twice, and the two differ by {np.nanmax(apart):.2f} s beside whole days; "
                "take one out of the export profile"
            )


def _refuse_of_day(seconds: Array, utc: Sequence[Array], file: str) -> None:
    """Seconds of the day by the witness of UTCTime in seconds of the week, or of the Unix epoch."""
    if not (len(utc) == 1 and len(seconds)):
        return
    told = float(np.median(utc[0]))
    of_week = told - GPS_EPOCH_UNIX_S if told >= 1e9 else told
    away = np.mod(of_week - float(np.median(seconds)) + DAY_S / 2, 7 * DAY_S) // DAY_S
    if told >= DAY_S and away > 0:  # not where one of them is no number
        raise RawDataError(
            f"{file}: GPSTime is in seconds of the day: by UTCTime it is not Sunday; export GPSTime in seconds of the "
            "week, or GPSDate as well"
        )


@np.errstate(all="ignore")
def _apart(one: Array, other: Array) -> Array:
    """The difference of two times but for whole days, from -half to half a day; NaN where there is none."""
    return np.mod(one - other + DAY_S / 2, DAY_S) - DAY_S / 2


# --- rows ------------------------------------------------------------------------------------------------------------
def combine(columns: dict[str, NDArray[Any]]) -> None:
    """The two columns of GPSTime, and the day of the week, become one GPSTime; NaN where they contradict each other."""
    with np.errstate(all="ignore"):
        time = columns.get("gpstime")
        if time is not None and SECOND in columns:
            other = columns.pop(SECOND)
            contradict = np.abs(_apart(time, other)) > SAME_S
            columns["gpstime"] = time = np.where(contradict, np.nan, np.fmax(time, other))
            columns["contradict"] = contradict
        if time is not None and "weekday" in columns:
            day = columns.pop("weekday")
            of_week = time >= DAY_S
            whole = (day >= 0) & (day <= 6) & (day == np.rint(day))
            fits = whole & (~of_week | (np.mod(time // DAY_S, 7) == day))
            columns["gpstime"] = np.where(fits, np.where(of_week, time, time + DAY_S * day), np.nan)
            columns["contradict"] = columns.get("contradict", np.zeros(len(time), dtype=bool)) | (whole & ~fits)


def keep_times(sieve: Sieve, columns: Mapping[str, NDArray[Any]], clock: Clock, name: str, in_sixtieths: bool) -> None:
    """Column t_ns, GPS; rows at impossible or contradictory times are left out."""
    if "contradict" in columns:
        sieve.keep(columns["contradict"][sieve["row"]] == 0, "two times that contradict each other")
    seconds = columns[name][sieve["row"]]
    if clock in ("week", "gps_week"):
        week = columns["week"][sieve["row"]]
        good = possible_week_time(week, seconds) & (week == np.rint(week))
        sieve.keep(good, "impossible time")
        sieve.columns["t_ns"] = gps_ns_from_week_seconds(week[good].astype(np.int64), seconds[good])
        return
    days = columns[clock][sieve["row"]]
    of_day = seconds if in_sixtieths else np.mod(seconds, DAY_S)
    good = np.isfinite(days) & (seconds >= 0) & (seconds < MOST_S) & (of_day <= DAY_S)
    sieve.keep(good, "impossible time")
    days, seconds, of_day = days[good], seconds[good], of_day[good]
    same = (seconds < DAY_S) | in_sixtieths | (np.mod(seconds // DAY_S, 7) == np.mod(days + WEEKDAY_OF_1970, 7))
    sieve.keep(same, "date and seconds of the week that contradict each other")
    unix_s, ns = days[same].astype(np.int64) * DAY_S, np.rint(of_day[same] * NS).astype(np.int64)
    if clock == "utcdate":
        t_ns = gps_ns_from_unix_utc(unix_s + ns // NS, ns % NS)
    else:
        t_ns = (unix_s - GPS_EPOCH_UNIX_S) * NS + ns
    sieve.columns["t_ns"] = t_ns
    sieve.keep(possible_ns(t_ns), "impossible time")


@np.errstate(all="ignore")
def days_of(year: Array, month: NDArray[Any], day: NDArray[Any]) -> Array:
    """Days since 1970-01-01; NaN where there is no such date."""
    good = (year >= 1980) & (year <= 2100) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    whole = np.where(good, [year, month, day], 1.0)
    good &= np.all(whole == np.rint(whole), axis=0)
    years, months, days = whole.astype(np.int64)
    first = (12 * (years - 1970) + months - 1).astype("M8[M]")
    date = first.astype("M8[D]") + (days - 1)
    return np.where(good & (date.astype("M8[M]") == first), date.astype(np.int64), np.nan)
