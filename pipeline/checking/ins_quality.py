"""What the INS says of itself: the state of its filter, the kind of its positions, its own sigmas."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.ins_drift import median_sigmas
from pipeline.checking.file_survey import Seen
from pipeline.checking.findings import Finding
from pipeline.checking.track import Leg
from pipeline.maths.geometry.passes import pass_of
from pipeline.readers.novatel import STATES

Mask = NDArray[np.bool_]
SHARE = 0.1  # of the records: fewer in a poorer state are a moment
GOOD_STATES = {"status": ("INS_SOLUTION_GOOD",), "type": ("INS_RTKFIXED", "PPP", "INS_PPP")}
REMEDIES = {
    "INS_ALIGNMENT_COMPLETE": "its attitude has not settled: sail figures of eight before the first pass until it says "
    "INS_SOLUTION_GOOD",
    "INS_SOLUTION_FREE": "it ran without GNSS: its position drifts",
}
LIMITS = {  # of the INS's own sigmas: from the first on worth a look, from the second on of no use
    "horizontal_m": (0.1, 0.5, "position is", "m", "see that it has corrections (RTK), or process it afterwards"),
    "vertical_m": (0.1, 0.5, "height is", "m", "see that it has corrections (RTK), or process it afterwards"),
    "roll_pitch_deg": (0.05, 0.5, "roll and pitch are", "°", "sail figures of eight before the first pass"),
    "heading_deg": (0.2, 1.0, "heading is", "°", "sail figures of eight before the first pass"),
}


@dataclass(frozen=True)
class Quality:
    """By file how many records are in which state; the INS's own sigmas (medians, units in the names); ``of_passes``:
    within the passes, otherwise of the whole log."""

    by_file: dict[str, dict[str, Counter[str]]] = field(default_factory=dict)
    together: dict[str, Counter[str]] = field(default_factory=dict)  # by kind, of what counts
    sigmas: dict[str, float] = field(default_factory=dict)
    of_passes: bool = False


def quality(files: Sequence[Seen], legs: Sequence[Leg]) -> Quality:
    """Within the passes where there are any."""
    of_ins = [seen for seen in files if seen.sensor == "ins"]
    together: dict[str, Counter[str]] = {}
    for seen in of_ins:
        inside = _inside(seen.columns["t_ns"], legs) if seen.states else slice(0)
        for kind, numbers in seen.states.items():
            together.setdefault(kind, Counter()).update(_counted(kind, numbers[inside]))
    told = [seen.sigmas for seen in of_ins if seen.sigmas]
    return Quality(
        {seen.name: {kind: _counted(kind, numbers) for kind, numbers in seen.states.items()} for seen in of_ins},
        together,
        median_sigmas(
            {name: np.concatenate([one[name][_inside(one["t_ns"], legs)] for one in told]) for name in told[0]}
        )
        if told
        else {},
        bool(legs),
    )


def _inside(t_ns: NDArray[np.int64], legs: Sequence[Leg]) -> Mask:
    if not legs:
        return np.ones(len(t_ns), dtype=bool)
    ordered = sorted(legs, key=lambda leg: leg.start_ns)
    starts, ends = (np.array([getattr(leg, name) for leg in ordered], np.int64) for name in ("start_ns", "end_ns"))
    return np.asarray(pass_of(t_ns, starts, ends) >= 0)


def _counted(kind: str, numbers: NDArray[np.uint8]) -> Counter[str]:
    values, counts = np.unique(numbers, return_counts=True)
    pairs = zip(values.tolist(), counts.tolist(), strict=True)
    return Counter({STATES[kind].get(value, f"{kind} {value}"): count for value, count in pairs})


def told(found: Quality) -> Iterator[Finding]:
    """A poor state within the passes, and sigmas with which no mount can be found, are faults; what may yet do, and a
    state of the log as a whole, where the passes are not known, is to be looked at."""
    where = "in the passes" if found.of_passes else "in the whole log"
    judged = False
    for name, (doubtful, useless, what, unit, remedy) in LIMITS.items():
        sigma = found.sigmas.get(name, 0.0)
        if sigma >= doubtful:
            judged = judged or sigma >= useless
            words = f"ins: its {what} good to {sigma:.2g}{'' if unit == '°' else ' '}{unit} by the log itself"
            yield Finding("ins quality", f"{words} (median {where}): {remedy}", "fault" if sigma >= useless else "look")
    for kind, counts in found.together.items():
        poor = {name: number for name, number in counts.items() if name not in GOOD_STATES[kind]}
        share = sum(poor.values()) / max(1, counts.total())
        if share <= SHARE:
            continue
        worst = max(poor, key=lambda name: poor[name])
        names = ", ".join(f"{name} in {number / counts.total():.0%}" for name, number in sorted(poor.items()))
        what = "status is" if kind == "status" else "positions are"
        remedy = REMEDIES.get(worst, "they are not of fixed RTK or PPP: see that it has corrections")
        settling = worst == "INS_ALIGNMENT_COMPLETE" and found.of_passes and "heading_deg" not in found.sigmas
        yield Finding(
            "ins quality",
            f"ins: its {what} {names} of its records {where}: {remedy}",
            "fault" if settling and not judged else "look",
        )
