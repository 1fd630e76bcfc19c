"""Differences of whole days between the clocks of sensors.

One cause is an INS export with seconds of the day in place of seconds of the week.
"""

from collections.abc import Callable
from dataclasses import dataclass

from pipeline.console import plural
from pipeline.gps_time import NS, WEEK_NS

DAY_NS = 86_400 * NS


@dataclass(frozen=True)
class WholeDays:
    """The difference of a sensor's clock from the INS's clock, in whole days."""

    amount: str  # such as "3 days"
    ahead: bool  # the sensor's clock is ahead of the INS's
    reason: str  # the likely cause and its remedy, for the message


def whole_days_apart(
    ins: tuple[int, int], sensor: tuple[int, int], fits: Callable[[int], bool]
) -> WholeDays | None:
    """Find the whole number of days, fewer than seven, by which a sensor's times must be shifted to fit the INS's.

    Parameters
    ----------
    ins, sensor : tuple of two ints
        First and last time, GPS ns.
    fits : callable
        Function that returns whether the sensor's times minus an offset (ns) fit those of the INS.

    Returns
    -------
    WholeDays or None
        None: no whole number of days makes them fit.

    Examples
    --------
    >>> sunday, wednesday = (36_000 * NS, 39_600 * NS), (3 * DAY_NS + 36_000 * NS, 3 * DAY_NS + 39_600 * NS)
    >>> ahead = whole_days_apart(sunday, wednesday, lambda offset_ns: offset_ns == 3 * DAY_NS)
    >>> ahead.amount, ahead.ahead
    ('3 days', True)
    >>> behind = whole_days_apart(wednesday, sunday, lambda offset_ns: offset_ns == -3 * DAY_NS)
    >>> behind.amount, behind.ahead, behind.reason
    ('3 days', False, 'check the clocks, and the dates that the files were exported with')
    """
    nearest = round((sum(sensor) - sum(ins)) / (2 * DAY_NS))
    days = next((k for k in (nearest, nearest - 1, nearest + 1) if 0 < abs(k) < 7 and fits(k * DAY_NS)), 0)
    if not days:
        return None
    reason = "check the clocks, and the dates that the files were exported with"
    if days > 0 and ins[0] // WEEK_NS == ins[1] // WEEK_NS and ins[1] % WEEK_NS < DAY_NS:
        reason = (
            "the INS's times are all of a Sunday and seem to be seconds of the day; export GPSTime in seconds of the "
            "week, or with its date"
        )
    return WholeDays(plural(abs(days), "day"), days > 0, reason)
