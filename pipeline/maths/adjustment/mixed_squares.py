"""Squares of a wall in which soundings of several passes lie to one side of the rest: something stands before the wall.

The beams of a sonar are wide. At the edge of a ladder, a fender, a rope or a ledge one echo comes from both it and the
wall, and the bottom detection takes a place between them. Robust weights cut what lies far off, but not what lies near
the wall: the rest is off to one side. In such a square, and in the cells beside it, no sounding is trusted.

A square is compared with itself in one pass, not with the plane nor with other passes: its soundings lie about their
median, wherever the wall stands. So a wall that is turned or bowed has no such squares, and passes that contradict one
another (a clock, a drift) make none. Residuals are in units of their expected sigmas. A sounding is *off* beyond 4
standard deviations of the usual square of this pass and face from the median; with the quartiles q of a square its
standard deviation is (q₃ - q₁) / 1.349, as for normal errors, and the usual one is the median over the soundings. Large
noise is off to both sides: the *excess* of a square is the number off on the one less that on the other.

A wall is cut into cells of half a square's side, and every square of two by two cells is judged. Squares overlap, so it
matters little where the cells begin: with squares side by side a ledge that lies across four of them is found in none.

A square is mixed if its excess, of all passes together,

* is a larger share of its soundings than usual, by a tenth, and certainly larger by the binomial distribution: all
  squares of the face together have a chance of 0.01 at most of one that is named wrongly, if soundings are independent
  and no part of the face is noisier;
* is larger than 3.4 times the root of the number that are off, which is its standard deviation if each is off to either
  side by chance, as in a noisier part. (By 3, four times as many squares would be named there, and they do grow: of
  walls with four times the noise on two fifths, 9 % were left out, by 3.4 one hundredth.) But soundings of a ping
  are not independent: so
* most of the passes that see the square, and two at least, must have an excess to this side, beyond its own standard
  deviation. A thing stands there in every pass; a bad ping, a fish, an echo of the boat does not.

Amid a thing an echo comes from anywhere between it and the wall, and soundings are off to both sides. So mixed squares
grow: those one cell beside them that have a tenth more off than usual, to whatever side, belong to them, up to 6 cells
away. All cells of these squares are left out, and then those beside them, for a thing does not end where a square does.

If all these cells hold more than half of the soundings of a face, no single thing explains them, and none is left out:
the tests of noise and of residuals speak.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Counts = NDArray[np.integer[Any]]
Flags = NDArray[np.bool_]
FEWEST_SQUARES = 25  # of a face that is judged: as many as hold one of four by four cells
FEWEST_SOUNDINGS = 8  # of a square in a pass that is judged
QUARTILES_APART = 1.349  # in standard deviations of normal errors
OFF, CERTAIN = 4.0, 3.4  # usual standard deviations from the median; those of an excess by chance
LARGER_SHARE = 0.1  # than usual: of the excess of a mixed square; half of it in a pass that agrees
LEAST_SHARE = 0.02  # of the excess of a usual square
CHANCE = 0.01  # of all squares of a face together
MOST = 0.5  # of a face's soundings
OF_SQUARE = ((0, 0), (1, 0), (0, 1), (1, 1))  # its cells: columns and rows on
BESIDE, GROWN = ((1, 0), (-1, 0), (0, 1), (0, -1)), 6  # columns and rows on; cells
AT_A_TIME = 1 << 13  # squares whose soundings are counted by bin


@dataclass(frozen=True)
class OverlappingSquares:
    """All squares of two by two cells that hold a cell of a face with soundings.

    place (c, 2): column and row of the cells; corner (s, 2): those of the squares' lowest cells; cells (s, 4): numbers
    of the squares' cells; c for one without soundings.
    """

    place: Integers
    corner: Integers
    cells: Integers

    @classmethod
    def of(cls, place: Integers) -> "OverlappingSquares":
        """Return the squares of cells at columns and rows (c, 2), which ascend."""
        corner = np.unique(np.concatenate([place - on for on in OF_SQUARE]), axis=0)
        code, wanted = _code(place, corner), _code(corner[:, None] + np.array(OF_SQUARE), corner)
        nearest = np.minimum(np.searchsorted(code, wanted), len(code) - 1)
        return cls(place, corner, np.where(code[nearest] == wanted, nearest, len(place)))

    def sums(self, of_cells: Counts) -> Iterator[Integers]:
        """Yield the sums over the squares of numbers (c + 1, b) of the cells and of none, for so many at a time."""
        for start in range(0, len(self.cells), AT_A_TIME):
            yield np.asarray(sum(of_cells[of_corner] for of_corner in self.cells[start : start + AT_A_TIME].T))

    def cells_of(self, found: Flags) -> Flags:
        """Return which cells (c,) some of the squares (s,) hold."""
        return np.isin(np.arange(len(self.place)), self.cells[found])


@dataclass(frozen=True)
class PassExcess:
    """Of each square (s,) of a face in one pass: number of soundings, of those off, and the excess, signed.

    All are zero where a square is not judged.
    """

    number: Integers
    off: Integers
    excess: Integers

    @classmethod
    def of(cls, squares: OverlappingSquares, of_cells: Counts) -> "PassExcess":
        """Return the excess from the numbers of soundings (c + 1, b) by cell and bin; the last row has none."""
        number = np.concatenate([count.sum(axis=1) for count in squares.sums(of_cells)])
        first, median, third = np.concatenate([_quartiles(count) for count in squares.sums(of_cells)], axis=1)
        within = (first >= 1) & (third <= of_cells.shape[1] - 1)  # those in the end bins lie anywhere beyond
        number = np.where(within & (number >= FEWEST_SOUNDINGS), number, 0)
        usual = max(_weighted_median(third - first, number) / QUARTILES_APART, 0.5)
        middle, start, sides = np.arange(of_cells.shape[1]) + 0.5, 0, []
        for count in squares.sums(of_cells):
            off = middle - median[start : start + len(count), None]
            sides.append([np.sum(count, axis=1, where=side * off > OFF * usual) for side in (1, -1)])
            start += len(count)
        above, below = np.concatenate(sides, axis=1) * (number > 0)
        return cls(number, above + below, above - below)


def mixed(squares: OverlappingSquares, soundings: Integers, passes: Iterable[PassExcess]) -> Flags:
    """Return whether each cell (c,) of a face lies in a mixed square, or in one that belongs to it, or beside them.

    Parameters
    ----------
    squares : OverlappingSquares
        The squares of the face.
    soundings : (c,) array
        Number of all soundings of each cell.
    passes : iterable of PassExcess
        What each pass says of the squares.
    """
    of_passes = list(passes)
    number, off, excess = (np.array([getattr(one, name) for one in of_passes]) for name in ("number", "off", "excess"))
    seen, all_excess = number.sum(axis=0), excess.sum(axis=0)
    likely = np.maximum(LARGER_SHARE / 2 * number, np.sqrt(off))
    agree = np.sum(excess * np.sign(all_excess) > likely, axis=0, where=number > 0)
    voted = (agree >= 2) & (2 * agree > np.sum(number > 0, axis=0))
    all_off = off.sum(axis=0)
    to_one_side = np.abs(all_excess) > CERTAIN * np.sqrt(all_off)
    found = voted & to_one_side & _certain(np.abs(all_excess), seen)
    wide = all_off > (_usual_share(all_off, seen) + LARGER_SHARE) * seen
    for _ in range(GROWN):
        found |= _beside(squares.corner, found) & wide
    cells = squares.cells_of(found)
    cells |= _beside(squares.place, cells)
    return np.asarray(cells & (soundings[cells].sum() <= MOST * soundings.sum()))


def _beside(place: Integers, found: Flags) -> Flags:
    """Return whether each of these (n,), at columns and rows (n, 2), lies beside one that is found."""
    return np.isin(_code(place, place), _code(place[found][:, None] + np.array(BESIDE), place))


def _code(place: Integers, within: Integers) -> Integers:
    """Return a number (...,) for each column and row (..., 2) that are within those of others (c, 2), or one beyond."""
    low, high = within.min(axis=0) - 1, within.max(axis=0) + 1
    return np.asarray((place - low) @ [high[1] - low[1] + 1, 1])


def _usual_share(some: Integers, of: Integers) -> float:
    """Return the usual share of some soundings (s,) of so many, the median over all."""
    return max(_weighted_median(some / np.maximum(of, 1), of), LEAST_SHARE)


def _certain(excess: Integers, number: Integers) -> Flags:
    """Return whether the excess (s,) of so many soundings is a larger share than usual, and certainly larger."""
    from scipy.special import bdtrc

    judged = number > 0
    if judged.sum() < FEWEST_SQUARES:
        return np.zeros(len(number), dtype=bool)
    usual = _usual_share(excess, number)
    chance = bdtrc(np.maximum(excess - 1, 0), np.maximum(number, 1), usual)
    return np.asarray((excess > (usual + LARGER_SHARE) * number) & (chance < CHANCE / judged.sum()))


def _weighted_median(value: Array, weight: Integers) -> float:
    """Return the median of values (s,) that count so many times; zero if none counts."""
    order = np.argsort(value)
    below = np.cumsum(weight[order])
    return float(value[order][np.searchsorted(below, below[-1] / 2)]) if len(below) and below[-1] else 0.0


def _quartiles(count: Integers) -> Array:
    """Return the places (3, s), in bins, of the quartiles of each square's soundings (s, b); zero without any."""
    below, rows, places = np.cumsum(count, axis=1), np.arange(len(count)), []
    for share in (0.25, 0.5, 0.75):
        wanted = share * below[:, -1]
        bin_ = np.argmax(below >= wanted[:, None], axis=1)
        within = count[rows, bin_]
        places.append(bin_ + (wanted - below[rows, bin_] + within) / np.maximum(within, 1))
    return np.array(places)
