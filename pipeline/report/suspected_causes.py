"""What is held and yet asks to be something else: the likely cause of residuals, in words.

Each held parameter has been freed by itself (table ``freed``). One that comes out farther from zero than noise and its
own considered sigma explain is a cause; of several, which one error makes move together, the one that explains most
(largest value / sigma) is named.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

FAR = 4.0  # sigmas: one in 16 000, of some forty parameters one in 400 sessions
UNITS = {"mbes_latency": "s", "laser_latency": "s", "sound_speed": "1"}
AXES = {"x": "pitch", "y": "roll", "z": "yaw"}
FACES = {"P1": "on the -y side", "P2": "of the wall", "P3": "on the +y side", "H": "that are horizontal"}


def causes(freed: pd.DataFrame) -> list[tuple[str, float]]:
    """Parameters that stand out, with how many sigmas they lie from zero by themselves; the most telling first."""
    found = []
    for row in freed[~freed["estimated"]].to_dict("records"):
        if _far(row):
            found.append((_words(row), abs(row["value"]) / row["sigma"]))
    return sorted(found, key=lambda one: -one[1])


@dataclass(frozen=True)
class Estimated:
    """What ``adjust.free`` names, as the adjustment found it: total sigma, unit, in words, and whether it lies farther
    from zero than its sigma and what the settings concede."""

    unknown: str
    value: float
    sigma_total: float
    unit: str
    words: str
    far: bool


def estimated(freed: pd.DataFrame) -> list[Estimated]:
    """What is free beside the mount and the surfaces; nothing, where the data leave no result."""
    return [
        Estimated(row["unknown"], row["value"], row["sigma"], UNITS[row["unknown"]], _words(row), _far(row))
        for row in freed[freed["estimated"] & np.isfinite(freed["sigma"])].to_dict("records")
    ]


def _far(row: Mapping[Any, Any]) -> bool:
    return bool(abs(row["value"]) > FAR * np.hypot(row["sigma"], row["considered"]))


def _words(row: Mapping[Any, Any]) -> str:
    """One parameter as freed by itself: where it stands, and what to look at."""
    name, value, sigma = str(row["unknown"]), float(row["value"]), float(row["sigma"])
    sensor = "laser" if name.startswith("laser") else "mbes"
    whose = {"laser": "the laser's", "mbes": "the sonar's"}[sensor]
    if name.endswith("_latency"):
        return (
            f"{whose} clock: its latency is {_size(1e3 * value, 1e3 * sigma, 'ms')} more than {sensor}.latency_s says"
        )
    if name == "sound_speed":
        return (
            f"the sound speed: it is {_size(100 * value, 100 * sigma, '%')} above that recorded, or given as "
            "mbes.sound_speed_m_s or mbes.svp; measure it at the head"
        )
    if name == "sound_speed_gradient":
        return f"a sound speed that changes with depth, by {_size(value, sigma, 'm/s')} per metre: take a (better) cast"
    if name.endswith("_range"):
        return f"{whose} ranges: they should be {_size(1e3 * value, 1e3 * sigma, 'mm')} longer"
    if name.startswith("laser_rotation"):
        angle = _size(np.degrees(value), np.degrees(sigma), "°")
        return f"laser.mount: it should be turned by {angle} about body {name[-1]} ({AXES[name[-1]]} of the boat)"
    if name.startswith("laser_lever_arm"):
        return f"laser.mount: {name[-1]}_m should be {_size(1e3 * value, 1e3 * sigma, 'mm')} more"
    family, _, what = name.removeprefix("wet_").replace("_turn_", "_turn ").rpartition("_")
    faces = FACES.get(family, f"of {family}")
    if what.startswith("turn"):
        angle = _size(np.degrees(value), np.degrees(sigma), "°")
        return f"the target: its wet faces {faces} are turned by {angle} against the dry ones"
    off = _size(1e3 * value, 1e3 * sigma, "mm")
    how = "lie higher" if family == "H" else "stand off"
    return f"the target: its wet faces {faces} {how} by {off}; check its shape in the config, and its survey"


def _size(value: float, sigma: float, unit: str) -> str:
    """A value with its sigma, to the sigma's first digit."""
    digits = max(0, -int(np.floor(np.log10(max(sigma, 1e-9)))))
    gap = "" if unit == "°" else " "
    return f"{value:+.{digits}f} ± {sigma:.{digits}f}{gap}{unit}"
