"""Clocks compared by when sensors ran: offsets that have a name, such as a week, hours of a time zone, leap seconds."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.days import whole_days
from pipeline.checking.finding import Finding
from pipeline.checking.survey import Seen
from pipeline.passes import pass_of, split_at_gaps
from pipeline.screen import plural
from pipeline.times import NS, WEEK_NS, utc_text

Times = NDArray[np.int64]
LEAPS = {  # s
    18: "UTC and GPS time are mixed up",
    37: "TAI and UTC are mixed up",
    19: "TAI and GPS time are mixed up",
    17: "the leap seconds are those of 2015",
}
HOUR_NS = 3_600 * NS
FARTHEST_H = 14
ENOUGH, MOST = 0.9, 0.99  # of a sensor's time in which the INS runs: as it is, and with a named offset


def named(offset_s: float, within_s: float = 0.3) -> str:
    """What an offset of clocks is known as; nothing where it has no name.

    >>> named(18.1), named(-18.0), named(5.0)
    ('UTC and GPS time are mixed up', 'UTC and GPS time are mixed up', '')
    """
    return next((words for leap, words in LEAPS.items() if abs(abs(offset_s) - leap) <= within_s), "")


def covered(t_ns: Times, stretches: Sequence[tuple[int, int]]) -> float:
    """Share of moments that lie in a stretch."""
    starts, ends = (np.array(column, dtype=np.int64) for column in zip(*stretches, strict=True))
    return float(np.mean(pass_of(t_ns, starts, ends) >= 0))


def apart(epochs: Mapping[str, Times], max_gap_ns: int, files: Sequence[Seen]) -> Iterator[Finding]:
    """Sensors that did not run while the INS did."""
    ins = epochs["ins"]
    running = split_at_gaps(ins, max_gap_ns)
    for sensor in ("laser", "mbes"):
        t_ns = epochs.get(sensor, np.empty(0, np.int64))
        share = covered(t_ns, running) if len(t_ns) else 1.0
        if share >= ENOUGH:
            continue
        spans = f"ins {utc_text(ins[0])} to {utc_text(ins[-1])}, {sensor} {utc_text(t_ns[0])} to {utc_text(t_ns[-1])}"
        words = _offset(t_ns, running, share < 1 - ENOUGH, len(split_at_gaps(t_ns, max_gap_ns)) > 1)
        if words:
            yield Finding("clock", f"{sensor}: its clock is {words} ({spans})")
        elif share < 1 - ENOUGH:
            yield Finding("clock", f"{sensor}: has no time in common with the INS ({spans}); check the clocks")
        else:
            own = [seen for seen in files if seen.sensor == sensor and len(seen.epochs_ns)]
            outside = [seen.name for seen in own if covered(seen.epochs_ns, running) < 1 - ENOUGH]
            which = f" ({', '.join(outside[:3])} wholly)" if outside else ""
            between = np.count_nonzero((t_ns > ins[0]) & (t_ns < ins[-1])) / len(t_ns)
            yield Finding(
                "ins missing",
                f"{sensor}: ran for {1 - share:.0%} of its time without the INS{which}: {spans}; add the INS's other "
                "files, or check the clocks",
                "fault" if outside or between - share > 1 - ENOUGH else "look",  # on before it, or longer than it
            )


def _amount(offset_ns: int) -> str:
    """
    >>> _amount(18 * NS), _amount(-2 * WEEK_NS)
    ('18 s ahead of', '2 weeks behind')
    """
    size = abs(offset_ns)
    how = plural(size // WEEK_NS, "week") if size >= WEEK_NS and size % WEEK_NS == 0 else f"{size / NS:g} s"
    if size % HOUR_NS == 0 and size < WEEK_NS:
        how = plural(size // HOUR_NS, "hour")
    return f"{how} {'ahead of' if offset_ns > 0 else 'behind'}"


def _offset(t_ns: Times, running: Sequence[tuple[int, int]], apart: bool, pauses: bool) -> str:
    """By how much the sensor's clock is off, if an offset that has a name brings it into the INS's time; else nothing.

    Weeks and hours only where nothing was in common; leap seconds there, and where the sensor paused: one that did not,
    and was switched on before the INS, looks the same.
    """
    away = int((t_ns[0] + t_ns[-1]) // 2) - (running[0][0] + running[-1][1]) // 2
    weeks = round(away / WEEK_NS)

    def fits(offset_ns: int) -> bool:
        return covered(t_ns - offset_ns, running) >= MOST

    if apart and weeks and fits(weeks * WEEK_NS):
        return f"{_amount(weeks * WEEK_NS)} the INS's: check gps_week, and the GPS time flag of the export"
    if apart and (days := whole_days((running[0][0], running[-1][1]), (int(t_ns[0]), int(t_ns[-1])), fits)):
        return days
    leaps = [sign * leap * NS for leap in LEAPS for sign in (1, -1)] if apart or pauses else []
    for offset_ns in leaps:
        if fits(offset_ns):
            return f"{_amount(offset_ns)} the INS's: {named(offset_ns / NS)}; set the clock's time scale"
    if apart:
        hours = [h for h in range(-FARTHEST_H, FARTHEST_H + 1) if h and fits(h * HOUR_NS)]
        if hours:
            least, most = min(hours, key=abs), max(hours, key=abs)
            amount = _amount(most * HOUR_NS) if least == most else f"{abs(least)} to {_amount(most * HOUR_NS)}"
            return f"{amount} the INS's: a time zone; export in UTC or GPS time"
    return ""
