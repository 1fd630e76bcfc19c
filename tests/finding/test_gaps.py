"""Gaps between courses of blocks: where they are, both sides of each limit, and when they go on below the water."""

import numpy as np
import pytest

from pipeline.finding.gaps import ALIKE_M, EMPTY, FULL, LEAST_M, MOST, continued_gaps, dry_gaps

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


@pytest.mark.parametrize(("gap_m", "found"), [(LEAST_M + 0.06, 1), (LEAST_M - 0.04, 0)])
def test_a_joint_is_no_gap(gap_m: float, found: int) -> None:
    assert len(dry_gaps(courses([(0.0, 1.0), (1.0 + gap_m, 2.0)]))) == found


@pytest.mark.parametrize(("share", "found"), [(0.4, 1), (2.5, 0)])
def test_a_few_points_of_what_stands_behind_fill_no_gap(share: float, found: int) -> None:
    behind = courses([(1.0, 1.5)], round(share * EMPTY * 5000), seed=2)
    assert len(dry_gaps(np.concatenate([courses([(0.0, 1.0), (1.5, 2.5)]), behind]))) == found


@pytest.mark.parametrize(("per_m", "found"), [(2 * FULL / 0.16, 1), (0.5 * FULL / 0.16, 0)])
def test_few_points_show_no_gaps(per_m: float, found: int) -> None:
    """With bins of 0.16 m a usual one has 40 points, or 10."""
    assert len(dry_gaps(courses([(0.0, 1.0), (2.0, 3.0)], round(per_m)))) == found


def test_regular_gaps_go_on_to_the_lowest_height() -> None:
    """One metre apart: those that end above -2.6 m. Each is 1 cm higher than the last, about the same middle."""
    gaps = np.array([[0.4, 0.9], [1.4, 1.9], [2.4, 2.9]])
    below = continued_gaps(gaps, -2.6)[:-3]
    np.testing.assert_allclose(below.mean(axis=1), [-2.35, -1.35, -0.35])
    np.testing.assert_allclose(np.diff(below, axis=1)[:, 0], [0.53, 0.52, 0.51])
    np.testing.assert_array_equal(continued_gaps(gaps, -2.6)[-3:], gaps)


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
    np.testing.assert_array_equal(continued_gaps(np.array(gaps), -4.0), gaps)


def test_a_face_has_a_bounded_number_of_gaps() -> None:
    assert len(continued_gaps(np.array([[0.4, 0.6], [0.8, 1.0]]), -100.0)) == MOST
