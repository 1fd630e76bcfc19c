"""Clocks compared by the times at which the sensors ran.

Offsets with a known cause are sought: whole weeks and days, the hours of a time zone, leap seconds.
"""

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
LEAPS = {  # offset in seconds: its cause
    18: "UTC and GPS time are mixed up",
    37: "TAI and UTC are mixed up",
    19: "TAI and GPS time are mixed up",
    17: "the leap seconds are those of 2015",
}
HOUR_NS = 3_600 * NS
NO_WEEKS: Mapping[str, int | None] = {}
FARTHEST_H = 14  # largest offset of a time zone
ENOUGH, MOST = 0.9, 0.99  # least share of a sensor's times within the INS's: as recorded, and less a named offset


def offset_name(offset_s: float, within_s: float = 0.3) -> str:
    """Return the known cause of an offset between two clocks; an empty text if there is none.

    >>> offset_name(18.1), offset_name(-18.0), offset_name(5.0)
    ('UTC and GPS time are mixed up', 'UTC and GPS time are mixed up', '')
    """
    return next((words for leap, words in LEAPS.items() if abs(abs(offset_s) - leap) <= within_s), "")


def share_within(t_ns: Times, stretches: Sequence[tuple[int, int]]) -> float:
    """Return the share of the times that lie within one of the stretches (first and last time)."""
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
        The cause of the offset, and the remedy.
    weeks : int
        The offset in weeks, positive if the sensor's clock is ahead; 0 if it is not whole weeks.
    """

    how: str
    ahead: bool
    why: str
    weeks: int = 0

    def words(self, to_the_ins: bool, week: int | None, key: str, whose: str = "the INS's") -> str:
        """Return the text that states how far one clock is ahead of or behind another, the cause and the remedy.

        Parameters
        ----------
        to_the_ins : bool
            True: the sensor's clock against the INS's; false: the INS's clock against the sensors'.
        week : int or None
            The GPS week in the session's settings. The right week follows from it. None: the settings have no week.
        key : str
            The setting that holds the week.
        whose : str
            Name of the clock that serves as the reference, for the text.
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
    """Yield a finding for each sensor that ran without the INS; if both are off equally, one for the INS's clock.

    Parameters
    ----------
    epochs : Mapping[str, Times]
        By sensor the times of its records, ascending. The key ``ins`` is required.
    max_gap_ns : int
        A longer time without a record is a pause.
    files : Sequence[SurveyedFile]
        The session's files.
    weeks : Mapping[str, int or None]
        By sensor the setting gps_week.
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
                "fault" if outside or between - share > 1 - ENOUGH else "look",  # look: it began earlier or ended later
            )


def _pauses(t_ns: Times, max_gap_ns: int) -> bool:
    """Return whether a sensor paused."""
    return len(split_at_gaps(t_ns, max_gap_ns)) > 1


def _from(epochs: Mapping[str, Times]) -> str:
    return ", ".join(f"{sensor} from {utc_text(epochs[sensor][0])}" for sensor in ("laser", "mbes") if sensor in epochs)


def _amount(offset_ns: int) -> str:
    """Return the size of an offset as text: in whole weeks or hours if it is a multiple of them, else in seconds.

    >>> _amount(18 * NS), _amount(-2 * WEEK_NS)
    ('18 s', '2 weeks')
    """
    size = abs(offset_ns)
    how = plural(size // WEEK_NS, "week") if size >= WEEK_NS and size % WEEK_NS == 0 else f"{size / NS:g} s"
    return plural(size // HOUR_NS, "hour") if size % HOUR_NS == 0 and size < WEEK_NS else how


def _offset(t_ns: Times, running: Sequence[tuple[int, int]], apart: bool, pauses: bool) -> Offset | None:
    """Return the offset of known cause that moves the sensor's times into the INS's; None if there is none.

    Weeks, days and hours are tried only if less than a tenth of the sensor's times lie within the INS's (``apart``).
    Leap seconds are tried then too, and if the sensor paused (``pauses``). Without a pause they are not tried, because
    a sensor that was switched on before the INS shows the same pattern.
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
