"""Which mark is wrong: tests of an adjustment's residuals, mark by mark, and again without the worst.

Against the hypothesis that the residuals have besides a shift G ∇ (G: the rows that the mark's error moves, along three
axes, survey or drawing), with W = Σ⁻¹ and Q_v the residuals' cofactors, the likelihood ratio is

    T = rᵀ W G (Gᵀ W Q_v W G)⁺ Gᵀ W r ~ chi²(rank),        W Q_v W = W - W J C Jᵀ W,

and T is by how much Ω falls when that coordinate is not known. For a mark of one frame this is vᵀ (Q_vv)⁺ v of its v
(Baarda 1968, "A testing procedure for use in geodetic networks"; in this form Teunissen 2006, "Testing Theory", 4.3).
T is measured by its critical value: with different ranks the largest quotient is the worst mark (de Jong and Teunissen
2000, Earth Planets Space 52). Taken at the sigmas as given, not at the variance factor found (Pope 1976), which the
wrong mark itself would raise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from pipeline.errors import NotConvergedError
from pipeline.maths.survey.frame_adjustment import Adjusted, Frame, Survey, adjust

Array = NDArray[np.float64]
LEVEL = 0.001  # of the global test; and of all the marks' tests together
BLIND = 1e-6  # share of an error that reaches the residuals, below which it is not seen
LINE_RAD = float(np.radians(5.0))  # a turn less certain than this is not determined
STILL_ODD = 3.0  # critical values: where a frame's worst is beyond that, what went from it did not explain it
SURVEY = -1  # in place of a frame: the mark's survey, which all its frames share


@dataclass(frozen=True)
class MarkTest:
    """A mark (its number in the survey) of a frame, or of all its frames (SURVEY): T, its rank, its critical value."""

    frame: int
    mark: int
    statistic: float
    rank: int
    limit: float

    @property
    def ratio(self) -> float:
        return self.statistic / self.limit


@dataclass(frozen=True)
class Suspect:
    """What was left out, and what would explain the misfit as well: the tests beside it, worst first."""

    test: MarkTest
    rivals: tuple[MarkTest, ...]


@dataclass(frozen=True)
class Snooped:
    """The adjustment with all marks and its tests; suspects; the adjustment without them and its tests. ``agrees``:
    what is left agrees."""

    first: Adjusted
    tests: tuple[MarkTest, ...]
    suspects: tuple[Suspect, ...]
    last: Adjusted
    last_tests: tuple[MarkTest, ...]
    agrees: bool


def limit(redundancy: int) -> float:
    """Of the global test: Ω lies above it with probability LEVEL."""
    return float(chdtri(max(redundancy, 1), LEVEL))


def mark_tests(found: Adjusted, frames: Sequence[Frame]) -> tuple[MarkTest, ...]:
    """Of every mark whose error would show, the worst first; all limits together have LEVEL (Bonferroni)."""
    W, J = found.weight, found.design
    WJ = W @ J
    P = W - WJ @ found.covariance @ WJ.T
    pull = W @ found.residuals
    measured = []
    for number, frame in enumerate(frames):
        for mark in frame.marks[: frame.points].tolist():
            G = np.zeros((len(pull), 3))
            G[found.rows[number]] = found.by_survey[found.rows[number], mark]
            measured.append((number, mark, *_measure(G, W, P, pull)))
    seen = [one for one in measured if one[3]]
    often = {mark for _, mark, *_ in seen if sum(mark == other for _, other, *_ in seen) > 1}
    seen += [(SURVEY, mark, *_measure(found.by_survey[:, mark], W, P, pull)) for mark in sorted(often)]
    limits = {rank: float(chdtri(rank, LEVEL / len(seen))) for rank in (1, 2, 3)} if seen else {}
    tests = [MarkTest(*one, limits[one[3]]) for one in seen if one[3]]
    return tuple(sorted(tests, key=lambda test: -test.ratio))


def _measure(G: Array, W: Array, P: Array, pull: Array) -> tuple[float, int]:
    """T and its rank: eigenvalues of Gᵀ P G against Gᵀ W G are the shares of an error that the residuals show."""
    moved = np.flatnonzero(G.any(axis=1))
    G, pull = G[moved], pull[moved]
    W, P = (matrix[np.ix_(moved, moved)] for matrix in (W, P))
    whole = G.T @ W @ G
    values, vectors = np.linalg.eigh(whole)
    scale = vectors / np.sqrt(values)
    shares, axes = np.linalg.eigh(scale.T @ (G.T @ P @ G) @ scale)
    along = (scale @ axes).T @ (G.T @ pull)
    shown = shares > BLIND
    return float(np.sum(along[shown] ** 2 / shares[shown])), int(shown.sum())


def snoop(survey: Survey, frames: Sequence[Frame]) -> Snooped:
    """Adjust; while a test fails, leave out the worst mark and adjust again.

    Of a frame's k marks at most (k - 2) // 2 go, so that most of them agree on what is left: with three none does.
    Where a frame is at odds all the same, what went explained nothing and comes back.
    """
    left = tuple(frames)
    first = now = adjust(survey, left)
    first_tests = tests = mark_tests(first, left)
    suspects: list[Suspect] = []
    while not (agrees := now.squares <= limit(now.redundancy) and all(test.ratio <= 1 for test in tests)):
        failed = [test for test in tests if test.ratio > 1]
        worst = next((test for test in failed if _may_go(survey, frames, _without(left, test))), None)
        if worst is None:
            break
        near = [one for one in tests if abs(worst.statistic - one.statistic) < limit(3)]
        suspects.append(Suspect(worst, tuple(one for one in near if one.mark != worst.mark)))
        left = _without(left, worst)
        now = adjust(survey, left)
        tests = mark_tests(now, left)
    if not agrees and suspects:
        still = {test.frame: test.ratio for test in reversed(tests)}
        suspects = [one for one in suspects if still.get(one.test.frame, 0.0) < STILL_ODD]
        left = tuple(frames)
        for one in suspects:
            left = _without(left, one.test)
        now = adjust(survey, left)
        tests = mark_tests(now, left)
    return Snooped(first, first_tests, tuple(suspects), now, tests, agrees)


def _without(frames: tuple[Frame, ...], test: MarkTest) -> tuple[Frame, ...]:
    """Left out of the frame it was tested in, or of all."""
    found = []
    for number, frame in enumerate(frames):
        places = np.flatnonzero(frame.marks == test.mark)
        goes = test.frame in (SURVEY, number) and frame.axes is None and len(places)
        found.append(frame.without(int(places[0])) if goes else frame)
    return tuple(found)


def _may_go(survey: Survey, frames: Sequence[Frame], fewer: Sequence[Frame]) -> bool:
    for before, after in zip(frames, fewer, strict=True):
        if after.axes is None and len(before.marks) - len(after.marks) > (len(before.marks) - 2) // 2:
            return False
        if after.axes is None and sigma_about_line(survey, after) > LINE_RAD:
            return False
    return True


def sigma_about_line(survey: Survey, frame: Frame) -> float:
    """Sigma (rad) of a frame's turn about the line that its marks come nearest to, by the drawing; infinite on a line.

    With each mark's mean variance, its information is Σ |x|² / σ² about the weighted middle, but for what lies along
    the line: the smallest eigenvalue of Σ (|x|² 1 - x xᵀ) / σ².
    """
    variance = np.trace(survey.covariance[frame.marks] + frame.covariance, axis1=1, axis2=2) / 3
    x = frame.drawing_m - (1 / variance) @ frame.drawing_m / np.sum(1 / variance)
    products = (x / variance[:, None]).T @ x
    values = np.linalg.eigvalsh(products)
    information = float(values[0] + values[1])
    return float(1 / np.sqrt(information)) if information > 1e-12 * float(values[2]) else np.inf


def fits(survey: Survey, frame: Frame) -> tuple[float, int]:
    """Ω and redundancy of one frame by itself; infinite where it fits so badly that nothing converges."""
    try:
        found = adjust(survey, [frame])
    except NotConvergedError:
        return np.inf, 3 * frame.points - 6
    return found.squares, found.redundancy
