"""Times of an Inertial Explorer export: the choice of the columns of the time, and the times of the rows.

``GPSTime`` (or ``CorrTime``) is in seconds of the week or of the day, both with the unit (sec), or in hours, minutes,
seconds. The file may have two columns of it. A time of 86 400 s or more counts from the start of the week. A smaller
time counts from the start of the day; or it counts from the start of the week, and the day is Sunday. A date, UTC with
its date, a second column of the time, or the day of the week decides between the two. Without any of these Sunday is
assumed. ``poolcal check`` then reports it if the times of the other sensors lie whole days later.

With a date, seconds of the week and seconds of the day are both accepted. Seconds of the week must fall on the date's
day of the week. Rows in which two columns contradict each other are left out and counted.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.gps_time import GPS_EPOCH_UNIX_S, NS, gps_ns_from_unix_utc, gps_ns_from_week_seconds
from pipeline.readers.inertial_explorer_names import DATE_ORDERS, HeaderColumns
from pipeline.readers.row_checks import possible_ns, possible_week_time
from pipeline.readers.row_filter import RowFilter

_Array = NDArray[np.float64]
Clock = Literal["week", "gpsdate", "utcdate", "gps_week"]
DAY_S = 86_400
WEEKDAY_OF_1970 = 4  # 1970-01-01 was a Thursday; Sunday is 0
SECOND_GPS_TIME = "gpstime 2"  # the name of a second column GPSTime
_TOLERANCE_S = 0.02  # two printed times of one instant differ by less
_LONGEST_S = 14 * DAY_S  # limit of seconds of the week; larger numbers count from another epoch


def choose_time_columns(
    header: HeaderColumns, sample: Mapping[int, _Array], file: str
) -> tuple[list[tuple[str, int]], Clock]:
    """Choose the columns from which the times of the rows follow.

    Parameters
    ----------
    header : HeaderColumns
        Names and units.
    sample : mapping
        Times of the first rows (n,), s, by number of the column.
    file : str
        The file's path in the session folder, for messages.

    Returns
    -------
    columns : list of tuples
        Names and numbers of the columns; empty without a time.
    clock : Clock
        Source of a time's week.

    Raises
    ------
    RawDataError
        Times contradict each other, or lack a date.
    """
    names, units = header.names, header.units
    times = [k for k, name in enumerate(names) if name == "gpstime"]
    dates: dict[str, int] = {n: names.index(n) for n in ("gpsdate", "utcdate") if n in names}
    utc = [("utctime", names.index("utctime")), ("utcdate", dates["utcdate"])] if _has_utc(names) else []
    if not times:
        return utc, "utcdate" if utc else "gps_week"
    _refuse_contradictory(times, sample, file)
    counted = sorted((k for k in times if units[k] != "hms"), key=lambda k: -_largest(sample[k]))
    first = (counted or times)[0]
    columns = [("gpstime", first), *((SECOND_GPS_TIME, k) for k in times if k != first)]
    week: list[tuple[str, int]] = [("week", names.index("week"))] if "week" in names else []
    clock: Clock = "week" if week else "gps_week"
    of_week = bool(counted) and _largest(sample[first]) >= DAY_S
    if of_week and (week or not (utc or "gpsdate" in dates)):
        return columns + week, clock
    if "gpsdate" in dates and (units[dates["gpsdate"]] in DATE_ORDERS or not (counted and (week or utc))):
        return [*columns, ("gpsdate", dates["gpsdate"])], "gpsdate"
    if utc and (of_week or not counted or np.any(sample[utc[0][1]] < _LONGEST_S)):
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
def _largest(seconds: _Array) -> float:
    """Return the largest of the possible times, s; 0 if none is possible."""
    return float(np.max(seconds[(seconds >= 0) & (seconds < _LONGEST_S)], initial=0.0))


def _has_utc(names: Sequence[str]) -> bool:
    return {"utctime", "utcdate"} <= set(names)


def _refuse_contradictory(times: Sequence[int], sample: Mapping[int, _Array], file: str) -> None:
    """Refuse more than two columns GPSTime, or two whose difference is not a whole number of days."""
    if len(times) > 2:
        raise RawDataError(f"{file}: has column GPSTime {len(times)} times; take all but one out of the export profile")
    if len(times) == 2:
        differences = np.abs(_difference_of_day(*(sample[k] for k in times)))
        if np.any(differences > _TOLERANCE_S):
            raise RawDataError(
                f"{file}: has column GPSTime twice, and the two differ by {np.nanmax(differences):.2f} s beside whole "
                "days; take one out of the export profile"
            )


def _refuse_of_day(seconds: _Array, utc: Sequence[_Array], file: str) -> None:
    """Refuse GPSTime in seconds of the day if UTCTime (seconds of the week or Unix seconds) is not on a Sunday."""
    if not (len(utc) == 1 and len(seconds)):
        return
    utc_s = float(np.median(utc[0]))
    of_week = utc_s - GPS_EPOCH_UNIX_S if utc_s >= 1e9 else utc_s
    days = np.mod(of_week - float(np.median(seconds)) + DAY_S / 2, 7 * DAY_S) // DAY_S
    if utc_s >= DAY_S and days > 0:  # false if one of them is NaN
        raise RawDataError(
            f"{file}: GPSTime is in seconds of the day: by UTCTime it is not Sunday; export GPSTime in seconds of the "
            "week, or GPSDate as well"
        )


@np.errstate(all="ignore")
def _difference_of_day(first: _Array, second: _Array) -> _Array:
    """Return the difference (n,) of two times without whole days, s: minus half to plus half a day; NaN from NaN."""
    return np.mod(first - second + DAY_S / 2, DAY_S) - DAY_S / 2


# --- rows ------------------------------------------------------------------------------------------------------------
def combine_gps_times(columns: dict[str, NDArray[Any]]) -> None:
    """Join two columns GPSTime, or GPSTime and the day of the week, into one GPSTime.

    Parameters
    ----------
    columns : dict
        Columns by name, changed in place. If two columns are joined, the mask ``contradict`` is added: true for rows
        in which the two contradict each other. GPSTime of these rows becomes NaN.
    """
    with np.errstate(all="ignore"):
        time = columns.get("gpstime")
        if time is not None and SECOND_GPS_TIME in columns:
            second = columns.pop(SECOND_GPS_TIME)
            contradict = np.abs(_difference_of_day(time, second)) > _TOLERANCE_S
            columns["gpstime"] = time = np.where(contradict, np.nan, np.fmax(time, second))
            columns["contradict"] = contradict
        if time is not None and "weekday" in columns:
            day = columns.pop("weekday")
            of_week = time >= DAY_S
            whole = (day >= 0) & (day <= 6) & (day == np.rint(day))
            fits = whole & (~of_week | (np.mod(time // DAY_S, 7) == day))
            columns["gpstime"] = np.where(fits, np.where(of_week, time, time + DAY_S * day), np.nan)
            columns["contradict"] = columns.get("contradict", np.zeros(len(time), dtype=bool)) | (whole & ~fits)


def keep_possible_times(
    rows: RowFilter, columns: Mapping[str, NDArray[Any]], clock: Clock, name: str, in_sixtieths: bool
) -> None:
    """Add column t_ns (GPS), and leave out rows whose time is impossible or contradictory.

    Parameters
    ----------
    rows : RowFilter
        Rows to filter, changed in place; their column ``row`` is the row number in ``columns``.
    columns : mapping
        All columns of the block.
    clock : Clock
        Source of a time's week.
    name : str
        Name of the column of the time.
    in_sixtieths : bool
        The time is in hours, minutes, seconds: it counts from the start of the day.
    """
    if "contradict" in columns:
        rows.keep(columns["contradict"][rows["row"]] == 0, "two times that contradict each other")
    seconds = columns[name][rows["row"]]
    if clock in ("week", "gps_week"):
        week = columns["week"][rows["row"]]
        possible = possible_week_time(week, seconds) & (week == np.rint(week))
        rows.keep(possible, "impossible time")
        rows.columns["t_ns"] = gps_ns_from_week_seconds(week[possible].astype(np.int64), seconds[possible])
        return
    days = columns[clock][rows["row"]]
    of_day = seconds if in_sixtieths else np.mod(seconds, DAY_S)
    possible = np.isfinite(days) & (seconds >= 0) & (seconds < _LONGEST_S) & (of_day <= DAY_S)
    rows.keep(possible, "impossible time")
    days, seconds, of_day = days[possible], seconds[possible], of_day[possible]
    same_day = (seconds < DAY_S) | in_sixtieths | (np.mod(seconds // DAY_S, 7) == np.mod(days + WEEKDAY_OF_1970, 7))
    rows.keep(same_day, "date and seconds of the week that contradict each other")
    unix_s, ns = days[same_day].astype(np.int64) * DAY_S, np.rint(of_day[same_day] * NS).astype(np.int64)
    if clock == "utcdate":
        t_ns = gps_ns_from_unix_utc(unix_s + ns // NS, ns % NS)
    else:
        t_ns = (unix_s - GPS_EPOCH_UNIX_S) * NS + ns
    rows.columns["t_ns"] = t_ns
    rows.keep(possible_ns(t_ns), "impossible time")


@np.errstate(all="ignore")
def unix_days(year: _Array, month: NDArray[Any], day: NDArray[Any]) -> _Array:
    """Return days since 1970-01-01, (n,); NaN for an impossible date."""
    possible = (year >= 1980) & (year <= 2100) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    whole = np.where(possible, [year, month, day], 1.0)
    possible &= np.all(whole == np.rint(whole), axis=0)
    years, months, days = whole.astype(np.int64)
    first = (12 * (years - 1970) + months - 1).astype("M8[M]")
    date = first.astype("M8[D]") + (days - 1)
    return np.where(possible & (date.astype("M8[M]") == first), date.astype(np.int64), np.nan)
