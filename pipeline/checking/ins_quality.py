"""The quality that the INS's log states: the status of its filter, the type of its positions, its own sigmas."""

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
SHARE = 0.1  # share of the records up to which a poor state does not matter
GOOD_STATES = {"status": ("INS_SOLUTION_GOOD",), "type": ("INS_RTKFIXED", "PPP", "INS_PPP")}
REMEDIES = {
    "INS_ALIGNMENT_COMPLETE": "its attitude has not settled: sail figures of eight before the first pass until it says "
    "INS_SOLUTION_GOOD",
    "INS_SOLUTION_FREE": "it ran without GNSS: its position drifts",
}
LIMITS = {  # of the INS's own sigmas: from the first limit on a look, from the second on a fault
    "horizontal_m": (0.1, 0.5, "position is", "m", "see that it has corrections (RTK), or process it afterwards"),
    "vertical_m": (0.1, 0.5, "height is", "m", "see that it has corrections (RTK), or process it afterwards"),
    "roll_pitch_deg": (0.05, 0.5, "roll and pitch are", "°", "sail figures of eight before the first pass"),
    "heading_deg": (0.2, 1.0, "heading is", "°", "sail figures of eight before the first pass"),
}


@dataclass(frozen=True)
class InsQuality:
    """States and sigmas in the INS's log.

    Attributes
    ----------
    by_file : dict[str, dict[str, Counter[str]]]
        By file and by kind of state (``status``, ``type``), the number of records in each state.
    together : dict[str, Counter[str]]
        By kind of state, the number of records in each state over all files, among the records that count.
    sigmas : dict[str, float]
        Medians of the INS's own sigmas over the records that count; units in the names.
    of_passes : bool
        True: the records within the passes count; false: all records count.
    """

    by_file: dict[str, dict[str, Counter[str]]] = field(default_factory=dict)
    together: dict[str, Counter[str]] = field(default_factory=dict)
    sigmas: dict[str, float] = field(default_factory=dict)
    of_passes: bool = False


def assess_ins_quality(files: Sequence[SurveyedFile], legs: Sequence[Leg]) -> InsQuality:
    """Return the states and sigmas in the INS's log, within the legs if there are any."""
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
    """Return a mask (n,): true for times within a leg. Without legs all are true."""
    if not legs:
        return np.ones(len(t_ns), dtype=bool)
    ordered = sorted(legs, key=lambda leg: leg.start_ns)
    starts, ends = (np.array([getattr(leg, name) for leg in ordered], np.int64) for name in ("start_ns", "end_ns"))
    return np.asarray(pass_of(t_ns, starts, ends) >= 0)


def _counted(kind: str, numbers: NDArray[np.uint8]) -> Counter[str]:
    """Return the number of records by the name of their state."""
    values, counts = np.unique(numbers, return_counts=True)
    pairs = zip(values.tolist(), counts.tolist(), strict=True)
    return Counter({STATES[kind].get(value, f"{kind} {value}"): count for value, count in pairs})


def quality_findings(quality: InsQuality) -> Iterator[Finding]:
    """Yield findings for large sigmas and poor states in an INS's log.

    Sigmas above the second limit are a fault. An attitude that has not settled within the passes is a fault too, unless
    the log states a sigma of the heading or another sigma is a fault already. All other findings are a ``look``.
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
