"""The difference of the mounts of two runs, its tests, and the answer in one sentence."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.maths.comparison import compare_estimates
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.results.finished_run import FinishedRun, estimate_of

SIGNIFICANCE = 0.01  # level of the joint test: the share of false alarms if no mount has moved
UNITS = ("deg",) * 3 + ("m",) * 3
SCALES = {"deg": ("°", 1.0, 4), "m": (" mm", 1000.0, 2)}  # by unit: unit, factor and digits on the screen
Row = dict[str, Any]


@dataclass(frozen=True)
class Tolerances:
    """Largest tolerated differences of an angle (degrees) and of a lever-arm component (mm); None: no limit."""

    angle_deg: float | None = None
    lever_arm_mm: float | None = None

    def limits(self) -> list[float | None]:
        """Return the limits of the six parameters, three in degrees and three in metres; None: no limit."""
        return [self.angle_deg] * 3 + [None if self.lever_arm_mm is None else self.lever_arm_mm / 1000] * 3


def mount_difference(
    first: FinishedRun, second: FinishedRun, tolerances: Tolerances, not_compared: list[str]
) -> dict[str, Any]:
    """Return the six differences ``second`` minus ``first`` and their joint test, as plain values.

    Parameters
    ----------
    first, second
        The runs.
    tolerances
        A mount parameter with a larger difference is listed by name.
    not_compared
        Sentences on results that cannot be compared; this function may add one.
    """
    estimates = [estimate_of(run.result) for run in (first, second)]
    before, after = estimates
    if before is None or after is None:
        runs = zip((first, second), estimates, strict=True)
        without = [run.result["session"] for run, estimate in runs if estimate is None]
        not_compared.append(f"mount: {' and '.join(without)} has no result with a covariance")
        return {"comparable": False, "parameters": [], "joint": None, "beyond_tolerance": []}
    comparison = compare_estimates(before, after)
    moved = comparison.significant(SIGNIFICANCE)
    scale = [np.degrees(1.0)] * 3 + [1.0] * 3
    limits = tolerances.limits()
    rows: list[Row] = []
    beyond = []
    for _, k, *_ in PARAMETERS:
        difference, limit = float(comparison.difference[k] * scale[k]), limits[k]
        if limit is not None and abs(difference) > limit:
            beyond.append(MOUNT_WORDS[k])
        rows.append(
            {
                "parameter": MOUNT_WORDS[k],
                "unit": UNITS[k],
                "difference": difference,
                "sigma": float(comparison.sigma[k] * scale[k]),
                "z": float(comparison.z[k]),
                "moved": k in moved,
            }
        )
    joint = {
        "statistic": comparison.statistic,
        "dof": 6,
        "probability": comparison.probability,
        "level": SIGNIFICANCE,
        "significant": comparison.probability < SIGNIFICANCE,
    }
    return {"comparable": True, "parameters": rows, "joint": joint, "beyond_tolerance": beyond}


def is_moved(difference: Mapping[str, Any]) -> bool:
    """Return whether the mount differs significantly or beyond a tolerance; true also if there is no answer."""
    return not difference["answered"] or difference["joint"]["significant"] or bool(difference["beyond_tolerance"])


def is_same_result(difference: Mapping[str, Any]) -> bool:
    """Return whether both runs have exactly the same mount."""
    return difference["comparable"] and not any(row["difference"] for row in difference["parameters"])


def quantity_text(value: float, unit: str, sign: str = "+") -> str:
    """Return a difference or a sigma as text for the screen.

    Parameters
    ----------
    value
        The quantity, in degrees or metres.
    unit
        ``deg`` or ``m``; metres are shown as mm.
    sign
        ``+`` to show the sign of a positive value too.

    >>> quantity_text(0.0012, "m"), quantity_text(0.5, "deg", "")
    ('+1.20 mm', '0.5000°')
    """
    suffix, scale, digits = SCALES[unit]
    return f"{value * scale:{sign}.{digits}f}{suffix}"


def answer_sentence(difference: Mapping[str, Any]) -> str:
    """Return one sentence that says whether the mount has moved, or why there is no answer."""
    rejected = [
        f"{key} ({difference[key]['session']}) was rejected"
        for key in ("a", "b")
        if difference[key]["verdict"] == "rejected"
    ]
    if rejected and is_same_result(difference):
        return f"the same result in both; {_listed(rejected)}"
    if rejected:
        return f"no answer: {_listed(rejected)}, and what must not be used cannot be compared"
    if not difference["comparable"]:
        return f"no answer: {difference['not_compared'][0]}"
    moved = [row for row in difference["parameters"] if row["moved"]]
    chance = f"p = {difference['joint']['probability']:.2g}"
    if moved:
        each = [_with_sigma(row) for row in moved]
        rest = "" if len(moved) == len(MOUNT_WORDS) else "; the rest within noise"
        sentence = f"the sonar has moved, {_listed(each)}: significant ({chance}){rest}"
    elif is_same_result(difference):
        sentence = "the same result in both"
    else:
        sentence = f"nothing has moved: all six differences are within their noise ({chance})"
    if difference["beyond_tolerance"]:
        sentence += f"; beyond the tolerance: {_listed(difference['beyond_tolerance'])}"
    return sentence


def _with_sigma(row: Row) -> str:
    difference, sigma = quantity_text(row["difference"], row["unit"]), quantity_text(row["sigma"], row["unit"], "")
    return f"{row['parameter']} by {difference} ± {sigma}"


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)
