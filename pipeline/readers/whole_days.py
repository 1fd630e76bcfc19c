"""Times that lie whole days apart: of an INS whose export has seconds of the day where those of the week should be."""

from collections.abc import Callable

from pipeline.console import plural
from pipeline.gps_time import NS, WEEK_NS

DAY_NS = 86_400 * NS


def whole_days(
    ins: tuple[int, int], other: tuple[int, int], fits: Callable[[int], bool]
) -> tuple[str, bool, str] | None:
    """How a sensor's clock stands to the INS's (amount, whether it is ahead, and why), where whole days less than a
    week bring its times (first, last; ns) into those of the INS. ``fits``: whether it is within them with this offset
    taken off.

    >>> sunday, wednesday = (36_000 * NS, 39_600 * NS), (3 * DAY_NS + 36_000 * NS, 3 * DAY_NS + 39_600 * NS)
    >>> whole_days(sunday, wednesday, lambda offset_ns: offset_ns == 3 * DAY_NS)[:2]
    ('3 days', True)
    >>> whole_days(wednesday, sunday, lambda offset_ns: offset_ns == -3 * DAY_NS)
    ('3 days', False, 'check the clocks, and the dates that the files were exported with')
    """
    nearest = round((sum(other) - sum(ins)) / (2 * DAY_NS))
    days = next((k for k in (nearest, nearest - 1, nearest + 1) if 0 < abs(k) < 7 and fits(k * DAY_NS)), 0)
    if not days:
        return None
    why = "check the clocks, and the dates that the files were exported with"
    if days > 0 and ins[0] // WEEK_NS == ins[1] // WEEK_NS and ins[1] % WEEK_NS < DAY_NS:
        why = (
            "the INS's times are all of a Sunday and seem to be seconds of the day; export GPSTime in seconds of the "
            "week, or with its date"
        )
    return plural(abs(days), "day"), days > 0, why
