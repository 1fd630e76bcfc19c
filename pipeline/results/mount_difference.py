"""The difference of the mounts of two runs and its tests, as plain values."""

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.detectable_movement import POWER
from pipeline.maths.mount_parameters import MOUNT_WORDS, N_MOUNT, PARAMETERS
from pipeline.results.finished_run import FinishedRun
from pipeline.results.movement import SIGNIFICANCE, Movement, movement_between
from pipeline.results.session_estimate import session_estimate

Array = NDArray[np.float64]
UNITS = ("deg",) * 3 + ("m",) * 3
TO_UNITS = np.repeat([np.degrees(1.0), 1.0], 3)  # of rad and m to the units
SCALES = {"deg": ("°", 1.0, 4), "m": (" mm", 1000.0, 2)}  # by unit: unit, factor and digits on the screen
Row = dict[str, Any]


@dataclass(frozen=True)
class Tolerances:
    """Largest tolerated differences of an angle (degrees) and of a lever-arm component (mm); None: no limit."""

    angle_deg: float | None = None
    lever_arm_mm: float | None = None

    def limits(self) -> Array:
        """Return the limits (6,) of the six parameters, rad and m; NaN: no limit."""
        angle_rad = np.nan if self.angle_deg is None else np.radians(self.angle_deg)
        return np.repeat([angle_rad, np.nan if self.lever_arm_mm is None else self.lever_arm_mm / 1000], 3)


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
    before, after = estimates = [session_estimate(run.result) for run in (first, second)]
    if before is None or after is None:
        runs = zip((first, second), estimates, strict=True)
        without = [run.result["session"] for run, estimate in runs if estimate is None]
        not_compared.append(f"mount: {' and '.join(without)} has no result with a covariance")
        nothing: dict[str, Any] = {"joint": None, "errors": None, "parameters": [], "beyond_tolerance": []}
        return {"comparable": False, "answer": "none", **nothing}
    movement = movement_between(before, after, tolerances.limits())
    comparison = movement.difference
    beyond = np.abs(comparison.difference) > tolerances.limits()
    return {
        "comparable": True,
        "answer": movement.answer,
        "parameters": [_row(movement, k) for _, k, *_ in PARAMETERS],
        "joint": {
            "statistic": comparison.statistic,
            "dof": N_MOUNT,
            "probability": comparison.probability,
            "level": SIGNIFICANCE,
            "significant": comparison.probability < SIGNIFICANCE,
            "power": POWER,
        },
        "errors": {
            "common": list(movement.common),
            "own": list(movement.own),
            "differing": list(movement.differing),
            "cautious": movement.cautious,
        },
        "beyond_tolerance": [MOUNT_WORDS[k] for _, k, *_ in PARAMETERS if beyond[k]],
    }


def _row(movement: Movement, k: int) -> Row:
    """Return the values of a mount parameter, in degrees or metres."""
    found, visible = movement.difference, movement.detectable
    sizes = {
        "difference": found.difference,
        "sigma": found.sigma,
        "detectable": visible.surely,
        "detectable_alone": visible.alone,
        "limit": movement.limits,
    }
    row: Row = {"parameter": MOUNT_WORDS[k], "unit": UNITS[k], "moved": k in movement.moved}
    row |= {name: float(values[k] * TO_UNITS[k]) for name, values in sizes.items()}
    return row | {"z": float(found.z[k]), "uncertain": k in movement.uncertain, "mostly": movement.mostly[k]}


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


def least_text(value: float, unit: str) -> str:
    """Return a least size with two digits, rounded up, as text for the screen; ``unit``: deg or m, shown as mm.

    >>> least_text(0.1512, "deg"), least_text(0.00831, "m"), least_text(0.0123, "m")
    ('0.16°', '8.4 mm', '13 mm')
    """
    suffix, scale, _ = SCALES[unit]
    number = Decimal(f"{value * scale:.9g}")
    digit = Decimal(1).scaleb(number.adjusted() - 1)
    return f"{number.quantize(digit, ROUND_CEILING):f}{suffix}"
