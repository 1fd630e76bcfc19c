"""What the INS says of itself: the state of its filter, the kind of its positions, its own sigmas."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.ins_drift import median_sigmas
from pipeline.checking.file_survey import SurveyedFile
from pipeline.checking.findings import Finding
from pipeline.checking.track import Leg
from pipeline.maths.geometry.passes import pass_of
from pipeline.readers.novatel import STATES

Mask = NDArray[np.bool_]
SHARE = 0.1  # of the records: a smaller share in a poor state is accepted as brief
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
class InsQuality:
    """What the INS says of itself.

    Attributes
    ----------
    by_file : dict[str, dict[str, Counter[str]]]
        By file, and by kind of state, how many records are in which state.
    together : dict[str, Counter[str]]
        The same by kind of state, of the records that count.
    sigmas : dict[str, float]
        The INS's own sigmas, medians; units in the names.
    of_passes : bool
        Whether the records within the passes count; else those of the whole log.
    """

    by_file: dict[str, dict[str, Counter[str]]] = field(default_factory=dict)
    together: dict[str, Counter[str]] = field(default_factory=dict)
    sigmas: dict[str, float] = field(default_factory=dict)
    of_passes: bool = False


def assess_ins_quality(files: Sequence[SurveyedFile], legs: Sequence[Leg]) -> InsQuality:
    """Return what the INS says of itself: within the passes, where there are any."""
    ins_files = [file for file in files if file.sensor == "ins"]
    together: dict[str, Counter[str]] = {}
    for file in ins_files:
        inside = _inside(file.columns["t_ns"], legs) if file.states else slice(0)
        for kind, numbers in file.states.items():
            together.setdefault(kind, Counter()).update(_counted(kind, numbers[inside]))
    stated = [file.sigmas for file in ins_files if file.sigmas]
    sigmas = {
        name: np.concatenate([columns[name][_inside(columns["t_ns"], legs)] for columns in stated])
        for name in (stated[0] if stated else ())
    }
    return InsQuality(
        by_file={
            file.name: {kind: _counted(kind, numbers) for kind, numbers in file.states.items()} for file in ins_files
        },
        together=together,
        sigmas=median_sigmas(sigmas) if stated else {},
        of_passes=bool(legs),
    )


def _inside(t_ns: NDArray[np.int64], legs: Sequence[Leg]) -> Mask:
    """Return which times are within the legs; all, where there is no leg."""
    if not legs:
        return np.ones(len(t_ns), dtype=bool)
    ordered = sorted(legs, key=lambda leg: leg.start_ns)
    starts, ends = (np.array([getattr(leg, name) for leg in ordered], np.int64) for name in ("start_ns", "end_ns"))
    return np.asarray(pass_of(t_ns, starts, ends) >= 0)


def _counted(kind: str, numbers: NDArray[np.uint8]) -> Counter[str]:
    """Return how many records are in which state, by its name."""
    values, counts = np.unique(numbers, return_counts=True)
    pairs = zip(values.tolist(), counts.tolist(), strict=True)
    return Counter({STATES[kind].get(value, f"{kind} {value}"): count for value, count in pairs})


def quality_findings(quality: InsQuality) -> Iterator[Finding]:
    """Yield the poor states and the large sigmas in an INS's log.

    A poor state within the passes is a fault, and so are sigmas too large for a calibration. Sigmas that may still do
    are only worth a look, and so is a poor state of the whole log, if the passes are not known.
    """
    where = "in the passes" if quality.of_passes else "in the whole log"
    judged = False
    for name, (doubtful, useless, what, unit, remedy) in LIMITS.items():
        sigma = quality.sigmas.get(name, 0.0)
        if sigma >= doubtful:
            judged = judged or sigma >= useless
            words = f"ins: its {what} good to {sigma:.2g}{'' if unit == '°' else ' '}{unit} by the log itself"
            yield Finding("ins quality", f"{words} (median {where}): {remedy}", "fault" if sigma >= useless else "look")
    for kind, counts in quality.together.items():
        poor = {name: number for name, number in counts.items() if name not in GOOD_STATES[kind]}
        share = sum(poor.values()) / max(1, counts.total())
        if share <= SHARE:
            continue
        worst = max(poor, key=lambda name: poor[name])
        names = ", ".join(f"{name} in {number / counts.total():.0%}" for name, number in sorted(poor.items()))
        what = "status is" if kind == "status" else "positions are"
        remedy = REMEDIES.get(worst, "they are not of fixed RTK or PPP: see that it has corrections")
        settling = worst == "INS_ALIGNMENT_COMPLETE" and quality.of_passes and "heading_deg" not in quality.sigmas
        yield Finding(
            "ins quality",
            f"ins: its {what} {names} of its records {where}: {remedy}",
            "fault" if settling and not judged else "look",
        )
