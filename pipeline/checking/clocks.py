"""Clocks compared by when sensors ran: offsets that have a name, such as a week, hours of a time zone, leap seconds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import SurveyedFile
from pipeline.checking.findings import Finding
from pipeline.console import plural
from pipeline.gps_time import NS, WEEK_NS, utc_text
from pipeline.maths.geometry.passes import pass_of, split_at_gaps
from pipeline.readers.whole_days import whole_days_apart

Times = NDArray[np.int64]
LEAPS = {  # s
    18: "UTC and GPS time are mixed up",
    37: "TAI and UTC are mixed up",
    19: "TAI and GPS time are mixed up",
    17: "the leap seconds are those of 2015",
}
HOUR_NS = 3_600 * NS
NO_WEEKS: Mapping[str, int | None] = {}
FARTHEST_H = 14
ENOUGH, MOST = 0.9, 0.99  # of a sensor's time in which the INS runs: as it is, and with a named offset


def offset_name(offset_s: float, within_s: float = 0.3) -> str:
    """Return what an offset of clocks is known as; nothing where it has no name.

    >>> offset_name(18.1), offset_name(-18.0), offset_name(5.0)
    ('UTC and GPS time are mixed up', 'UTC and GPS time are mixed up', '')
    """
    return next((words for leap, words in LEAPS.items() if abs(abs(offset_s) - leap) <= within_s), "")


def share_within(t_ns: Times, stretches: Sequence[tuple[int, int]]) -> float:
    """Return the share of the times that lie in a stretch."""
    starts, ends = (np.array(column, dtype=np.int64) for column in zip(*stretches, strict=True))
    return float(np.mean(pass_of(t_ns, starts, ends) >= 0))


@dataclass(frozen=True)
class Offset:
    """How far a sensor's clock is from the INS's.

    Attributes
    ----------
    how : str
        The amount, in words.
    ahead : bool
        Whether the sensor's clock is ahead.
    why : str
        What the offset is known as, and the remedy.
    weeks : int
        The offset in weeks, where it is whole weeks; else 0.
    """

    how: str
    ahead: bool
    why: str
    weeks: int = 0

    def words(self, to_the_ins: bool, week: int | None, key: str, whose: str = "the INS's") -> str:
        """Return what to say of a sensor's clock against the INS's.

        Parameters
        ----------
        to_the_ins : bool
            False: say it of the INS's clock against the sensors'.
        week : int or None
            The week in the session's settings, from which the right one follows.
        key : str
            The setting that holds the week.
        whose : str
            The clock that it is compared with.
        """
        ahead = self.ahead == to_the_ins
        why = self.why
        if self.weeks and week is not None:
            why = f"write {key}: {week - self.weeks * (1 if to_the_ins else -1)} in place of {week}"
        return f"its clock is {self.how} {'ahead of' if ahead else 'behind'} {whose}: {why}"


def clock_findings(
    epochs: Mapping[str, Times],
    max_gap_ns: int,
    files: Sequence[SurveyedFile],
    weeks: Mapping[str, int | None] = NO_WEEKS,
) -> Iterator[Finding]:
    """Yield the sensors that did not run while the INS did; where both are off by the same, it is the INS's clock.

    Parameters
    ----------
    epochs : Mapping[str, Times]
        Times of the records of each sensor, in order; ``ins`` among them.
    max_gap_ns : int
        A longer time without a record is a pause.
    files : Sequence[SurveyedFile]
        The session's files.
    weeks : Mapping[str, int or None]
        gps_week in the settings, by sensor.
    """
    ins = epochs["ins"]
    running = split_at_gaps(ins, max_gap_ns)
    shares = {sensor: share_within(t_ns, running) for sensor, t_ns in epochs.items() if sensor != "ins" and len(t_ns)}
    astray = {sensor: share for sensor, share in shares.items() if share < ENOUGH}
    offsets = {
        sensor: off
        for sensor, share in astray.items()
        if (off := _offset(epochs[sensor], running, share < 1 - ENOUGH, _pauses(epochs[sensor], max_gap_ns)))
    }
    both = list(offsets.values())
    if len(both) == 2 and both[0] == both[1]:
        words = both[0].words(False, weeks.get("ins"), "ins.gps_week", "both sensors'")
        yield Finding("clock", f"ins: {words} (ins from {utc_text(ins[0])}, {_from(epochs)})")
        return
    other_agrees = len(shares) == 2 and len(astray) == 1  # the other sensor runs with the INS
    for sensor, share in sorted(astray.items()):
        t_ns = epochs[sensor]
        spans = f"ins {utc_text(ins[0])} to {utc_text(ins[-1])}, {sensor} {utc_text(t_ns[0])} to {utc_text(t_ns[-1])}"
        if sensor in offsets:
            other = "the sonar" if sensor == "laser" else "the laser"
            whose = f"the INS's and {other}'s" if other_agrees else "the INS's"
            words = offsets[sensor].words(True, weeks.get(sensor), f"{sensor}.gps_week", whose)
            yield Finding("clock", f"{sensor}: {words} ({spans})")
        elif share < 1 - ENOUGH:
            yield Finding(
                "clock",
                f"{sensor}: has no time in common with the INS ({spans}); check the clocks, and that the "
                "files are of one session",
            )
        else:
            own = [file for file in files if file.sensor == sensor and len(file.epochs_ns)]
            outside = [file.name for file in own if share_within(file.epochs_ns, running) < 1 - ENOUGH]
            which = f" ({', '.join(outside[:3])} wholly)" if outside else ""
            between = np.count_nonzero((t_ns > ins[0]) & (t_ns < ins[-1])) / len(t_ns)
            yield Finding(
                "ins missing",
                f"{sensor}: ran for {1 - share:.0%} of its time without the INS{which}: {spans}; add the INS's other "
                "files, or check the clocks",
                "fault" if outside or between - share > 1 - ENOUGH else "look",  # on before it, or longer than it
            )


def _pauses(t_ns: Times, max_gap_ns: int) -> bool:
    """Return whether a sensor paused."""
    return len(split_at_gaps(t_ns, max_gap_ns)) > 1


def _from(epochs: Mapping[str, Times]) -> str:
    return ", ".join(f"{sensor} from {utc_text(epochs[sensor][0])}" for sensor in ("laser", "mbes") if sensor in epochs)


def _amount(offset_ns: int) -> str:
    """Return an offset in its largest whole unit.

    >>> _amount(18 * NS), _amount(-2 * WEEK_NS)
    ('18 s', '2 weeks')
    """
    size = abs(offset_ns)
    how = plural(size // WEEK_NS, "week") if size >= WEEK_NS and size % WEEK_NS == 0 else f"{size / NS:g} s"
    return plural(size // HOUR_NS, "hour") if size % HOUR_NS == 0 and size < WEEK_NS else how


def _offset(t_ns: Times, running: Sequence[tuple[int, int]], apart: bool, pauses: bool) -> Offset | None:
    """Return the offset with a name that brings the sensor into the INS's time; None where there is none.

    Weeks and hours are tried only where the two have no time in common (``apart``). Leap seconds are tried there, and
    where the sensor paused: a sensor that did not pause, and was switched on before the INS, looks the same.
    """
    away = int((t_ns[0] + t_ns[-1]) // 2) - (running[0][0] + running[-1][1]) // 2
    weeks = round(away / WEEK_NS)

    def fits(offset_ns: int) -> bool:
        return share_within(t_ns - offset_ns, running) >= MOST

    if apart and weeks and fits(weeks * WEEK_NS):
        why = "check gps_week, and the GPS time flag of the export"
        return Offset(_amount(weeks * WEEK_NS), weeks > 0, why, weeks)
    if apart and (days := whole_days_apart((running[0][0], running[-1][1]), (int(t_ns[0]), int(t_ns[-1])), fits)):
        return Offset(days.amount, days.ahead, days.reason)
    leaps = [sign * leap * NS for leap in LEAPS for sign in (1, -1)] if apart or pauses else []
    for offset_ns in leaps:
        if fits(offset_ns):
            name = offset_name(offset_ns / NS)
            return Offset(_amount(offset_ns), offset_ns > 0, f"{name}; set the clock's time scale")
    if apart:
        hours = [h for h in range(-FARTHEST_H, FARTHEST_H + 1) if h and fits(h * HOUR_NS)]
        if hours:
            least, most = min(hours, key=abs), max(hours, key=abs)
            amount = _amount(most * HOUR_NS) if least == most else f"{abs(least)} to {_amount(most * HOUR_NS)}"
            return Offset(amount, most > 0, "a time zone; export in UTC or GPS time")
    return None
