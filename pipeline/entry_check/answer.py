"""The answer of a check: what was entered, with its uncertainty, and which mistakes explain it.

The mount is fitted in several ways to place soundings (:mod:`pipeline.entry_check.ways`). A way stays in question if
its scatter is as good as the best. In each way the fitted rotation and lever arm are compared with every
:class:`Entered` value: it explains what was found if they differ by no more than a tolerance, three sigmas, and what
the scatter beyond rounding may hide. Of all explanations those of the least cost are the answer: one for each mistake,
a little more for each value that may take any size, such as a shift. So a mistake with known numbers goes before one
that fits anything.

"Entered rightly" needs more: the difference within the tolerance, and three sigmas of it too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.explanations import ATTITUDES, Explanation, explanations_of
from pipeline.entry_check.identification import Pairs
from pipeline.entry_check.judging import TOLERANCE_DEG, Judge, excess_of
from pipeline.entry_check.run_soundings import EntrySource
from pipeline.entry_check.ways import EACH_VALUE, PLAIN, Way, ways_of

Array = NDArray[np.float64]
EVEN = 0.5  # least evenness with which nothing is missing
WORSE = 0.02  # a way whose variance is larger than the least by this share of it, by WORSE_M squared,
WORSE_M, WORSE_OF_EXCESS = 0.0003, 3.0  # and by so many times what no way explains, is out of question


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
        By how much the found mount differs from the calibrated one; the angle is the largest about one axis.
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
    found = [(one, judge) for judge in judges for one in explanations_of(judge, source)]
    least = min(one.cost for one, _ in found)
    found = [(one, judge) for one, judge in found if one.cost < least + EACH_VALUE / 2]
    explanations = tuple({one.words: one for one, _ in reversed(found)}.values())[::-1]
    judge = found[0][1]
    R, lever = source.total.R_body_from_sensor, source.total.lever_arm_body_m
    turned = judge.turned_attitudes(R) if explanations[0].keys[2] == ATTITUDES else np.eye(3)
    return Answer(
        verdict=_verdict(explanations, pairs.evenness >= EVEN and judge.proves(turned @ R, turned @ lever)),
        way=judge.way,
        explanations=explanations,
        angle_deg=float(np.abs(judge.turn_deg(R)).max()),
        lever_m=judge.way.fitted.lever_arm_m - lever,
        angle_limit_deg=float(judge.angle_limit_deg.max()),
        lever_limit_m=judge.lever_limit_m,
        excess_m=judge.excess_m,
        rotation_right=judge.is_rotation(R, TOLERANCE_DEG),
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
    most = (1 + WORSE) * best**2 + WORSE_M**2 + WORSE_OF_EXCESS * excess_of(best, rounding_m) ** 2
    return [judge for judge in judges if judge.way.fitted.scatter_m**2 <= most]


def _verdict(explanations: Sequence[Explanation], is_proved: bool) -> str:
    right = [one.mount_is_right for one in explanations]
    if all(right):
        if not is_proved:
            return "uncertain"
        return "right_but" if explanations[0].cost else "right"
    return "undecidable" if len(explanations) > 1 else "wrong"
