"""The answer of a check: what was entered, with its uncertainty, and which mistakes explain it.

The mount is fitted in several ways to place soundings (:mod:`pipeline.entry_check.ways`). A way stays in question if
its scatter is as good as the best. In each way the fitted rotation and lever arm are compared with every
:class:`Entered` value: it explains what was found if they differ by no more than a tolerance, three sigmas, and what
the scatter beyond rounding may hide. Of all explanations those of the least cost are the answer: one for each mistake,
a little more for each value that may take any size, such as a shift. So a mistake with known numbers goes before one
that fits anything.

"Entered rightly" needs more: the difference within the tolerance, and three sigmas of it too.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.console import signed
from pipeline.entry_check.hypotheses import RIGHT, Entered, lever_arms, rotations
from pipeline.entry_check.identification import Pairs
from pipeline.entry_check.run_soundings import EntrySource
from pipeline.entry_check.ways import EACH_VALUE, OWN, PLAIN, Way, ways_of
from pipeline.maths.geometry.rotations import rotation_error

Array = NDArray[np.float64]
TOLERANCE_DEG, TOLERANCE_M = 0.01, 0.005
SIGMAS = 3.0
WORSE = 0.02  # a way whose variance is larger than the least by this share of it, by WORSE_M squared,
WORSE_M, WORSE_OF_EXCESS = 0.0003, 3.0  # and by so many times what no way explains, is out of question
SPARE, SPARE_M = 1.3, 0.0005  # variance of the rounding by this factor, and this squared, are no excess
HIDDEN = 3.0  # a mount may be wrong by so many times the excess without being noticed
MOST_EXCESS_M = TOLERANCE_M / 2  # beyond, nothing is called right
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
class Answer:
    """The answer.

    Attributes
    ----------
    verdict
        "right"; "right_but": the mount is right, and something else is wrong; "wrong"; "undecidable": several
        explanations give the same numbers; "uncertain": nothing speaks against the entry, nor proves it closely.
    way
        The way by which the found mount is shown: that of the first explanation.
    explanations
        All of the least cost; right alone if the entry is right.
    angle_deg, lever_m
        By how much the found mount differs from the calibrated one.
    angle_limit_deg, lever_limit_m
        By how much more the entered one may differ: three sigmas, and what the excess may hide.
    excess_m
        Scatter beyond rounding, of each coordinate: rays, positions or attitudes are not the run's.
    rotation_right, lever_right
        Whether they may be right, each by itself.
    """

    verdict: str
    way: Way
    explanations: tuple[Explanation, ...]
    angle_deg: float
    lever_m: Array
    angle_limit_deg: float
    lever_limit_m: Array
    excess_m: float
    rotation_right: bool
    lever_right: bool

    @property
    def is_right(self) -> bool:
        """Whether the mount was entered rightly, and nothing else is wrong."""
        return self.verdict == "right"


@dataclass(frozen=True)
class Judge:
    """Compares the mount of one way with values that may have been entered."""

    way: Way
    angle_limit_deg: float
    lever_limit_m: Array
    excess_m: float

    @classmethod
    def of(cls, way: Way, rounding_m: float, range_m: float) -> "Judge":
        """Return the judge of a way; ``range_m``: of most soundings."""
        excess_m = _excess_m(way.fitted.scatter_m, rounding_m)
        sigma = np.sqrt(np.diag(way.fitted.covariance))
        angle = SIGMAS * float(np.degrees(sigma[:3]).max()) + HIDDEN * float(np.degrees(excess_m / range_m))
        return cls(way, angle, SIGMAS * sigma[3:6] + HIDDEN * excess_m, excess_m)

    def turn_deg(self, R: Array) -> Array:
        """Return the rotation vector (3,) from a rotation to the found one, degrees, body axes."""
        return np.asarray(np.degrees(rotation_error(self.way.fitted.R_body_from_mbes, R)))

    def turned_attitudes(self, R: Array) -> Array:
        """Return the turn D (3, 3) of all attitudes by which D R is the found rotation."""
        return np.asarray(self.way.fitted.R_body_from_mbes @ R.T)

    def is_rotation(self, R: Array) -> bool:
        """Whether a rotation may have been entered."""
        return bool(np.linalg.norm(self.turn_deg(R)) <= TOLERANCE_DEG + self.angle_limit_deg)

    def is_lever(self, lever_arm_m: Array) -> bool:
        """Whether a lever arm may have been entered."""
        return bool(np.all(np.abs(self.way.fitted.lever_arm_m - lever_arm_m) <= TOLERANCE_M + self.lever_limit_m))

    def proves(self, R: Array, lever_arm_m: Array) -> bool:
        """Whether it is certain that a mount was entered; z is not asked if any height will do."""
        angle = float(np.linalg.norm(self.turn_deg(R)))
        sigma = SIGMAS * np.sqrt(np.diag(self.way.fitted.covariance))[:6]
        off = np.abs(self.way.fitted.lever_arm_m - lever_arm_m)
        asked = 2 if self.way.any_height else 3
        near = angle <= TOLERANCE_DEG and bool((off[:asked] <= TOLERANCE_M).all())
        close = np.degrees(sigma[:3].max()) <= TOLERANCE_DEG and bool((sigma[3 : 3 + asked] <= TOLERANCE_M).all())
        return near and bool(close) and self.excess_m <= MOST_EXCESS_M


def answer_of(pairs: Pairs, source: EntrySource, heights_differ: bool, rounding_m: float) -> Answer:
    """Return the answer.

    Parameters
    ----------
    pairs
        Soundings and where the file has them.
    source
        What may have been entered.
    heights_differ
        Whether the user says that the file's heights are above another surface: then z is hardly judged.
    rounding_m
        Half the step of the file's coordinates.
    """
    judges = _in_question(pairs, source, heights_differ, rounding_m)
    found = [(one, judge) for judge in judges for one in _explanations(judge, source)]
    found = found or [(_unexplained(judges[0], source), judges[0])]
    least = min(one.cost for one, _ in found)
    found = [(one, judge) for one, judge in found if one.cost < least + EACH_VALUE / 2]
    explanations = tuple({one.words: one for one, _ in reversed(found)}.values())[::-1]
    judge = found[0][1]
    R, lever = source.total.R_body_from_sensor, source.total.lever_arm_body_m
    turned = judge.turned_attitudes(R) if explanations[0].keys[2] == ATTITUDES else np.eye(3)
    return Answer(
        verdict=_verdict(explanations, judge.proves(turned @ R, turned @ lever)),
        way=judge.way,
        explanations=explanations,
        angle_deg=float(np.linalg.norm(judge.turn_deg(R))),
        lever_m=judge.way.fitted.lever_arm_m - lever,
        angle_limit_deg=judge.angle_limit_deg,
        lever_limit_m=judge.lever_limit_m,
        excess_m=judge.excess_m,
        rotation_right=judge.is_rotation(R),
        lever_right=judge.is_lever(lever),
    )


def _in_question(pairs: Pairs, source: EntrySource, heights_differ: bool, rounding_m: float) -> list[Judge]:
    """Return the judges of the ways that are in question: the plain one alone where it leaves nothing to explain."""
    range_m = float(np.median(np.linalg.norm(pairs.soundings.points_mbes_m, axis=1)))
    judges: list[Judge] = []
    for way in ways_of(pairs, source, heights_differ):
        judges.append(Judge.of(way, rounding_m, range_m))
        R, lever_arm_m = source.total.R_body_from_sensor, source.total.lever_arm_body_m
        if way.key == PLAIN and not judges[0].excess_m and judges[0].proves(R, lever_arm_m):
            return judges
    best = min(judge.way.fitted.scatter_m for judge in judges)
    most = (1 + WORSE) * best**2 + WORSE_M**2 + WORSE_OF_EXCESS * _excess_m(best, rounding_m) ** 2
    return [judge for judge in judges if judge.way.fitted.scatter_m**2 <= most]


def _verdict(explanations: Sequence[Explanation], is_proved: bool) -> str:
    right = [one.mount_is_right for one in explanations]
    if all(right):
        if not is_proved:
            return "uncertain"
        return "right_but" if explanations[0].cost else "right"
    return "undecidable" if len(explanations) > 1 else "wrong"


def _excess_m(scatter_m: float, rounding_m: float) -> float:
    """Return what the scatter of a coordinate has beyond rounding to steps of 2 h, whose variance is h² / 3."""
    return float(np.sqrt(max(scatter_m**2 - SPARE * rounding_m**2 / 3 - SPARE_M**2, 0.0)))


def _fewest(entered: Sequence[Entered]) -> list[Entered]:
    least = min((one.mistakes for one in entered), default=0)
    return [one for one in entered if one.mistakes == least]


def _explanations(judge: Judge, source: EntrySource) -> Iterator[Explanation]:
    """Yield what explains a way's mount: one mistake of both parts, the fewest of either, values that no list has."""
    way = judge.way
    angles = [one for one in rotations(source) if judge.is_rotation(one.value)]
    arms = [one for one in lever_arms(source) if judge.is_lever(one.value)]
    both = {one.key: one for one in angles if one.key in {arm.key for arm in arms}}
    if RIGHT in both:
        yield Explanation((RIGHT, RIGHT, way.key), way.words, way.cost)
        return
    for key, one in both.items():
        yield Explanation((key, key, way.key), (*way.words, one.words), way.cost + one.mistakes)
    for angle in _fewest(angles):
        for arm in _fewest(arms):
            wrong = [one for one in (angle, arm) if one.mistakes]
            parts = tuple(f"{'angles' if one is angle else 'lever arm'}: {one.words}" for one in wrong)
            cost = way.cost + sum(one.mistakes for one in wrong)
            yield Explanation((angle.key, arm.key, way.key), (*way.words, *parts), cost)
    if not (angles and arms):
        yield from _unknown(judge, source, _fewest(angles), _fewest(arms))
    if way.key in (PLAIN, "heights"):
        yield from _attitudes(judge, source)


def _unknown(
    judge: Judge, source: EntrySource, angles: Sequence[Entered], arms: Sequence[Entered]
) -> Iterator[Explanation]:
    """Yield explanations by one part that no list has, with each of the other part's."""
    way = judge.way
    for angle in angles:
        words, values = _point_words(judge, source)
        parts = [f"angles: {angle.words}"] * bool(angle.mistakes) + [words]
        cost = way.cost + angle.mistakes + OWN + EACH_VALUE * values
        yield Explanation((angle.key, OTHER_POINT, way.key), (*way.words, *parts), cost)
    for arm in arms:
        words, values = _angle_words(judge, source)
        parts = [words] + [f"lever arm: {arm.words}"] * bool(arm.mistakes)
        cost = way.cost + arm.mistakes + OWN + EACH_VALUE * values
        yield Explanation((UNKNOWN_ANGLES, arm.key, way.key), (*way.words, *parts), cost)
    if not angles and not arms:
        yield _unexplained(judge, source)


def _unexplained(judge: Judge, source: EntrySource) -> Explanation:
    way, (angles, more), (point, values) = judge.way, _angle_words(judge, source), _point_words(judge, source)
    cost = way.cost + 2 * OWN + EACH_VALUE * (more + values)
    return Explanation((UNKNOWN_ANGLES, OTHER_POINT, way.key), (*way.words, angles, point), cost)


def _attitudes(judge: Judge, source: EntrySource) -> Iterator[Explanation]:
    """Yield that all attitudes are turned by one rotation D: then D R is found, and D t."""
    way, R = judge.way, source.total.R_body_from_sensor
    turn = judge.turn_deg(R)
    if judge.is_rotation(R) or np.linalg.norm(turn) > MOST_ATTITUDE_DEG:
        return
    if judge.is_lever(judge.turned_attitudes(R) @ source.total.lever_arm_body_m):
        words = (
            f"all attitudes of the software are turned by {_turn_words(turn)}: "
            "another alignment or processing of the INS"
        )
        cost = way.cost + OWN + EACH_VALUE * _values(turn, TOLERANCE_DEG)
        yield Explanation((RIGHT, RIGHT, ATTITUDES), (*way.words, words), cost)


def _angle_words(judge: Judge, source: EntrySource) -> tuple[str, int]:
    turn = judge.turn_deg(source.total.R_body_from_sensor)
    words = f"the angles are off by {_turn_words(turn)}, and no known mistake explains it"
    return words, _values(turn, TOLERANCE_DEG)


def _point_words(judge: Judge, source: EntrySource) -> tuple[str, int]:
    off = judge.way.fitted.lever_arm_m - source.total.lever_arm_body_m
    x, y, z = (signed(value, 3) for value in off)
    words = f"the lever arm is off by x {x}, y {y}, z {z} m (starboard, forward, up): it is counted from another point"
    return words, _values(off, TOLERANCE_M)


def _turn_words(turn_deg: Array) -> str:
    pitch, roll, yaw = (signed(value, 3) for value in turn_deg)
    return f"roll {roll}, pitch {pitch}, yaw {yaw}°"


def _values(off: Array, tolerance: float) -> int:
    return max(int((np.abs(off) > tolerance).sum()), 1)
