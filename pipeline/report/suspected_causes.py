"""Suspected causes (fixed parameters that the residuals contradict), and the parameters that adjust.free names.

Table ``freed`` has the single-parameter test of each fixed parameter. A parameter is a suspected cause if its estimate
is farther from zero than noise and its a-priori sigma explain. One error often moves the estimates of several
parameters. The report names the cause that explains most, with the largest value over sigma.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

SIGNIFICANT = 4.0  # sigmas: by chance one of 16 000 parameters, so one of 400 sessions with forty parameters each
UNITS = {"mbes_latency": "s", "laser_latency": "s", "sound_speed": "1"}
AXES = {"x": "pitch", "y": "roll", "z": "yaw"}
FACES_OF_FAMILY = {"P1": "on the -y side", "P2": "of the wall", "P3": "on the +y side", "H": "that are horizontal"}


@dataclass(frozen=True)
class SuspectedCause:
    """A fixed parameter that would explain the residuals: its words, and its value over the sigma from noise."""

    words: str
    normalised: float


@dataclass(frozen=True)
class EstimatedParameter:
    """A parameter that ``adjust.free`` names.

    Attributes
    ----------
    unknown : name of the parameter
    value, sigma_total : estimate and total sigma in ``unit``
    words : the estimate, and the setting or device to check
    is_significant : whether the value is farther from zero than its sigma and its a-priori sigma explain
    """

    unknown: str
    value: float
    sigma_total: float
    unit: str
    words: str
    is_significant: bool


def suspected_causes(freed: pd.DataFrame) -> list[SuspectedCause]:
    """Return the suspected causes from table ``freed``, the one with the largest value over sigma first."""
    causes = [
        SuspectedCause(_words(row), abs(row["value"]) / row["sigma"])
        for row in freed[~freed["estimated"]].to_dict("records")
        if _is_significant(row)
    ]
    return sorted(causes, key=lambda cause: -cause.normalised)


def estimated_parameters(freed: pd.DataFrame) -> list[EstimatedParameter]:
    """Return the parameters of ``adjust.free`` with their estimates (table ``freed``); empty without a result."""
    return [
        EstimatedParameter(
            unknown=row["unknown"],
            value=row["value"],
            sigma_total=row["sigma"],
            unit=UNITS[row["unknown"]],
            words=_words(row),
            is_significant=_is_significant(row),
        )
        for row in freed[freed["estimated"] & np.isfinite(freed["sigma"])].to_dict("records")
    ]


def _is_significant(row: Mapping[Any, Any]) -> bool:
    return bool(abs(row["value"]) > SIGNIFICANT * np.hypot(row["sigma"], row["considered"]))


def _words(row: Mapping[Any, Any]) -> str:
    """Return in words the estimate of one parameter, and the setting or device to check."""
    name, value, sigma = str(row["unknown"]), float(row["value"]), float(row["sigma"])
    sensor = "laser" if name.startswith("laser") else "mbes"
    owner = {"laser": "the laser's", "mbes": "the sonar's"}[sensor]
    if name.endswith("_latency"):
        size = _size(1e3 * value, 1e3 * sigma, "ms")
        return f"{owner} clock: its latency is {size} more than {sensor}.latency_s says"
    if name == "sound_speed":
        return (
            f"the sound speed: it is {_size(100 * value, 100 * sigma, '%')} above that recorded, or given as "
            "mbes.sound_speed_m_s or mbes.svp; measure it at the head"
        )
    if name == "sound_speed_gradient":
        return f"a sound speed that changes with depth, by {_size(value, sigma, 'm/s')} per metre: take a (better) cast"
    if name.endswith("_range"):
        return f"{owner} ranges: they should be {_size(1e3 * value, 1e3 * sigma, 'mm')} longer"
    if name.startswith("laser_rotation"):
        angle = _size(np.degrees(value), np.degrees(sigma), "°")
        return f"laser.mount: it should be turned by {angle} about body {name[-1]} ({AXES[name[-1]]} of the boat)"
    if name.startswith("laser_lever_arm"):
        return f"laser.mount: {name[-1]}_m should be {_size(1e3 * value, 1e3 * sigma, 'mm')} more"
    return _words_of_wet_faces(name, value, sigma)


def _words_of_wet_faces(name: str, value: float, sigma: float) -> str:
    """Return in words a turn (rad) or shift (m) of a family's wet faces against its dry ones."""
    family, _, kind = name.removeprefix("wet_").replace("_turn_", "_turn ").rpartition("_")
    faces = FACES_OF_FAMILY.get(family, f"of {family}")
    if kind.startswith("turn"):
        angle = _size(np.degrees(value), np.degrees(sigma), "°")
        return f"the target: its wet faces {faces} are turned by {angle} against the dry ones"
    shift = _size(1e3 * value, 1e3 * sigma, "mm")
    verb = "lie higher" if family == "H" else "stand off"
    return f"the target: its wet faces {faces} {verb} by {shift}; check its shape in the config, and its survey"


def _size(value: float, sigma: float, unit: str) -> str:
    """Return a value and its sigma as text, with as many decimals as the first digit of the sigma has."""
    digits = max(0, -int(np.floor(np.log10(max(sigma, 1e-9)))))
    gap = "" if unit == "°" else " "
    return f"{value:+.{digits}f} ± {sigma:.{digits}f}{gap}{unit}"
