"""Weights near edges: 0 at the limit, 1 beyond the ramp, and in between by the distance."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import LabelSettings, label_points, weight_beside_shadows
from pipeline.maths.target.model import TargetModel
from tests.support.targets import by_letters

WALL_END_M, MARGIN_M, RAMP_M = 1.5, 0.03, 0.04
HIGHEST_M, LOWEST_M = -0.5, -1.0
HALF_WIDTH = 0.02  # a beam's, for each metre of range


@pytest.fixture
def target() -> TargetModel:
    return by_letters(a=8.0, b=3.0, c=1.0, e=0.5)


def weights(
    target: TargetModel, points: NDArray[np.float64], half_widths: tuple[float, ...] = ()
) -> NDArray[np.float64]:
    """Weights of points on the wall at x = 0, each seen from 5 m straight before it; 0 without a label."""
    ahead = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    sides = tuple(np.tile([0.0, width, 0.0], (len(points), 1)) for width in half_widths)
    limits = LabelSettings(0.05, MARGIN_M, 0.0, LOWEST_M, HIGHEST_M, ramp_m=RAMP_M)
    labels = label_points(target, points, TargetBeams(ahead, np.full(len(points), 5.0), sides), limits)
    np.testing.assert_array_equal(labels.edge_weight > 0, labels.face >= 0)
    return labels.edge_weight


@pytest.mark.parametrize(("half_widths", "reach_m"), [((), 0.0), ((HALF_WIDTH,), 5 * HALF_WIDTH)])
def test_the_weight_rises_from_the_margin_inward(
    target: TargetModel, half_widths: tuple[float, ...], reach_m: float
) -> None:
    inward = np.array([-0.001, 0.001, 0.01, 0.02, 0.039, 0.041, 0.5])
    points = np.column_stack([0 * inward, WALL_END_M - MARGIN_M - reach_m - inward, -0.75 + 0 * inward])
    found = weights(target, points, half_widths)
    np.testing.assert_allclose(found, [0.0, 0.025, 0.25, 0.5, 0.975, 1.0, 1.0], atol=1e-9)


def test_it_rises_from_the_water_line_and_the_lowest_height(target: TargetModel) -> None:
    heights = np.array([-0.499, -0.51, -0.53, -0.541, -0.75, -0.97, -0.99, -1.001])
    points = np.column_stack([0 * heights, 0 * heights, heights])
    np.testing.assert_allclose(weights(target, points), [0.0, 0.25, 0.75, 1.0, 1.0, 0.75, 0.25, 0.0], atol=1e-9)


def test_without_a_ramp_each_point_counts_fully(target: TargetModel) -> None:
    points = np.array([[0.0, WALL_END_M - MARGIN_M - 0.001, -2.0]])
    labels = label_points(target, points, TargetBeams.head_on(1), LabelSettings(0.05, MARGIN_M, 0.0))
    assert labels.edge_weight.tolist() == [1.0]


class BesideAnEdge:
    """Beams on the wall; footprints enlarged by more than ``clear_m`` (n,) reach behind an edge in front."""

    def __init__(self, target: TargetModel, clear_m: list[float]) -> None:
        names = [face.name for face in target.faces]
        self.wall, self.other, self.clear_m = names.index("P2"), names.index("P1-0"), np.array(clear_m)
        self.faces = np.full(len(clear_m), self.wall, dtype=np.int16)

    def faces_at_corners(self, rows: NDArray[np.int64], beyond_m: float) -> Iterator[NDArray[np.int64]]:
        """One corner always on the wall, one that may be hidden."""
        yield np.full(len(rows), self.wall)
        yield np.where(self.clear_m[rows] < beyond_m, self.other, self.wall)


def test_beside_a_shadow_the_weight_rises_in_steps(target: TargetModel) -> None:
    """Six steps of 5 mm: a footprint that is hidden when enlarged by k steps, and not by k - 1, counts k sevenths."""
    clear_m = [-0.001, 0.001, 0.004, 0.0051, 0.0201, 0.0299, 0.031]
    found = weight_beside_shadows(target, BesideAnEdge(target, clear_m), 0.03)
    np.testing.assert_allclose(found, np.array([0, 1, 1, 2, 5, 6, 7]) / 7)
    without = weight_beside_shadows(target, BesideAnEdge(target, clear_m), 0.0)
    assert without.tolist() == [0.0] + [1.0] * 6
