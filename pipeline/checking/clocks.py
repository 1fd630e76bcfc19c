"""Clocks compared by when sensors ran: offsets that have a name, such as a week, hours of a time zone, leap seconds."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.finding import Finding, plural
from pipeline.checking.survey import Seen
from pipeline.passes import pass_of, split_at_gaps
from pipeline.times import NS, WEEK_NS, utc_text

Times = NDArray[np.int64]
LEAPS = {  # s
    18: "UTC taken for GPS time",
    37: "TAI taken for UTC",
    19: "TAI taken for GPS time",
    17: "leap seconds of 2015",
}
HOUR_NS = 3_600 * NS
FARTHEST_H = 14
ENOUGH, MOST = 0.9, 0.99  # of a sensor's time in which the INS runs: as it is, and with a named offset


def named(offset_s: float, within_s: float = 0.3) -> str:
    """What an offset of clocks is known as; nothing where it has no name.

    >>> named(18.1), named(-18.0), named(7200.0), named(5.0)
    ('UTC taken for GPS time', 'UTC taken for GPS time', '2 hours: a time zone', '')
    """
    for leap, words in LEAPS.items():
        if abs(abs(offset_s) - leap) <= within_s:
            return words
    hours = round(abs(offset_s) / 1800) / 2
    if hours and hours <= FARTHEST_H and abs(abs(offset_s) - 3600 * hours) <= max(within_s, 30.0):
        return f"{hours:g} hour{'s' * (hours != 1)}: a time zone"
    return ""


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
        offset_ns, words = _offset(t_ns, running)
        own = [seen for seen in files if seen.sensor == sensor and len(seen.epochs_ns)]
        outside = [seen.name for seen in own if covered(seen.epochs_ns, running) < 1 - ENOUGH]
        spans = f"ins {utc_text(ins[0])} to {utc_text(ins[-1])}, {sensor} {utc_text(t_ns[0])} to {utc_text(t_ns[-1])}"
        if words:
            yield Finding("clock", f"{sensor}: its clock is {_amount(offset_ns)} the INS's: {words} ({spans})")
        elif share < 1 - ENOUGH:
            yield Finding("clock", f"{sensor}: has no time in common with the INS ({spans}); check the clocks")
        else:
            which = f" ({', '.join(outside[:3])} wholly)" if outside else ""
            yield Finding(
                "ins missing",
                f"{sensor}: ran for {1 - share:.0%} of its time without the INS{which}: {spans}; add the INS's other "
                "files, or check the clocks",
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


def _offset(t_ns: Times, running: Sequence[tuple[int, int]]) -> tuple[int, str]:
    """By how much the sensor's clock is ahead, if an offset that has a name brings it into the INS's time."""
    middle = (running[0][0] + running[-1][1]) // 2
    away = int((t_ns[0] + t_ns[-1]) // 2) - middle
    weeks = round(away / WEEK_NS)
    tried: list[tuple[int, str]] = []
    if weeks:
        tried.append((weeks * WEEK_NS, "check gps_week, and the GPS time flag of the export"))
    zone = "a time zone; export in UTC or GPS time"
    tried += [(sign * half * HOUR_NS // 2, zone) for half in range(1, 2 * FARTHEST_H + 1) for sign in (1, -1)]
    scale = "set the clock's time scale"
    tried += [(sign * leap * NS, f"{words}; {scale}") for leap, words in LEAPS.items() for sign in (1, -1)]
    for offset_ns, words in tried:
        if covered(t_ns - offset_ns, running) >= MOST:
            return offset_ns, words
    return 0, ""
