"""Which mistakes explain the mount that was found in one way to place soundings.

Each part, angles and lever arm, is explained by entered values that the catalogue has, or else by any others. Where the
catalogue's value is so near the right one that the data cannot tell it from others in between, those explain as well.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.console import signed
from pipeline.entry_check.hypotheses import RIGHT, Entered, lever_arms, rotations
from pipeline.entry_check.judging import TOLERANCE_DEG, TOLERANCE_M, Judge
from pipeline.entry_check.run_soundings import EntrySource
from pipeline.entry_check.ways import EACH_VALUE, OWN, PLAIN

Array = NDArray[np.float64]
ANGLES, LEVER_ARM = "angles: ", "lever arm: "
MOST_ATTITUDE_DEG = 5.0  # by more no INS is aligned wrongly
UNKNOWN_ANGLES, OTHER_POINT, ATTITUDES = "unknown_angles", "other_point", "attitudes"


@dataclass(frozen=True)
class Explanation:
    """Mistakes that explain what was found.

    Attributes
    ----------
    keys
        Their codes: of the angles, the lever arm, the way; "right" and "plain" where nothing is wrong.
    words
        One sentence for each mistake.
    cost
        Their number, and a little more for each value that may take any size.
    """

    keys: tuple[str, str, str]
    words: tuple[str, ...]
    cost: float

    @property
    def mount_is_right(self) -> bool:
        """Whether angles and lever arm are right, whatever else is wrong."""
        return self.keys[:2] == (RIGHT, RIGHT)


@dataclass(frozen=True)
class Option:
    """What explains one part of the mount: a code, words (none: it is right), and a cost."""

    key: str
    words: tuple[str, ...]
    cost: float


def explanations_of(judge: Judge, source: EntrySource) -> Iterator[Explanation]:
    """Yield what explains a way's mount: one mistake of both parts, or the fewest of either."""
    way, R, lever_arm_m = judge.way, source.total.R_body_from_sensor, source.total.lever_arm_body_m
    turn, off = judge.turn_deg(R), way.fitted.lever_arm_m - lever_arm_m
    is_right = judge.is_rotation(R, TOLERANCE_DEG)
    angles = [one for one in rotations(source) if (is_right if one.key == RIGHT else judge.is_rotation(one.value))]
    arms = [one for one in lever_arms(source) if judge.is_lever(one.value)]
    both = {one.key: one for one in angles if one.key in {arm.key for arm in arms}}
    if RIGHT in both:
        yield Explanation((RIGHT, RIGHT, way.key), way.words, way.cost)
        return
    for key, one in both.items():
        yield Explanation((key, key, way.key), (*way.words, one.words), way.cost + one.mistakes)
    values = _values(turn, TOLERANCE_DEG + judge.angle_limit_deg), _values(off, TOLERANCE_M + judge.lever_limit_m)
    words = f"the angles are off by {_turn_words(turn)}, and no known mistake explains it"
    other = Option(UNKNOWN_ANGLES, (words,), OWN + EACH_VALUE * values[0])
    turned = _options(ANGLES, angles, other, any(judge.differs_clearly(one.value, R) for one in _fewest(angles)))
    x, y, z = (signed(value, 3) for value in off)
    words = f"the lever arm is off by x {x}, y {y}, z {z} m (starboard, forward, up): it is counted from another point"
    other = Option(OTHER_POINT, (words,), OWN + EACH_VALUE * values[1])
    is_clear = any(judge.differs_clearly(one.value, lever_arm_m) for one in _fewest(arms))
    for angle, arm in product(turned, _options(LEVER_ARM, arms, other, is_clear)):
        cost = way.cost + angle.cost + arm.cost
        yield Explanation((angle.key, arm.key, way.key), (*way.words, *angle.words, *arm.words), cost)
    if way.key in (PLAIN, "heights") and not is_right and np.linalg.norm(turn) <= MOST_ATTITUDE_DEG:
        cost = next((option.cost for option in turned if option.key == UNKNOWN_ANGLES), OWN + EACH_VALUE * values[0])
        yield from _attitudes(judge, source, cost)


def _options(part: str, entered: Sequence[Entered], other: Option, is_clear: bool) -> list[Option]:
    """Return what explains a part: the catalogue's, and any other values where that is not clear, at the same cost."""
    known = [Option(one.key, (f"{part}{one.words}",) * bool(one.mistakes), one.mistakes) for one in _fewest(entered)]
    if not known:
        return [other]
    if is_clear or not known[0].cost:
        return known
    return [*known, Option(other.key, other.words, known[0].cost)]


def _fewest(entered: Sequence[Entered]) -> list[Entered]:
    least = min((one.mistakes for one in entered), default=0)
    return [one for one in entered if one.mistakes == least]


def _attitudes(judge: Judge, source: EntrySource, cost: float) -> Iterator[Explanation]:
    """Yield that all attitudes are turned by one rotation D: then D R is found, and D t."""
    way, R = judge.way, source.total.R_body_from_sensor
    if judge.is_lever(judge.turned_attitudes(R) @ source.total.lever_arm_body_m):
        words = (
            f"all attitudes of the software are turned by {_turn_words(judge.turn_deg(R))}: "
            "another alignment or processing of the INS"
        )
        yield Explanation((RIGHT, RIGHT, ATTITUDES), (*way.words, words), way.cost + cost)


def _turn_words(turn_deg: Array) -> str:
    pitch, roll, yaw = (signed(value, 3) for value in turn_deg)
    return f"roll {roll}, pitch {pitch}, yaw {yaw}°"


def _values(off: Array, allowed: Array) -> int:
    return max(int((np.abs(off) > allowed).sum()), 1)
