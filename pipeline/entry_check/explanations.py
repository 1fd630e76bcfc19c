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
from pipeline.entry_check.judging import TOLERANCE_DEG, Judge
from pipeline.entry_check.run_soundings import EntrySource
from pipeline.entry_check.unknown_values import (
    EXACT,
    EXCHANGED,
    UNKNOWN_ANGLES,
    Option,
    unknown_angles,
    unknown_lever_arm,
)
from pipeline.entry_check.ways import EACH_VALUE, OWN, PLAIN

Array = NDArray[np.float64]
ANGLES, LEVER_ARM = "angles: ", "lever arm: "
MOST_ATTITUDE_DEG = 5.0  # by more no INS is aligned wrongly
ATTITUDES = "attitudes"


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


def explanations_of(judge: Judge, source: EntrySource) -> Iterator[Explanation]:
    """Yield what explains a way's mount: one mistake of both parts, or the fewest of either."""
    way, R, lever_arm_m = judge.way, source.total.R_body_from_sensor, source.total.lever_arm_body_m
    turn = judge.turn_deg(R)
    is_right = judge.is_rotation(R, TOLERANCE_DEG)
    angles = [one for one in rotations(source) if (is_right if one.key == RIGHT else judge.is_rotation(one.value))]
    arms = [one for one in lever_arms(source) if judge.is_lever(one.value)]
    both = {one.key: one for one in angles if one.key in {arm.key for arm in arms}}
    if RIGHT in both:
        yield Explanation((RIGHT, RIGHT, way.key), way.words, way.cost)
        return
    for key, one in both.items():
        yield Explanation((key, key, way.key), (*way.words, one.words), way.cost + one.mistakes)
    angle, lever_arm = unknown_angles(judge, source.total), unknown_lever_arm(judge, source.total)
    if angle.key != UNKNOWN_ANGLES:  # one value is another: what fits by rounding alone is out of question
        angles = [one for one in angles if not one.mistakes or judge.is_rotation(one.value, EXACT)]
    is_clear = any(judge.differs_clearly(one.value, R) for one in _fewest(angles))
    turned = _options(ANGLES, angles, angle, is_clear)
    is_clear = any(judge.differs_clearly(one.value, lever_arm_m) for one in _fewest(arms))
    moved = _options(LEVER_ARM, arms, lever_arm, is_clear)
    for option, arm in product(turned, moved):
        cost = way.cost + option.cost + arm.cost
        yield Explanation((option.key, arm.key, way.key), (*way.words, *option.words, *arm.words), cost)
    if way.key in (PLAIN, "heights") and not is_right and np.linalg.norm(turn) <= MOST_ATTITUDE_DEG:
        unknown = next((option.cost for option in turned if option.key == angle.key), angle.cost)
        yield from _attitudes(judge, source, OWN + EACH_VALUE if angle.key == EXCHANGED else unknown)


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
        pitch, roll, yaw = (signed(value, 3) for value in judge.turn_deg(R))
        words = (
            f"all attitudes of the software are turned by roll {roll}, pitch {pitch}, yaw {yaw}°: "
            "another alignment or processing of the INS"
        )
        yield Explanation((RIGHT, RIGHT, ATTITUDES), (*way.words, words), way.cost + cost)
