"""Angles and a lever arm that no known mistake explains: one value mistyped, or any other values."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.console import signed
from pipeline.entry_check.judging import TOLERANCE_DEG, TOLERANCE_M, Judge
from pipeline.entry_check.ways import EACH_VALUE, OWN
from pipeline.mount import Mounted, setting_change

Array = NDArray[np.float64]
UNKNOWN_ANGLES, OTHER_POINT, MISTYPED, EXCHANGED = "unknown_angles", "other_point", "mistyped", "exchanged"
EXACT = 0.0006  # degrees, m: values that were typed with three decimals are within it
MOST_MISTYPED_DEG = 1.0  # a larger error of one angle is called so only if two digits are exchanged
DECIMALS = 4  # of the entry sheets


@dataclass(frozen=True)
class Option:
    """What explains one part of the mount: a code, words (none: it is right), and a cost."""

    key: str
    words: tuple[str, ...]
    cost: float


def unknown_angles(judge: Judge, total: Mounted) -> Option:
    """Return what explains the found angles if nothing else does: one that was mistyped, or other angles."""
    names = {"roll_deg": "roll", "pitch_deg": "pitch", "yaw_deg": "yaw"}
    wanted, found = total.settings(), judge.mount.settings()
    limit = float(judge.angle_limit_deg.max())
    mistyped = _mistyped(wanted, found, names, np.full(3, limit))
    if mistyped is not None and (mistyped.exchanged or mistyped.change <= MOST_MISTYPED_DEG):
        return mistyped.option("°")
    changes = np.array([setting_change(found, wanted, key) for key in names])
    roll, pitch, yaw = (signed(change, 3) for change in changes)
    words = f"the angles are off by roll {roll}, pitch {pitch}, yaw {yaw}°, and no known mistake explains it"
    return Option(UNKNOWN_ANGLES, (words,), OWN + EACH_VALUE * _values(changes, TOLERANCE_DEG + limit))


def unknown_lever_arm(judge: Judge, total: Mounted) -> Option:
    """Return what explains the found lever arm if nothing else does: two digits exchanged, or another point."""
    names = {"x_m": "x", "y_m": "y", "z_m": "z"}
    wanted, found = total.settings(), judge.mount.settings()
    mistyped = _mistyped(wanted, found, names, judge.lever_limit_m)
    if mistyped is not None and mistyped.exchanged:
        return mistyped.option(" m")
    off = np.array([found[key] - wanted[key] for key in names])
    x, y, z = (signed(value, 3) for value in off)
    words = f"the lever arm is off by x {x}, y {y}, z {z} m (starboard, forward, up): it is counted from another point"
    return Option(OTHER_POINT, (words,), OWN + EACH_VALUE * _values(off, TOLERANCE_M + judge.lever_limit_m))


@dataclass(frozen=True)
class _Mistyped:
    """A single value that differs: its name, as entered and as wanted, the change, whether digits were exchanged."""

    name: str
    entered: float
    wanted: float
    change: float
    exchanged: bool

    def option(self, unit: str) -> Option:
        entered, wanted = (f"{value:.{DECIMALS}f}{unit}" for value in (self.entered, self.wanted))
        if self.exchanged:
            words = f"{self.name} was entered as {entered} in place of {wanted}: two digits are exchanged"
            return Option(EXCHANGED, (words,), OWN)
        return Option(MISTYPED, (f"{self.name} was entered as {entered} in place of {wanted}",), OWN + EACH_VALUE)


def _values(off: Array, allowed: Array | float) -> int:
    return max(int((np.abs(off) > allowed).sum()), 1)


def _mistyped(
    wanted: Mapping[str, float], found: Mapping[str, float], names: Mapping[str, str], limits: Array
) -> _Mistyped | None:
    """Return the single setting that differs from the calibrated one; None if several do, or none.

    Parameters
    ----------
    wanted, found
        Calibrated and found settings.
    names
        Names of the part's settings by key.
    limits
        (3,): by how much each may differ beside what was entered.
    """
    changes = np.array([setting_change(found, wanted, key) for key in names])
    (places,) = np.nonzero(np.abs(changes) > EXACT + limits)
    if len(places) != 1:
        return None
    place = places[0]
    key = list(names)[place]
    near = [value for value in exchanges(wanted[key]) if abs(value - found[key]) <= EXACT + limits[place]]
    value = min(near, key=lambda one: abs(one - found[key]), default=found[key])
    return _Mistyped(names[key], value, wanted[key], float(abs(changes[place])), bool(near))


def exchanges(value: float) -> list[float]:
    """Return the values that come of exchanging two neighbouring digits.

    >>> exchanges(-48.7)[:3]
    [-84.7, -47.8, -48.07]
    """
    text = f"{value:.{DECIMALS}f}"
    digits = [place for place, letter in enumerate(text) if letter.isdigit()]
    found = []
    for one, other in pairwise(digits):
        letters = list(text)
        letters[one], letters[other] = letters[other], letters[one]
        if letters[one] != letters[other]:
            found.append(float("".join(letters)))
    return found
