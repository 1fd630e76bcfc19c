"""Squares of a wall in which soundings of several passes lie to one side of the rest: something stands before the wall.

The beams of a sonar are wide. At the edge of a ladder, a fender, a rope or a ledge one echo comes from both it and the
wall, and the bottom detection takes a place between them. Robust weights cut what lies far off, but not what lies near
the wall: the rest is off to one side. In such a square, and in those beside it, no sounding is trusted.

A square is compared with itself in one pass, not with the plane nor with other passes: its soundings lie about their
median, wherever the wall stands. So a wall that is turned or bowed has no such squares, and passes that contradict one
another (a clock, a drift) make none. Residuals are in units of their expected sigmas. A sounding is *off* beyond 4
standard deviations of the usual square of this pass and face from the median; with the quartiles q of a square its
standard deviation is (q₃ - q₁) / 1.349, as for normal errors, and the usual one is the median over the soundings. Large
noise is off to both sides: the *excess* of a square is the number off on the one less that on the other.

A square is mixed if its excess, of all passes together,

* is a larger share of its soundings than usual, by a tenth, and certainly larger by the binomial distribution: all
  squares of the face together have the chance 0.01 of one that is named wrongly, if soundings are independent;
* is larger than 3 times the root of the number that are off, which is its standard deviation if each is off to either
  side by chance. But soundings of a ping are not independent: so
* most of the passes that see the square, and two at least, must have an excess to this side, beyond its own standard
  deviation. A thing stands there in every pass; a bad ping, a fish, an echo of the boat does not.

Amid a thing an echo comes from anywhere between it and the wall, and soundings are off to both sides. So a mixed square
grows: those beside it that have a tenth more off than usual, to whatever side, belong to it, up to 3 squares away; and
then all that lie beside these, for a thing does not end where a square does.

If all these squares hold more than half of the soundings of a face, no single thing explains them, and none is left
out: the tests of noise and of residuals speak.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
FEWEST_SQUARES = 4  # of a face that is judged
FEWEST_SOUNDINGS = 8  # of a square in a pass that is judged
QUARTILES_APART = 1.349  # in standard deviations of normal errors
OFF, CERTAIN = 4.0, 3.0  # usual standard deviations from the median; those of an excess by chance
LARGER_SHARE = 0.1  # than usual: of the excess of a mixed square; half of it in a pass that agrees
LEAST_SHARE = 0.02  # of the excess of a usual square
CHANCE = 0.01  # of all squares of a face together
MOST = 0.5  # of a face's soundings
BESIDE, GROWN = ((1, 0), (-1, 0), (0, 1), (0, -1)), 3  # columns and rows on; squares


@dataclass(frozen=True)
class PassExcess:
    """Of each square (c,) of a face in one pass: number of soundings, of those off, and the excess, signed.

    All are zero where a square is not judged.
    """

    number: Integers
    off: Integers
    excess: Integers

    @classmethod
    def of(cls, count: Integers) -> "PassExcess":
        """Return the excess from the numbers of soundings (c, b) by square and bin of their residuals."""
        number = count.sum(axis=1)
        first, median, third = (_quantiles(count, share) for share in (0.25, 0.5, 0.75))
        within = (first >= 1) & (third <= count.shape[1] - 1)  # those in the end bins lie anywhere beyond
        number = np.where(within & (number >= FEWEST_SOUNDINGS), number, 0)
        usual = max(_weighted_median(third - first, number) / QUARTILES_APART, 0.5)
        off = np.arange(count.shape[1]) + 0.5 - median[:, None]
        above, below = (np.sum(count * (side * off > OFF * usual), axis=1) * (number > 0) for side in (1, -1))
        return cls(number, above + below, above - below)


def mixed(place: Integers, soundings: Integers, passes: Iterable[PassExcess]) -> Flags:
    """Return whether each square (c,) of a face is mixed, or belongs to one that is, or lies beside it.

    Parameters
    ----------
    place : (c, 2) array
        Column and row of each square.
    soundings : (c,) array
        Number of all soundings of each.
    passes : iterable of PassExcess
        What each pass says.
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
        found |= _beside(place, found) & wide
    found |= _beside(place, found)
    return np.asarray(found & (soundings[found].sum() <= MOST * soundings.sum()))


def _beside(place: Integers, found: Flags) -> Flags:
    """Return whether each square (c,) lies beside one of those that are found."""
    column, row = (place - place.min(axis=0, initial=0)).T
    height = int(row.max(initial=0)) + 3  # of numbers in a column, so that those beyond its ends are no square's
    code = column * height + row
    return np.isin(code, [code[found] + right * height + up for right, up in BESIDE])


def _usual_share(some: Integers, of: Integers) -> float:
    """Return the usual share of some soundings (c,) of so many, the median over all."""
    return max(_weighted_median(some / np.maximum(of, 1), of), LEAST_SHARE)


def _certain(excess: Integers, number: Integers) -> Flags:
    """Return whether the excess (c,) of so many soundings is a larger share than usual, and certainly larger."""
    from scipy.special import bdtrc

    judged = number > 0
    if judged.sum() < FEWEST_SQUARES:
        return np.zeros(len(number), dtype=bool)
    usual = _usual_share(excess, number)
    chance = bdtrc(np.maximum(excess - 1, 0), np.maximum(number, 1), usual)
    return np.asarray((excess > (usual + LARGER_SHARE) * number) & (chance < CHANCE / judged.sum()))


def _weighted_median(value: Array, weight: Integers) -> float:
    """Return the median of values (c,) that count so many times; zero if none counts."""
    order = np.argsort(value)
    below = np.cumsum(weight[order])
    return float(value[order][np.searchsorted(below, below[-1] / 2)]) if len(below) and below[-1] else 0.0


def _quantiles(count: Integers, share: float) -> Array:
    """Return the places (c,), in bins, below which this share of each square's soundings lies; zero without any."""
    below = np.cumsum(count, axis=1)
    wanted = share * below[:, -1]
    bin_, rows = np.argmax(below >= wanted[:, None], axis=1), np.arange(len(count))
    within = count[rows, bin_]
    return np.asarray(bin_ + (wanted - below[rows, bin_] + within) / np.maximum(within, 1))
