"""Squares that are mixed: told from chance, from noise, from bad pings and passes, and from walls that are turned."""

import numpy as np
import pytest

from pipeline.maths.adjustment import mixed_squares
from pipeline.maths.adjustment.mixed_squares import OverlappingSquares, PassExcess, mixed

BINS, MIDDLE, SIGMA = 128, 64.0, 2.0  # sigma in bins
SQUARES, SOUNDINGS, PASSES = 100, 30, 3
Counts = list[np.ndarray]  # of each pass, by square and bin


def binned(residuals: np.ndarray) -> np.ndarray:
    """Numbers by square and bin of residuals (squares, soundings), in sigmas."""
    bins = np.clip(np.floor(MIDDLE + SIGMA * residuals).astype(int), 0, BINS - 1)
    return np.array([np.bincount(of_square, minlength=BINS) for of_square in bins])


def noise(*, squares: int = SQUARES, soundings: int = SOUNDINGS, seed: int = 5) -> np.ndarray:
    """Residuals of a clean wall by pass, square and sounding, in sigmas."""
    return np.random.default_rng(seed).normal(size=(PASSES, squares, soundings))


def named(residuals: np.ndarray, place: np.ndarray | None = None) -> list[int]:
    """Numbers of the cells that are mixed; without places, each is a square's only one, and none touch."""
    counts = [binned(of_pass) for of_pass in residuals]
    number = np.arange(len(counts[0]))
    return mixed_cells(counts, np.column_stack([3 * number, 0 * number]) if place is None else place)


def mixed_cells(counts: Counts, place: np.ndarray) -> list[int]:
    """Numbers of the cells that are mixed, from the numbers of soundings by pass, cell and bin."""
    squares, soundings = OverlappingSquares.of(place), np.sum([count.sum(axis=1) for count in counts], axis=0)
    return np.flatnonzero(mixed(squares, soundings, [excess(squares, count) for count in counts])).tolist()


def excess(squares: OverlappingSquares, count: np.ndarray) -> PassExcess:
    return PassExcess.of(squares, np.concatenate([count, np.zeros((1, BINS), dtype=int)]))


def grid(columns: int, rows: int) -> np.ndarray:
    """Columns and rows of cells that touch."""
    number = np.arange(columns * rows)
    return np.column_stack([number // rows, number % rows])


def test_a_clean_wall_has_no_mixed_square() -> None:
    assert named(noise(squares=3000)) == []


@pytest.mark.parametrize(
    ("share", "off", "is_mixed"),
    [
        (0.2, 10.0, True),
        (0.2, -10.0, True),
        (0.07, 10.0, False),  # a tenth more than usual is wanted
        (0.2, 3.0, False),  # within 4 sigmas
        (0.7, 10.0, True),  # most of them: those on the wall are the rest
        (1.0, 10.0, False),  # all of them: the square stands off
    ],
)
def test_a_square_with_a_thing_before_it_is_mixed(share: float, off: float, is_mixed: bool) -> None:
    wall = noise()
    wall[:, 7, : round(share * SOUNDINGS)] += off
    assert named(wall) == [7] * is_mixed


@pytest.mark.parametrize(("passes", "is_mixed"), [(1, False), (2, True), (3, True)])
def test_most_passes_must_see_it(passes: int, is_mixed: bool) -> None:
    """One pass alone: a fish, a bad ping, an echo of the boat."""
    wall = noise()
    wall[:passes, 7, :15] += 10.0
    assert named(wall) == [7] * is_mixed


def test_passes_must_see_it_on_the_same_side() -> None:
    wall = noise()
    wall[0, 7, :15] += 10.0
    wall[1, 7, :12] -= 10.0
    assert named(wall) == []


def test_a_square_that_one_pass_alone_sees_is_not_judged() -> None:
    wall = noise()[:1]
    wall[0, 7, :15] += 10.0
    assert named(wall) == []


@pytest.mark.parametrize(("soundings", "is_mixed"), [(7, False), (8, True)])
def test_few_soundings_of_a_pass_say_nothing(soundings: int, is_mixed: bool) -> None:
    few = noise(soundings=soundings)
    few[:, 7, :4] += 10.0
    assert named(few) == [7] * is_mixed


@pytest.mark.parametrize("times", [3.0, 4.0])
def test_of_a_part_that_is_noisier_hardly_anything_is_left_out(times: float) -> None:
    """Squares that overlap, a few soundings in each cell: what is named by chance grows."""
    share = []
    for seed in range(10):
        wall = noise(squares=60 * 24, soundings=8, seed=seed)
        wall[:, : 24 * 24] *= times
        share.append(len(named(wall, grid(60, 24))) / (60 * 24))
    assert np.mean(share) < 0.015


@pytest.mark.parametrize("times", [2.0, 3.0, 4.0, 8.0])
def test_a_part_of_the_wall_that_is_noisier_has_none(times: float) -> None:
    """As the outer beams, or a grazing view: noise is off to both sides."""
    wall = noise(squares=400)
    wall[:, :160] *= times
    assert len(named(wall)) <= 1


def test_water_with_outliers_everywhere_has_none() -> None:
    wall, rng = noise(), np.random.default_rng(2)
    wall[:, :, :10] = rng.uniform(-30, 30, size=(PASSES, SQUARES, 10))
    assert named(wall) == []


def test_bad_pings_are_mostly_not_taken_for_things() -> None:
    """Of the pings 5 % measure 10 sigmas too far; 10 soundings of a ping, 3 pings of a pass lie in a square."""
    wall, rng = noise(squares=1000), np.random.default_rng(3)
    wall += np.repeat(10.0 * (rng.uniform(size=(PASSES, 1000, 3)) < 0.05), 10, axis=2)
    assert len(named(wall)) < 60  # where two of three passes have one in it, 5 %; by soundings alone it were 27 %


def test_passes_that_contradict_one_another_make_none() -> None:
    wall = noise()
    wall[1, 40:] += 6.0
    wall[2] -= 15.0
    assert named(wall) == []


def test_squares_that_stand_off_as_a_whole_are_not_mixed() -> None:
    """As on a wall that is turned or bowed, within the bins and beyond: that is for the tests of the plane."""
    assert named(noise() + np.linspace(-60, 60, SQUARES)[:, None]) == []


def test_cells_beside_mixed_squares_are_left_out_with_them() -> None:
    """A thing on the four cells of a square, X: squares of which it has two cells are mixed, too; of one not."""
    assert left_about(2, 5) == [
        ".....##.....",
        "....####....",
        "...##XX##...",
        "...##XX##...",
        "....####....",
        ".....##.....",
        "............",
    ]


def test_a_thing_at_a_rim_is_left_out_there_alone() -> None:
    """Not at the other end of the next column: cells are numbered through."""
    assert left_about(0, 10) == [
        "........##XX",
        "........##XX",
        ".........###",
        "..........##",
        "............",
        "............",
        "............",
    ]
    assert left_about(0, 0)[0] == "XX##........"


def left_about(column: int, row: int) -> list[str]:
    """A picture of a wall with a thing on four cells from this one on, X, and the others that are left out."""
    thing = [12 * column + row, 12 * column + row + 1, 12 * column + row + 12, 12 * column + row + 13]
    wall = noise(squares=7 * 12)
    wall[:, thing, :10] += 10.0
    left = named(wall, grid(7, 12) - 5)
    assert set(thing) <= set(left)
    picture = "".join("X" if cell in thing else "#" if cell in left else "." for cell in range(7 * 12))
    return [picture[start : start + 12] for start in range(0, 7 * 12, 12)]


@pytest.mark.parametrize("along", [0.0, 0.25, 0.5, 0.75])  # of a cell
@pytest.mark.parametrize("up", [0.0, 0.5])
def test_a_thing_is_found_wherever_the_cells_begin(along: float, up: float) -> None:
    """A thing of two by two cells, of which 40 % come as echoes; squares side by side would miss it at some places."""
    rng = np.random.default_rng(8)
    at = rng.uniform(0, 20, size=(PASSES, 12_000, 2))
    residuals = rng.normal(size=at.shape[:2])
    thing = np.all((at > 9) & (at < 11), axis=2)
    residuals[thing & (rng.uniform(size=thing.shape) < 0.4)] += 10.0
    column, row = np.floor(at + np.array([along, up])).astype(int).transpose(2, 0, 1)
    bins = np.clip(np.floor(MIDDLE + SIGMA * residuals).astype(int), 0, BINS - 1)
    counts = np.zeros((PASSES, 21 * 21, BINS), dtype=np.int64)
    np.add.at(counts, (np.arange(PASSES)[:, None], 21 * column + row, bins), 1)
    left = np.isin(21 * column + row, mixed_cells(list(counts), grid(21, 21)))
    assert left[thing].all()
    assert 16 < left.sum() / (PASSES * 12_000) * 400 < 36  # cells: the thing's four, and one or two beside them


def test_amid_a_thing_soundings_are_off_to_both_sides() -> None:
    """Its edge is at cell 20: squares up to six cells on belong to it, and a cell beside them; noise begins none."""
    wall = noise()
    wall[:, 20, :10] += 10.0
    for both in (slice(21, 35), slice(60, 70)):
        wall[:, both, :10] += 10.0
        wall[:, both, 10:20] -= 10.0
    number = np.arange(SQUARES)
    assert named(wall, np.column_stack([number, 0 * number])) == list(range(18, 28))


@pytest.mark.parametrize(("squares", "is_mixed"), [(30, True), (100, False)])
def test_an_excess_that_chance_explains_names_none(squares: int, is_mixed: bool) -> None:
    """Usually one of 20 is off, here four: in 60 by chance once in 28 000 squares. A cell lies in four of them."""
    wall = np.clip(noise(squares=squares, soundings=20), -3.0, 3.0)
    wall[:, :, :1] += 20.0
    wall[:, 7, :4] = 20.0
    assert named(wall) == [7] * is_mixed


@pytest.mark.parametrize(("columns", "is_mixed"), [(13, True), (14, False)])
def test_where_half_a_face_would_go_no_thing_explains_it(columns: int, is_mixed: bool) -> None:
    """Things on some of 30 columns; a column beside them is left out, too, and one of which half a square is theirs."""
    wall = noise(squares=300)
    wall[:, : 10 * columns, :10] += 10.0
    assert named(wall, grid(30, 10)) == list(range(10 * (columns + 2))) * is_mixed


def test_the_usual_square_is_that_of_the_soundings() -> None:
    """Sixty sparse squares at the rim, of less noise, do not make the forty of the wall noisy."""
    wall, number = noise(soundings=300), np.arange(SQUARES)
    squares = OverlappingSquares.of(np.column_stack([3 * number, 0 * number]))
    dense = np.all(squares.cells >= 60, axis=1)
    assert dense.sum() == 4 * 40  # a cell is in four squares
    for of_pass in wall:
        count = binned(of_pass)
        count[:60] = binned(0.2 * of_pass[:60, :9])
        assert np.all(np.abs(excess(squares, count).excess[dense]) <= 3)


def test_so_many_squares_at_a_time_are_judged_as_all_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = noise()
    wall[0, 7, :15] += 10.0
    squares = OverlappingSquares.of(grid(10, 10))
    at_once = excess(squares, binned(wall[0]))
    monkeypatch.setattr(mixed_squares, "AT_A_TIME", 7)
    in_parts = excess(squares, binned(wall[0]))
    assert at_once.excess.any()
    for name in ("number", "off", "excess"):
        assert np.array_equal(getattr(at_once, name), getattr(in_parts, name))


@pytest.mark.parametrize(("columns", "is_mixed"), [(11, False), (12, True)])
def test_too_few_squares_say_nothing(columns: int, is_mixed: bool) -> None:
    """Two rows of squares hold one of cells: 24 squares, or 26."""
    wall = noise(squares=columns)
    wall[:, 0, :10] += 10.0
    assert named(wall, grid(columns, 1)) == [0, 1, 2] * is_mixed
