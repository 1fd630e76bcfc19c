"""Data snooping: tests of an adjustment's residuals mark by mark, repeated without the worst mark.

The alternative hypothesis is that an error ∇ (3,) of one mark shifts the residuals by G ∇. G (n, 3) has the derivatives
of the residuals by the mark's coordinates, in one frame (error of the drawing) or in all (error of the survey). With
W = Σ⁻¹ and Q_v the residuals' cofactors, the likelihood ratio is

    T = rᵀ W G (Gᵀ W Q_v W G)⁺ Gᵀ W r ~ chi²(rank),        W Q_v W = W - W J C Jᵀ W,

and T is the decrease of Ω if the mark's coordinates were unknown. For a mark of one frame this is vᵀ (Q_vv)⁺ v of its
residuals v (Baarda 1968, "A testing procedure for use in geodetic networks"; in this form Teunissen 2006, "Testing
Theory", 4.3). T is divided by its critical value, because ranks differ; the mark with the largest quotient is the worst
(de Jong and Teunissen 2000, Earth Planets Space 52). The sigmas are the configured ones. The estimated variance factor
(Pope 1976) is not used, because the wrong mark itself would raise it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from pipeline.errors import NotConvergedError
from pipeline.maths.survey.frame_adjustment import FrameAdjustment, adjust_frames
from pipeline.maths.survey.frames import MarkSurvey, RigidFrame

Array = NDArray[np.float64]
SNOOPING_LEVEL = 0.001  # level of the global test, and of all the marks' tests together
LEAST_SHARE = 1e-6  # smallest share of an error that must reach the residuals, for the residuals to show the error
LINE_RAD = float(np.radians(5.0))  # largest sigma of a turn that counts as determined
UNEXPLAINED_RATIO = 3.0  # critical values: a frame whose worst test is larger is not explained by the marks left out
SURVEY = -1  # in place of a frame's number: the error is in the mark's survey, which all its frames share


@dataclass(frozen=True)
class MarkTest:
    """Test of a mark (number in the survey) in one frame, or in all its frames (SURVEY): T, rank, critical value."""

    frame: int
    mark: int
    statistic: float
    rank: int
    limit: float

    @property
    def ratio(self) -> float:
        """Return T divided by its critical value."""
        return self.statistic / self.limit


@dataclass(frozen=True)
class Suspect:
    """Test of a mark that was left out, and tests of the rivals, marks that would explain the misfit as well."""

    test: MarkTest
    rivals: tuple[MarkTest, ...]


@dataclass(frozen=True)
class SnoopingResult:
    """Result of data snooping.

    Parameters
    ----------
    first, tests
        Adjustment with all marks, and its tests.
    suspects
        Marks left out.
    last, last_tests
        Adjustment without the suspects, and its tests.
    agrees
        Whether the remaining marks agree.
    """

    first: FrameAdjustment
    tests: tuple[MarkTest, ...]
    suspects: tuple[Suspect, ...]
    last: FrameAdjustment
    last_tests: tuple[MarkTest, ...]
    agrees: bool


def global_limit(redundancy: int) -> float:
    """Return the limit of the global test, which Ω exceeds with probability SNOOPING_LEVEL."""
    return float(chdtri(max(redundancy, 1), SNOOPING_LEVEL))


def mark_tests(adjusted: FrameAdjustment, frames: Sequence[RigidFrame]) -> tuple[MarkTest, ...]:
    """Return the tests of all marks whose errors would show in the residuals, the worst first.

    All limits together have the level SNOOPING_LEVEL (Bonferroni).
    """
    W, J = adjusted.weight, adjusted.design
    WJ = W @ J
    P = W - WJ @ adjusted.covariance @ WJ.T
    weighted = W @ adjusted.residuals
    measured = []
    for number, frame in enumerate(frames):
        for mark in frame.marks[: frame.points].tolist():
            G = np.zeros((len(weighted), 3))
            G[adjusted.rows[number]] = adjusted.by_survey[adjusted.rows[number], mark]
            measured.append((number, mark, *_statistic(G, W, P, weighted)))
    testable = [row for row in measured if row[3]]
    marks = [mark for _, mark, *_ in testable]
    shared = sorted({mark for mark in marks if marks.count(mark) > 1})
    testable += [(SURVEY, mark, *_statistic(adjusted.by_survey[:, mark], W, P, weighted)) for mark in shared]
    limits = {rank: float(chdtri(rank, SNOOPING_LEVEL / len(testable))) for rank in (1, 2, 3)} if testable else {}
    tests = [
        MarkTest(frame=frame, mark=mark, statistic=statistic, rank=rank, limit=limits[rank])
        for frame, mark, statistic, rank in testable
        if rank
    ]
    return tuple(sorted(tests, key=lambda test: -test.ratio))


def _statistic(G: Array, W: Array, P: Array, weighted: Array) -> tuple[float, int]:
    """Return T and its rank; ``weighted`` is W r.

    The eigenvalues of Gᵀ P G relative to Gᵀ W G are the shares of an error that the residuals show.
    """
    moved = np.flatnonzero(G.any(axis=1))
    G, weighted = G[moved], weighted[moved]
    W, P = (matrix[np.ix_(moved, moved)] for matrix in (W, P))
    whole = G.T @ W @ G
    values, vectors = np.linalg.eigh(whole)
    scale = vectors / np.sqrt(values)
    shares, axes = np.linalg.eigh(scale.T @ (G.T @ P @ G) @ scale)
    along = (scale @ axes).T @ (G.T @ weighted)
    shown = shares > LEAST_SHARE
    return float(np.sum(along[shown] ** 2 / shares[shown])), int(shown.sum())


def snoop(survey: MarkSurvey, frames: Sequence[RigidFrame]) -> SnoopingResult:
    """Adjust all frames. While a test fails, leave out the worst mark and adjust again.

    At most (k - 2) // 2 of the k marks of a frame are left out, so that most marks remain; of three marks none is left
    out. If a frame still fails clearly (UNEXPLAINED_RATIO), its missing marks explained nothing and are used again.
    """
    left = tuple(frames)
    first = now = adjust_frames(survey, left)
    first_tests = tests = mark_tests(first, left)
    suspects: list[Suspect] = []
    while not (agrees := now.squares <= global_limit(now.redundancy) and all(test.ratio <= 1 for test in tests)):
        failed = [test for test in tests if test.ratio > 1]
        worst = next((test for test in failed if _may_go(survey, frames, _without(left, test))), None)
        if worst is None:
            break
        near = [test for test in tests if abs(worst.statistic - test.statistic) < global_limit(3)]
        suspects.append(Suspect(worst, tuple(test for test in near if test.mark != worst.mark)))
        left = _without(left, worst)
        now = adjust_frames(survey, left)
        tests = mark_tests(now, left)
    if not agrees and suspects:
        worst_ratio = {test.frame: test.ratio for test in reversed(tests)}
        suspects = [each for each in suspects if worst_ratio.get(each.test.frame, 0.0) < UNEXPLAINED_RATIO]
        left = tuple(frames)
        for suspect in suspects:
            left = _without(left, suspect.test)
        now = adjust_frames(survey, left)
        tests = mark_tests(now, left)
    return SnoopingResult(
        first=first, tests=first_tests, suspects=tuple(suspects), last=now, last_tests=tests, agrees=agrees
    )


def _without(frames: tuple[RigidFrame, ...], test: MarkTest) -> tuple[RigidFrame, ...]:
    """Return the frames, the mark of a test left out of the test's frame, or of all for SURVEY (axes keep theirs)."""
    fewer = []
    for number, frame in enumerate(frames):
        places = np.flatnonzero(frame.marks == test.mark)
        goes = test.frame in (SURVEY, number) and frame.axes is None and len(places)
        fewer.append(frame.without(int(places[0])) if goes else frame)
    return tuple(fewer)


def _may_go(survey: MarkSurvey, frames: Sequence[RigidFrame], fewer: Sequence[RigidFrame]) -> bool:
    """Return whether each frame keeps enough marks, not all of which lie on a line."""
    for before, after in zip(frames, fewer, strict=True):
        if after.axes is None and len(before.marks) - len(after.marks) > (len(before.marks) - 2) // 2:
            return False
        if after.axes is None and sigma_about_line(survey, after) > LINE_RAD:
            return False
    return True


def sigma_about_line(survey: MarkSurvey, frame: RigidFrame) -> float:
    """Return the sigma (rad) of a frame's turn about the line nearest to its marks; infinite if they lie on a line.

    The marks stand at their places x in the drawing, from their weighted mean, with mean variances σ². The information
    of the turn is Σ |x|² / σ² without the part along the line: the smallest eigenvalue of Σ (|x|² 1 - x xᵀ) / σ².
    """
    variance = np.trace(survey.covariance[frame.marks] + frame.covariance, axis1=1, axis2=2) / 3
    x = frame.drawing_m - (1 / variance) @ frame.drawing_m / np.sum(1 / variance)
    products = (x / variance[:, None]).T @ x
    values = np.linalg.eigvalsh(products)
    information = float(values[0] + values[1])
    return float(1 / np.sqrt(information)) if information > 1e-12 * float(values[2]) else np.inf


def fit_of_frame(survey: MarkSurvey, frame: RigidFrame) -> tuple[float, int]:
    """Return Ω and redundancy of one frame by itself; Ω is infinite if the adjustment does not converge."""
    try:
        adjusted = adjust_frames(survey, [frame])
    except NotConvergedError:
        return np.inf, 3 * frame.points - 6
    return adjusted.squares, adjusted.redundancy
