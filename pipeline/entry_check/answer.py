"""The answer of a check: what was entered, with its uncertainty, and which mistakes explain it.

The mount is fitted in several *ways* to place soundings: as all software should; with the heights of another reference;
with poses of other times; with a lever arm that is turned by the heading alone. A way stays in question if its scatter
is as good as the best. In each way the fitted rotation and lever arm are compared with every :class:`Entered` value: it
explains what was found if they differ by no more than a tolerance and three sigmas.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.hypotheses import RIGHT, Entered, lever_arms, rotations
from pipeline.entry_check.identification import Pairs
from pipeline.entry_check.mount_fit import FREE_MOUNT, FittedMount, fit_mount
from pipeline.entry_check.run_soundings import EntrySource, RunSoundings
from pipeline.maths.geometry.rotations import rotation_error

Array = NDArray[np.float64]
TOLERANCE_DEG, TOLERANCE_M = 0.01, 0.005
SIGMAS = 3.0
MOST_DEG, MOST_M = 0.05, 0.02  # three sigmas beyond: the data cannot tell
WORSE = 1.02  # a way with a scatter larger by this factor, and by WORSE_M (both in squares), is out of question
WORSE_M = 0.0003
LEAST_DELAY_S = 1e-4
HEIGHTS_FREE = (True,) * 5 + (False,) * 3 + (True, False)
RANGES_FREE = (True,) * 6 + (False,) * 3 + (True,)
PLAIN = "plain"


@dataclass(frozen=True)
class Way:
    """One way in which the software may have placed the soundings, and the mount by it.

    Attributes
    ----------
    key, words
        Its code, and what is wrong with it; "plain": nothing.
    fitted
        The mount that explains the pairs best.
    judged
        Which of t's components it can tell.
    """

    key: str
    words: str
    fitted: FittedMount
    judged: tuple[bool, bool, bool] = (True, True, True)


@dataclass(frozen=True)
class Explanation:
    """Mistakes that explain what was found.

    Attributes
    ----------
    keys
        Their codes: of the angles, the lever arm, the way; "right" where nothing is wrong.
    words
        One sentence for each mistake.
    mistakes
        Their number.
    """

    keys: tuple[str, str, str]
    words: tuple[str, ...]
    mistakes: int

    @property
    def is_right(self) -> bool:
        """Whether nothing is wrong."""
        return not self.mistakes


@dataclass(frozen=True)
class Answer:
    """The answer.

    Attributes
    ----------
    way
        The way by which the found mount is shown: that of the first explanation, else the plain one.
    explanations
        All of the fewest mistakes; right alone if the entry is right; empty: nothing known explains what was found.
    certain
        Whether the data determine the mount well enough to be judged.
    angle_deg, lever_m
        By how much the found mount differs from the calibrated one.
    rotation_right, lever_right
        Whether they are within tolerance, each by itself.
    """

    way: Way
    explanations: tuple[Explanation, ...]
    certain: bool
    angle_deg: float
    lever_m: Array
    rotation_right: bool
    lever_right: bool

    @property
    def is_right(self) -> bool:
        """Whether the mount was entered rightly."""
        return self.certain and len(self.explanations) == 1 and self.explanations[0].is_right


def answer_of(pairs: Pairs, source: EntrySource, heights_differ: bool) -> Answer:
    """Return the answer.

    Parameters
    ----------
    pairs
        Soundings and where the file has them.
    source
        What may have been entered.
    heights_differ
        Whether the user says that the file's heights are above another surface: then z is not judged.
    """
    ways = list(_ways(pairs, source, heights_differ))
    best = min(way.fitted.scatter_m for way in ways)
    ways = [way for way in ways if way.fitted.scatter_m**2 <= WORSE * best**2 + WORSE_M**2]
    found = [(one, way) for way in ways for one in _explanations(way, source)]
    fewest = min((one.mistakes for one, _ in found), default=0)
    found = [(one, way) for one, way in found if one.mistakes == fewest]
    way = found[0][1] if found else ways[0]
    explanations = tuple({one.words: one for one, _ in reversed(found)}.values())[::-1]
    if fewest == 0 and found:
        explanations = explanations[:1]
    sigma_deg, sigma_m = _sigmas(way)
    return Answer(
        way=way,
        explanations=explanations,
        certain=bool(SIGMAS * sigma_deg.max() <= MOST_DEG and SIGMAS * sigma_m.max() <= MOST_M),
        angle_deg=float(np.degrees(np.linalg.norm(_turn(way, source.total.R_body_from_sensor)))),
        lever_m=way.fitted.lever_arm_m - source.total.lever_arm_body_m,
        rotation_right=_same_rotation(way, source.total.R_body_from_sensor),
        lever_right=_same_lever(way, source.total.lever_arm_body_m),
    )


def _ways(pairs: Pairs, source: EntrySource, heights_differ: bool) -> Iterator[Way]:
    """Yield the ways, the plain one first."""
    soundings, points, total = pairs.soundings, pairs.points_pool_m, source.total
    by_heights = fit_mount(soundings, points, HEIGHTS_FREE, total.lever_arm_body_m)
    if heights_differ:
        yield Way(PLAIN, "", by_heights, (True, True, False))
        return
    yield Way(PLAIN, "", fit_mount(soundings, points, FREE_MOUNT))
    words = "all heights are {:+.3f} m off: they are above another surface (a geoid, the sea, the water of the pool)"
    if abs(by_heights.shift_m[2]) > TOLERANCE_M:
        yield Way("heights", words.format(by_heights.shift_m[2]), by_heights, (True, True, False))
    for key, words, delay_s in _delays(source):
        if abs(delay_s) >= LEAST_DELAY_S:
            yield Way(key, words, fit_mount(soundings.later(delay_s), points, FREE_MOUNT))
    by_ranges = fit_mount(soundings, points, RANGES_FREE)
    words = "the software's ranges are {:+.2f} % longer than the run's: it works with another sound speed"
    yield Way("sound_speed", words.format(100 * (by_ranges.range_factor - 1)), by_ranges)
    yield Way(
        "level_lever_arm",
        "the software adds the lever arm without roll and pitch (Kluster does)",
        fit_mount(soundings, points - _level_lever(soundings, total.lever_arm_body_m), FREE_MOUNT),
    )


def _delays(source: EntrySource) -> Iterator[tuple[str, str, float]]:
    """Yield codes, words, and by how much later the software's poses are than the run's (true = recorded - latency).

    Without the sonar's latency L a sounding has its recorded time, which is later by L; with the opposite sign by 2 L.
    Without the INS's latency a pose has a time that is later by L than the true one, so that at each time the software
    takes an earlier pose.
    """
    for sensor, latency_s, sign in (("sonar", source.mbes_latency_s, 1.0), ("INS", source.ins_latency_s, -1.0)):
        code = sensor.lower()
        yield f"{code}_latency_missing", f"the {sensor}'s latency was not entered", sign * latency_s
        yield f"{code}_latency_sign", f"the {sensor}'s latency has the opposite sign", 2 * sign * latency_s


def _level_lever(soundings: RunSoundings, lever_arm_m: Array) -> Array:
    """Return the error (n, 3) of a lever arm whose horizontal part is turned by the heading alone: R_heading t - R t.

    The height of R t is kept (exports: Kluster). R_heading turns about the vertical so that forward keeps its azimuth.
    """
    R = soundings.R_pool_from_body
    full = R @ lever_arm_m
    forward = R[:, :2, 1] / np.linalg.norm(R[:, :2, 1], axis=1)[:, None]
    starboard = np.stack([forward[:, 1], -forward[:, 0]], axis=1)
    flat = lever_arm_m[0] * starboard + lever_arm_m[1] * forward
    return np.column_stack([flat - full[:, :2], np.zeros(len(full))])


def _turn(way: Way, R: Array) -> Array:
    return rotation_error(way.fitted.R_body_from_mbes, R)


def _sigmas(way: Way) -> tuple[Array, Array]:
    """Return the sigmas of the rotation (degrees) and of the lever arm (m) that a way can tell."""
    sigma = np.sqrt(np.diag(way.fitted.covariance))
    return np.degrees(sigma[:3]), np.where(way.judged, sigma[3:6], 0.0)


def _same_rotation(way: Way, R: Array) -> bool:
    allowed = TOLERANCE_DEG + SIGMAS * float(_sigmas(way)[0].max())
    return bool(np.degrees(np.linalg.norm(_turn(way, R))) <= allowed)


def _same_lever(way: Way, lever_arm_m: Array) -> bool:
    allowed = TOLERANCE_M + SIGMAS * _sigmas(way)[1]
    differences = np.abs(way.fitted.lever_arm_m - lever_arm_m)
    return bool(np.all((differences <= allowed)[np.array(way.judged)]))


def _fewest(entered: Sequence[Entered]) -> list[Entered]:
    least = min((one.mistakes for one in entered), default=0)
    return [one for one in entered if one.mistakes == least]


def _explanations(way: Way, source: EntrySource) -> Iterator[Explanation]:
    """Yield what explains a way's mount: one mistake of both parts, or the fewest of either."""
    angles = [one for one in rotations(source) if _same_rotation(way, one.value)]
    arms = [one for one in lever_arms(source) if _same_lever(way, one.value)]
    own, first = int(way.key != PLAIN), (way.words,) * (way.key != PLAIN)
    shared = {one.key for one in angles} & {one.key for one in arms}
    both = {one.key: one for one in angles if one.key in shared}
    if RIGHT in both or (both and not any(one.mistakes == 0 for one in (*angles, *arms))):
        for key, one in both.items():
            if key == RIGHT or RIGHT not in both:
                parts = (one.words,) * bool(one.mistakes)
                yield Explanation((key, key, way.key), (*first, *parts), own + one.mistakes)
        return
    for angle in _fewest(angles):
        for arm in _fewest(arms):
            wrong = [one for one in (angle, arm) if one.mistakes]
            parts = tuple(f"{_part(one, angle)}{one.words}" for one in wrong)
            yield Explanation((angle.key, arm.key, way.key), (*first, *parts), own + sum(one.mistakes for one in wrong))


def _part(one: Entered, angle: Entered) -> str:
    return "angles: " if one is angle else "lever arm: "
