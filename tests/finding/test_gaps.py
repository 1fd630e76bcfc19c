"""Gaps between courses of blocks: where they are, both sides of each limit, and when they go on below the water."""

import numpy as np
import pytest

from pipeline.finding.gaps import ALIKE_M, COARSEST_M, EMPTY, FULL, LEAST_M, MOST, dry_gaps, gaps_below

Array = np.ndarray


def courses(ends: list[tuple[float, float]], per_m: int = 5000, seed: int = 1) -> Array:
    """Heights of points of courses of blocks, as many to each metre."""
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.uniform(low, high, round(per_m * (high - low))) for low, high in ends])


def test_gaps_are_where_no_points_are() -> None:
    heights = courses([(-0.3, 0.2), (0.7, 1.2), (1.7, 2.2)])
    np.testing.assert_allclose(dry_gaps(heights), [[0.2, 0.7], [1.2, 1.7]], atol=0.03)


def test_a_plain_wall_has_no_gaps() -> None:
    assert len(dry_gaps(courses([(0.0, 3.0)]))) == 0


@pytest.mark.parametrize(("gap_m", "found"), [(LEAST_M + 0.06, 1), (LEAST_M - 0.06, 0)])
def test_a_joint_is_no_gap(gap_m: float, found: int) -> None:
    assert len(dry_gaps(courses([(0.0, 1.0), (1.0 + gap_m, 2.0)]))) == found


@pytest.mark.parametrize(("share", "found"), [(0.4, 1), (2.5, 0)])
def test_a_few_points_of_what_stands_behind_fill_no_gap(share: float, found: int) -> None:
    behind = courses([(1.0, 1.5)], round(share * EMPTY * 5000), seed=2)
    assert len(dry_gaps(np.concatenate([courses([(0.0, 1.0), (1.5, 2.5)]), behind]))) == found


@pytest.mark.parametrize(("per_m", "found"), [(2 * FULL / COARSEST_M, 1), (0.5 * FULL / COARSEST_M, 0)])
def test_few_points_show_no_gaps(per_m: float, found: int) -> None:
    """With the highest bins, of 4 cm, a usual one has 40 points, or 10."""
    assert len(dry_gaps(courses([(0.0, 1.0), (2.0, 3.0)], round(per_m)))) == found


def test_a_face_has_a_bounded_number_of_gaps() -> None:
    rail = [(0.5 * k, 0.5 * k + 0.25) for k in range(MOST + 10)]
    assert len(dry_gaps(courses(rail))) == MOST
    assert len(gaps_below(np.array([[0.4, 0.7], [1.4, 1.7]]), 0.0, -200.0)) == MOST


GAPS = np.array([[0.4, 0.9], [1.4, 1.9], [2.4, 2.9]])


def test_regular_gaps_go_on_to_the_lowest_height() -> None:
    """One metre apart: those that end above -2.6 m. Each is 1 cm higher than the last, about the same middle."""
    below = gaps_below(GAPS, 0.0, -2.6)
    np.testing.assert_allclose(below.mean(axis=1), [-2.35, -1.35, -0.35])
    np.testing.assert_allclose(np.diff(below, axis=1)[:, 0], [0.53, 0.52, 0.51])


@pytest.mark.parametrize(("seen_m", "number"), [(-0.6 - 2 * ALIKE_M, 0), (-0.6, 3)])
def test_they_go_on_only_if_they_reach_to_the_lowest_points(seen_m: float, number: int) -> None:
    """The next gap would begin at -0.6 m: where the wall is seen below it, it is whole there."""
    assert len(gaps_below(GAPS, seen_m, -2.6)) == number


def test_they_go_on_while_a_course_is_left_between_them() -> None:
    """Of 14 cm between gaps of 0.3 m, 1 cm goes with each repeat."""
    assert len(gaps_below(np.array([[0.4, 0.7], [0.84, 1.14]]), 0.3, -20.0)) == 4


@pytest.mark.parametrize(
    "gaps",
    [
        [[0.4, 0.9]],
        [[0.4, 0.9], [1.4, 1.9 + 1.2 * ALIKE_M]],
        [[0.4, 0.9], [1.4 + 2.5 * ALIKE_M, 1.9 + 2.5 * ALIKE_M], [2.4, 2.9]],
        np.empty((0, 2)),
    ],
)
def test_others_do_not(gaps: list[list[float]]) -> None:
    """One alone, two of different height, three at different distances, none."""
    assert len(gaps_below(np.array(gaps), 0.0, -4.0)) == 0
