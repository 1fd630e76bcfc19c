"""Frames from surveyed marks: signs, covariance over many draws, derivatives, and which mark is wrong."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import binom, chi2

from pipeline.maths import rigid
from pipeline.maths.rigid import FORWARD, STARBOARD, Axes, Frame, Survey
from tests.maths.surveys import ALONG, World, attitude_rotation, error

DRAWS = 500
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
    """Coverage of every 95 % interval and mean squared error by the covariance, over 500 surveys."""
    case, rng = CASES[name], np.random.default_rng(7)
    few, many = binom.ppf([0.0005, 0.9995], DRAWS, 0.95)
    inside, squared, statistics = [], [], []
    for _ in range(DRAWS):
        found = rigid.adjust(*case.drawn(rng))
        statistics.append(found.squares)
        row, squares = [], []
        for number, sensor in enumerate(case.frames[1:], 1):
            R, lever_arm, C = rigid.mounted_on(found, 0, number)
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
