"""Squares that are mixed: told from chance, from bad water, and from walls that are turned, bowed or rough."""

import numpy as np
import pytest

from pipeline.maths.adjustment import mixed_squares

BINS, MIDDLE, SIGMA = 128, 64.0, 2.0  # sigma in bins


def mixed(count: np.ndarray) -> np.ndarray:
    """The same of squares that do not touch."""
    return mixed_squares.mixed(np.column_stack([3 * np.arange(len(count)), np.zeros(len(count), dtype=int)]), count)


def counts(
    *, squares: int = 100, soundings: int = 60, at: float = MIDDLE, sigma: float = SIGMA, seed: int = 5
) -> np.ndarray:
    """Squares with normal residuals about a place."""
    rng = np.random.default_rng(seed)
    bins = np.clip(rng.normal(at, sigma, (squares, soundings)).astype(int), 0, BINS - 1)
    return np.array([np.bincount(of_square, minlength=BINS) for of_square in bins])


def beside(count: np.ndarray, soundings: int, off: float = 10 * SIGMA) -> np.ndarray:
    """Some of the soundings of the first square come from something that stands before the wall."""
    changed = count.copy()
    taken = np.cumsum(changed[0])
    changed[0] = np.diff(np.minimum(taken, taken[-1] - soundings), prepend=0)
    changed[0, int(MIDDLE + off)] += soundings
    return changed


def test_a_clean_wall_has_no_mixed_square() -> None:
    assert not mixed(counts(squares=2000)).any()


@pytest.mark.parametrize(("soundings", "off", "is_mixed"), [
    (9, 10.0, True),  # a tenth of 60, and chance's share, and a bit
    (7, 10.0, False),
    (9, -10.0, True),
    (15, 3.0, False),  # within 4 sigmas
    (40, 10.0, True),  # most of them: the rest is off
])  # fmt: skip
def test_a_square_with_another_thing_before_it_is_mixed(soundings: int, off: float, is_mixed: bool) -> None:
    found = mixed(beside(counts(), soundings, off * SIGMA))
    assert found[0] == is_mixed
    assert not found[1:].any()


@pytest.mark.parametrize(("of", "off", "is_mixed"), [(7, 3, False), (8, 2, False), (8, 4, True), (10, 3, False)])
def test_of_few_soundings_more_must_be_off(of: int, off: int, is_mixed: bool) -> None:
    """Two of eight are a quarter, and chance; of seven nothing is said."""
    few = counts(squares=1, soundings=of)
    assert mixed(np.vstack([beside(few, off), counts()]))[0] == is_mixed


def test_water_with_outliers_everywhere_has_none() -> None:
    rng = np.random.default_rng(2)
    clean, wild = counts(soundings=40), rng.integers(0, BINS, (100, 20))
    everywhere = clean + np.array([np.bincount(of_square, minlength=BINS) for of_square in wild])
    assert not mixed(everywhere).any()
    assert mixed(np.vstack([everywhere[:1], clean[1:]])).tolist() == [True, *[False] * 99]


def test_a_square_that_stands_off_as_a_whole_is_not_mixed() -> None:
    """As on a wall that is turned, bowed or rough: that is for the tests of the plane."""
    whole = np.vstack([counts(squares=20, at=at, seed=int(at)) for at in (40.0, 52.0, 64.0, 76.0, 90.0)])
    assert not mixed(whole).any()


def test_a_square_that_is_noisier_than_usual_is_not_mixed() -> None:
    """Far away or at a grazing view; but not four times as noisy."""
    assert not mixed(np.vstack([counts(squares=1, sigma=2 * SIGMA), counts()])).any()
    assert mixed(np.vstack([counts(squares=1, sigma=4 * SIGMA), counts()]))[0]


def test_too_few_squares_or_soundings_say_nothing() -> None:
    assert not mixed(beside(counts(squares=3), 30)).any()
    assert mixed(beside(counts(squares=4), 30)).tolist() == [True, False, False, False]
    assert not mixed(np.zeros((5, BINS), dtype=int)).any()


def test_beside_a_mixed_square_half_as_much_is_enough() -> None:
    """A thing ends 5 of 60 soundings into the next square. Farther away so many are chance."""
    wall = beside(counts(), 20)
    wall[[1, 2]] = beside(counts(squares=1), 5)[0]
    at = np.column_stack([np.arange(-50, 50), np.full(100, 7)])
    assert np.flatnonzero(mixed_squares.mixed(at, wall)).tolist() == [0, 1]
    corner = at + np.array([[0, 1]]) * (np.arange(100) == 1)[:, None]
    assert np.flatnonzero(mixed_squares.mixed(corner, wall)).tolist() == [0, 1]
    assert np.flatnonzero(mixed_squares.mixed(corner + corner * [[0, 1]], wall)).tolist() == [0]
