"""Frames from surveyed marks: signs, covariance over many draws, derivatives, and which mark is wrong."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import binom, chi2

from pipeline.maths.survey import data_snooping, frame_adjustment
from pipeline.maths.survey.frame_adjustment import FORWARD, STARBOARD, Axes, Frame, Survey
from tests.support.effort import often
from tests.support.surveys import ALONG, ON_BODY, PLACE, World, attitude_rotation, error

DRAWS = often(60, 500)
LOPSIDED = np.array([0.0006, 0.0012, 0.003])  # m, along the survey's x, y, z
TURNED = Rotation.from_euler("xyz", [20, 35, 50], degrees=True).as_matrix()


class Case:
    """A world, its sigmas, and how the body is given."""

    def __init__(self, world: World, survey_m: Any = 0.001, drawing_m: Any = 0.0005, axes: Any = None) -> None:
        self.world = world
        self.names = list(world.survey())
        self.at = np.array(list(world.survey().values()))
        sigma = np.broadcast_to(survey_m, 3)
        turn = TURNED if np.ndim(survey_m) else np.eye(3)
        self.covariance = np.broadcast_to(turn @ np.diag(sigma**2) @ turn.T, (len(self.at), 3, 3))
        self.drawing_sigma = np.broadcast_to(drawing_m, 3)
        self.axes = axes  # (along, origin, first, second, sigma_deg)
        self.root = np.linalg.cholesky(self.covariance)
        self.frames = ["body", *(name for name in world.drawings() if name != "body")]
        drawings = world.drawings()
        self.exact = {name: np.array(list(marks.values())) for name, marks in drawings.items()}
        self.numbers = {name: np.array([self.names.index(mark) for mark in marks]) for name, marks in drawings.items()}
        level = attitude_rotation(*world.attitude)
        self.level_from = {name: (level * world.rotation(name)).as_matrix() for name in self.frames}

    def drawn(self, rng: np.random.Generator) -> tuple[Survey, list[Frame]]:
        """Survey and frames with errors."""
        at = self.at + np.einsum("kij,kj->ki", self.root, rng.normal(size=self.at.shape))
        frames, moved = [], np.zeros_like(at)
        for name in self.frames:
            if name == "body" and self.axes is not None:
                frame, moved = self._by_axes(rng)
                at = at + moved
            else:
                numbers = self.numbers[name]
                exact = self.exact[name] + moved[numbers] @ self.level_from[name]
                drawing = exact + self.drawing_sigma * rng.normal(size=exact.shape)
                frame = Frame(numbers, drawing, np.tile(np.diag(self.drawing_sigma**2), (len(exact), 1, 1)))
            frames.append(frame)
        return Survey(at, self.covariance), frames

    def _by_axes(self, rng: np.random.Generator) -> tuple[Frame, Any]:
        """Marks meant to lie on an axis lie off it by the drawing's sigma; the INS reads its attitude wrongly."""
        along, origin, first, second, sigma_deg = self.axes
        used = list(dict.fromkeys([origin, first, second]))
        numbers = np.array([self.names.index(mark) for mark in used])
        off = attitude_rotation(*self.world.attitude).apply(self.drawing_sigma * rng.normal(size=(len(used), 3)))
        moved = np.zeros_like(self.at)
        moved[numbers] += off
        read = self.world.attitude[0 if along == FORWARD else 1] + sigma_deg * rng.normal()
        axes = Axes(along, used.index(first), used.index(second), np.radians(read), np.radians(sigma_deg))
        covariance = np.tile(np.diag(self.drawing_sigma**2), (len(used), 1, 1))
        return Frame(numbers, np.zeros((len(used), 3)), covariance, axes), moved


EVERY = World()
BOTH = (("B1", "body", "laser"), ("I1", "body", "laser"), ("B2", "body", "mbes"), ("L4", "laser", "mbes"))
SHARED = World(shared=BOTH)
ORIGIN = {"O": (0.0, 0.0, 0.0)}
BY_AXES = World(frames={**EVERY.frames, "body": ORIGIN | ALONG})
AXES_SHARED = replace(BY_AXES, shared=(("A2", "body", "laser"), ("O", "body", "mbes")))
CASES = {
    "marks": Case(EVERY),
    "shared marks": Case(SHARED),
    "anisotropic": Case(SHARED, LOPSIDED, np.array([0.0003, 0.002, 0.0008])),
    "forward": Case(BY_AXES, axes=(FORWARD, "O", "A1", "A2", 0.05)),
    "starboard": Case(BY_AXES, LOPSIDED, axes=(STARBOARD, "O", "S1", "S2", 0.1)),
    "forward, shared": Case(AXES_SHARED, axes=(FORWARD, "O", "O", "A2", 0.05)),
}


@pytest.mark.parametrize("name", CASES)
def test_errors_are_as_the_covariance_says(name: str) -> None:
    """Coverage of every 95 % interval and mean squared error by the covariance, over many surveys."""
    case, rng = CASES[name], np.random.default_rng(7)
    few, many = binom.ppf([0.0005, 0.9995], DRAWS, 0.95)
    inside, squared, statistics = [], [], []
    for _ in range(DRAWS):
        found = frame_adjustment.adjust_frames(*case.drawn(rng))
        statistics.append(found.squares)
        row, squares = [], []
        for number, sensor in enumerate(case.frames[1:], 1):
            R, lever_arm, C = frame_adjustment.relative_mount(found, 0, number)
            e = error(case.world, sensor, R, lever_arm)
            row.append(np.abs(e) < 1.959964 * np.sqrt(np.diag(C)))
            squares.append(e @ np.linalg.solve(C, e))
        inside.append(np.concatenate(row))
        squared.append(squares)
    covered = np.sum(inside, axis=0)
    assert np.all((few <= covered) & (covered <= many)), covered
    low, high = chi2.ppf([0.0005, 0.9995], 6 * DRAWS) / DRAWS
    assert np.all((low < np.mean(squared, axis=0)) & (np.mean(squared, axis=0) < high)), np.mean(squared, axis=0)
    free = found.redundancy
    low, high = chi2.ppf([0.0005, 0.9995], free * DRAWS) / DRAWS
    assert low < np.mean(statistics) < high, (np.mean(statistics), free)


# --- signs and derivatives -------------------------------------------------------------------------------------------
def exact(case: Case) -> tuple[Survey, list[Frame]]:
    """Without errors, sigmas as they are."""
    without = Case(case.world, axes=case.axes and (*case.axes[:4], 0.0))
    without.root, without.drawing_sigma = np.zeros_like(without.root), np.zeros(3)
    _, frames = case.drawn(np.random.default_rng(1))
    survey, bare = without.drawn(np.random.default_rng(1))
    frames = [
        replace(one, drawing_m=other.drawing_m, axes=one.axes and replace(one.axes, angle_rad=other.axes.angle_rad))
        for one, other in zip(frames, bare, strict=True)
    ]
    return Survey(survey.at_m, case.covariance), frames


@pytest.mark.parametrize("name", CASES)
def test_without_errors_the_mounts_are_exact(name: str) -> None:
    """Marks, or a roll starboard down +, or a pitch bow up +: any slip of a sign turns the mount by degrees."""
    case = CASES[name]
    found = frame_adjustment.adjust_frames(*exact(case))
    for number, sensor in enumerate(case.frames[1:], 1):
        R, lever_arm, _ = frame_adjustment.relative_mount(found, 0, number)
        assert np.abs(error(case.world, sensor, R, lever_arm)).max() < 1e-10
    assert found.squares < 1e-9
    level = attitude_rotation(*case.world.attitude).as_matrix()
    np.testing.assert_allclose(found.poses[0].R_survey_from_frame, level, atol=1e-10)
    np.testing.assert_allclose(found.poses[0].origin_m, case.world.place, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_the_design_is_the_derivative_of_the_residuals(name: str) -> None:
    survey, frames = CASES[name].drawn(np.random.default_rng(3))
    survey = replace(survey, at_m=survey.at_m - PLACE)
    poses = [frame_adjustment._start(survey, frame).updated(np.full(6, 0.02)) for frame in frames]
    system = frame_adjustment._system(survey, frames, poses)
    for column in range(system.design.shape[1]):
        number, place = divmod(column, 6)
        ends = []
        for h in (1e-5, -1e-5):
            turn = Rotation.from_rotvec(h * np.eye(6)[place, :3]).as_matrix()
            moved = frame_adjustment.Pose(
                turn @ poses[number].R_survey_from_frame, poses[number].origin_m + h * np.eye(6)[place, 3:]
            )
            changed = [*poses[:number], moved, *poses[number + 1 :]]
            ends.append(frame_adjustment._system(survey, frames, changed).residuals)
        np.testing.assert_allclose((ends[0] - ends[1]) / 2e-5, system.design[:, column], atol=1e-8)
    for mark in range(len(survey.at_m)):
        shifted = survey.at_m.copy()
        shifted[mark] += [1e-4, -2e-4, 3e-4]
        change = frame_adjustment._system(replace(survey, at_m=shifted), frames, poses).residuals - system.residuals
        np.testing.assert_allclose(change, system.by_survey[:, mark] @ [1e-4, -2e-4, 3e-4], atol=1e-12)


def test_the_closed_form_never_mirrors_unless_asked() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        x, R_true, weight = rng.normal(size=(5, 3)), Rotation.random(random_state=rng).as_matrix(), rng.uniform(1, 9, 5)
        R, t = frame_adjustment.closed_form(x, x @ R_true.T + [1.0, 2.0, 3.0], weight)
        np.testing.assert_allclose(R, R_true, atol=1e-12)
        np.testing.assert_allclose(t, [1.0, 2.0, 3.0], atol=1e-12)
        flipped = x * [1, -1, 1]
        R, _ = frame_adjustment.closed_form(flipped, x @ R_true.T, weight)
        assert np.linalg.det(R) == pytest.approx(1.0)
        R, _ = frame_adjustment.closed_form(flipped, x @ R_true.T, weight, mirrored=True)
        np.testing.assert_allclose(R, R_true * [1, -1, 1], atol=1e-12)


def test_a_shared_mark_ties_two_frames_whatever_the_survey_says() -> None:
    """Three marks shared by body and laser: however bad the survey, the two agree by their drawings."""
    marks = ("B1", "B2", "I1", "I4")
    case = Case(World(shared=tuple((mark, "body", "laser") for mark in marks)), 0.02, 0.0002)
    adjusted = frame_adjustment.adjust_frames(*case.drawn(np.random.default_rng(1)))
    _, _, C = frame_adjustment.relative_mount(adjusted, 0, 1)
    own = {f"L{k}": ON_BODY[mark] for k, mark in enumerate(marks)}
    apart = Case(World(frames={**EVERY.frames, "laser": own}), 0.02, 0.0002)
    adjusted = frame_adjustment.adjust_frames(*apart.drawn(np.random.default_rng(1)))
    _, _, loose = frame_adjustment.relative_mount(adjusted, 0, 1)
    assert np.all(np.diag(C) < np.diag(loose) / 400)


def test_origin_and_heading_of_the_survey_do_not_matter() -> None:
    survey, frames = CASES["shared marks"].drawn(np.random.default_rng(2))
    one = frame_adjustment.relative_mount(frame_adjustment.adjust_frames(survey, frames), 0, 2)
    turn = Rotation.from_euler("z", 77.0, degrees=True).as_matrix()
    moved = Survey(survey.at_m @ turn.T + [5e5, 4e6, -3], survey.covariance)
    other = frame_adjustment.relative_mount(frame_adjustment.adjust_frames(moved, frames), 0, 2)
    for a, b, atol in zip(one, other, (1e-8, 1e-8, 1e-12), strict=True):
        np.testing.assert_allclose(a, b, atol=atol)


# --- which mark is wrong ---------------------------------------------------------------------------------------------
def spoilt(case: Case, rng: np.random.Generator, frame: int, place: int, of_survey: bool) -> tuple[Survey, list[Frame]]:
    """One mark wrong by 5 cm, in any direction."""
    survey, frames = case.drawn(rng)
    wrong = rng.normal(size=3)
    wrong *= 0.05 / np.linalg.norm(wrong)
    if of_survey:
        at = survey.at_m.copy()
        at[frames[frame].marks[place]] += wrong
        return replace(survey, at_m=at), frames
    drawing = frames[frame].drawing_m.copy()
    drawing[place] += wrong
    frames[frame] = replace(frames[frame], drawing_m=drawing)
    return survey, frames


@pytest.mark.parametrize("of_survey", [True, False], ids=["survey", "drawing"])
@pytest.mark.parametrize("name", ["marks", "shared marks", "forward, shared"])
def test_a_mark_wrong_by_5_cm_is_named(name: str, of_survey: bool) -> None:
    """Among the suspects always; alone nearly always (of four marks two may explain it alike)."""
    case, rng = CASES[name], np.random.default_rng(11)
    alone = more = 0
    for draw in range(60):
        _, frames = case.drawn(np.random.default_rng(0))
        frame = 2 if case.axes else draw % 3
        place = draw % len(frames[frame].marks)
        mark = int(frames[frame].marks[place])
        found = data_snooping.snoop(*spoilt(case, rng, frame, place, of_survey))
        first = found.suspects[0]
        named = {(test.frame, test.mark) for test in (first.test, *first.rivals)}
        assert mark in {of for _, of in named}, (draw, named)
        shared = sum(mark in one.marks for one in frames) > 1
        if not first.rivals and not (shared and case.axes):
            alone += 1
            right = data_snooping.SURVEY if shared and of_survey else frame
            assert (first.test.frame, first.test.mark) == (right, mark)
            assert found.agrees
            more += len(found.suspects) > 1
    assert alone >= 40
    assert more <= 1  # a false alarm


def test_false_alarms_are_as_rare_as_the_level() -> None:
    case, rng = CASES["shared marks"], np.random.default_rng(13)
    alarms = 0
    for _ in range(DRAWS):
        survey, frames = case.drawn(rng)
        found = frame_adjustment.adjust_frames(survey, frames)
        worst = data_snooping.mark_tests(found, frames)[0]
        alarms += found.squares > data_snooping.global_limit(found.redundancy) or worst.ratio > 1
    assert alarms <= binom.ppf(0.999, DRAWS, 2 * data_snooping.SNOOPING_LEVEL)


def test_a_marks_statistic_is_what_the_squares_fall_by_without_it() -> None:
    survey, frames = CASES["shared marks"].drawn(np.random.default_rng(17))
    found = frame_adjustment.adjust_frames(survey, frames)
    for test in data_snooping.mark_tests(found, frames):
        if test.frame == data_snooping.SURVEY:  # as if it had not been measured
            covariance = survey.covariance.copy()
            covariance[test.mark] *= 1e6
            less = frame_adjustment.adjust_frames(replace(survey, covariance=covariance), frames)
        else:
            less = frame_adjustment.adjust_frames(survey, data_snooping._without(tuple(frames), test))
        assert found.squares - less.squares == pytest.approx(test.statistic, rel=0.02, abs=0.02)
        assert test.rank == 3


def test_of_three_marks_a_misfit_shows_and_cannot_be_pinned() -> None:
    world = World(frames={frame: dict(list(marks.items())[:3]) for frame, marks in EVERY.frames.items()})
    case = Case(world)
    found = data_snooping.snoop(*spoilt(case, np.random.default_rng(1), 1, 0, True))
    assert (found.agrees, found.suspects) == (False, ())
    assert {test.frame for test in found.tests if test.ratio > 1} == {1}
    assert all(test.rank == 2 for test in found.tests)  # what lies across their plane does not show


def test_two_wrong_marks_of_six_are_both_named() -> None:
    survey, frames = CASES["marks"].drawn(np.random.default_rng(23))
    at = survey.at_m.copy()
    at[[1, 4]] += [[0.0, 0.03, 0.0], [0.02, 0.0, 0.02]]
    found = data_snooping.snoop(replace(survey, at_m=at), frames)
    assert {one.test.mark for one in found.suspects} == {1, 4}
    assert found.agrees


def test_on_a_line_nothing_tells_the_turn_about_it() -> None:
    def sigma(across: float) -> float:
        at = np.array([[0.0, 0, 0], [0.5, 0, 0], [1.0, across, 0]])
        frame = Frame(np.arange(3), at, np.tile(np.eye(3) * 1e-6, (3, 1, 1)))
        return data_snooping.sigma_about_line(Survey(at, np.tile(np.eye(3) * 3e-6, (3, 1, 1))), frame)

    assert sigma(0.0) == np.inf
    h = 0.1  # residuals from the nearest line h (1/6, -1/3, 1/6): information Σ d² / σ²
    assert sigma(h) == pytest.approx(0.002 / (h * np.sqrt(1 / 6)), rel=0.02)
