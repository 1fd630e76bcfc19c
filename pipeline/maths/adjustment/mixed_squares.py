"""Squares of a wall in which many soundings do not lie on the wall, because something stands before it.

The beams of a sonar are wide. At the edge of a ladder, a fender, a rope or a ledge one echo comes from both it and the
wall, and the bottom detection takes a place between them. Robust weights cut what lies far off, but not what lies near
the wall: the rest is off to one side. Where many soundings of a square are far off its others, none is trusted.

A square is compared with itself, not with the plane: its soundings lie about their median, wherever the wall stands.
So a wall that is turned, bowed or rough has no such squares. Residuals are in units of their expected sigmas, and with
the quartiles q of a square, its standard deviation is (q₃ - q₁) / 1.349, as for normal errors. A sounding is *off*
beyond 4 standard deviations of the usual square of its face, the median of all, from the median of its own.

A square is mixed if the share of soundings that are off is larger than usual by a tenth, and certainly larger: by the
binomial distribution, all squares of the face together have the chance 0.01 of one that is named wrongly. The usual
share is the median of the squares: water with outliers everywhere has no mixed squares. Beside a mixed square, at its
sides or corners, half of that tenth is enough, certain or not: a thing does not end where a square does.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
FEWEST_SQUARES = 4  # of a face that is judged
FEWEST_SOUNDINGS = 8  # of a square that is judged
QUARTILES_APART = 1.349  # in standard deviations of normal errors
OFF = 4.0  # usual standard deviations from the median
LARGER_SHARE = 0.1  # than usual: of a mixed square
LEAST_SHARE = 0.02  # of soundings that are off, of a usual square
CHANCE = 0.01  # of all squares of a face together


def mixed(place: Integers, count: Integers) -> Flags:
    """Return whether each square (c,) of a face is mixed.

    Parameters
    ----------
    place : (c, 2) array
        Column and row of each square.
    count : (c, b) array
        Number of soundings by square and bin of their residuals, bins of one width.
    """
    from scipy.special import bdtrc

    number = count.sum(axis=1)
    judged = number >= FEWEST_SOUNDINGS
    if judged.sum() < FEWEST_SQUARES:
        return np.zeros(len(count), dtype=bool)
    first, median, third = (_quantiles(count, share) for share in (0.25, 0.5, 0.75))
    usual = max(float(np.median((third - first)[judged])) / QUARTILES_APART, 0.5)
    centre = np.arange(count.shape[1]) + 0.5
    off = np.sum(count * (np.abs(centre - median[:, None]) > OFF * usual), axis=1)
    share = off / np.maximum(number, 1)
    of_usual = max(float(np.median(share[judged])), LEAST_SHARE)
    certain = bdtrc(np.maximum(off - 1, 0), np.maximum(number, 1), of_usual) < CHANCE / judged.sum()
    larger = share - of_usual
    sure = judged & (larger > LARGER_SHARE) & certain
    return np.asarray(sure | (_beside(place, sure) & (larger > LARGER_SHARE / 2)))


def _beside(place: Integers, sure: Flags) -> Flags:
    """Return whether each square (c,) touches one of those that are sure."""
    column, row = (place - place.min(axis=0)).T
    height = int(row.max()) + 3  # of numbers in a column, so that those beyond its ends are no square's
    number = column * height + row
    return np.isin(number, [number[sure] + right * height + up for right, up in product((-1, 0, 1), repeat=2)])


def _quantiles(count: Integers, share: float) -> Array:
    """Return the places (c,), in bins, below which this share of each square's soundings lies; zero without any."""
    below = np.cumsum(count, axis=1)
    wanted = share * below[:, -1]
    bin_, rows = np.argmax(below >= wanted[:, None], axis=1), np.arange(len(count))
    within = count[rows, bin_]
    return np.asarray(bin_ + (wanted - below[rows, bin_] + within) / np.maximum(within, 1))
