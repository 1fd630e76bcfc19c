"""Voxels: what is kept of millions of points, so that planes can be found and refitted without reading them again.

Of each voxel with points the number n of points and the sums of d and d dᵀ are kept, d from the voxel's middle: with
coordinates of a hundred metres and planes known to a millimetre, sums of squares of coordinates would lose the digits.
They add over batches, and over voxels: about another origin o, with t = middle - o,

    Σ (d + t) = Σ d + n t,        Σ (d + t)(d + t)ᵀ = Σ d dᵀ + s tᵀ + t sᵀ + n t tᵀ,   s = Σ d.

So the plane of any set of voxels, and the mean square of their points' distances from any plane, are those of the
points themselves: of a plane n · x = c,  Σ (n · x - c)² / n = n · Cov n + (n · mean - c)².
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SPAN = 2**20  # voxels on either side of the origin; 3 × 21 bits make one number of a voxel
ROWS, COLUMNS = np.triu_indices(3)


@dataclass(frozen=True)
class Voxels:
    """Voxels with points, ascending by code.

    size_m: length of an edge; code (n,): number of the voxel, from its three indices; count (n,): points; first (n, 3):
    Σ d; second (n, 6): Σ d dᵀ, upper triangle row by row.
    """

    size_m: float
    code: Integers
    count: Integers
    first: Array
    second: Array

    def __len__(self) -> int:
        return len(self.code)

    @cached_property
    def index(self) -> Integers:
        """Return the three indices (n, 3)."""
        return np.column_stack([self.code >> 42, self.code >> 21, self.code]) % (2 * SPAN) - SPAN

    @cached_property
    def middle_m(self) -> Array:
        """Return the middles (n, 3)."""
        return np.asarray((self.index + 0.5) * self.size_m)

    @cached_property
    def mean_m(self) -> Array:
        """Return the means (n, 3) of the points."""
        return np.asarray(self.middle_m + self.first / self.count[:, None])

    @cached_property
    def covariance(self) -> Array:
        """Return the covariances (n, 3, 3) of the points, with divisor n, m²."""
        mean = self.first / self.count[:, None]
        found = np.empty((len(self), 3, 3))
        found[:, ROWS, COLUMNS] = found[:, COLUMNS, ROWS] = self.second / self.count[:, None]
        return found - mean[:, :, None] * mean[:, None, :]

    def code_of(self, points_m: Array) -> Integers:
        """Return the numbers (m,) of the voxels in which points (m, 3) lie."""
        return _code(np.floor(points_m / self.size_m).astype(np.int64))

    def selected(self, rows: Integers | NDArray[np.bool_]) -> "Voxels":
        """Return these voxels, ascending as they are here."""
        return Voxels(self.size_m, self.code[rows], self.count[rows], self.first[rows], self.second[rows])

    @cached_property
    def neighbours(self) -> tuple[Integers, Integers]:
        """Return the pairs of voxels that touch, by a face, an edge or a corner; each pair both ways, by the first.

        Returns
        -------
        starts : (n + 1,) array
            Of each voxel, where its neighbours begin in ``others``; the last: their number.
        others : array
            Rows of the neighbours.
        """
        steps = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)]
        one, other = [], []
        for step in steps:
            wanted = self.code + _code(np.array([step]) - SPAN)[0]
            place = np.minimum(np.searchsorted(self.code, wanted), len(self) - 1)
            found = np.flatnonzero(self.code[place] == wanted)
            one.append(found)
            other.append(place[found])
        first, second = np.concatenate(one), np.concatenate(other)
        order = np.argsort(first, kind="stable")
        return np.searchsorted(first[order], np.arange(len(self) + 1)), second[order]


def voxels_of(points_m: Array, size_m: float) -> Voxels:
    """Return the voxels of points (m, 3) m; the edges lie at multiples of ``size_m``.

    >>> voxels_of(np.array([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [0.7, 0.1, 0.1]]), 0.5).count
    array([2, 1])
    """
    return voxels_with_rows(points_m, size_m)[0]


def voxels_with_rows(points_m: Array, size_m: float) -> tuple[Voxels, Integers]:
    """Return the same, and the row (m,) of the voxel in which each point lies."""
    index = np.floor(points_m / size_m).astype(np.int64)
    d = points_m - (index + 0.5) * size_m
    columns = [np.ones(len(d)), *d.T, *(d[:, i] * d[:, j] for i, j in zip(ROWS, COLUMNS, strict=True))]
    return _together(size_m, _code(index), np.array(columns))


def merged_voxels(pieces: Iterable[Voxels]) -> Voxels:
    """Return the voxels of all batches together; there must be one at least."""
    parts = list(pieces)
    columns = [np.column_stack([part.count, part.first, part.second]) for part in parts]
    return _together(parts[0].size_m, np.concatenate([part.code for part in parts]), np.concatenate(columns).T)[0]


def _code(index: Integers) -> Integers:
    """Return one number (n,) of three indices (n, 3); numbers of sums of indices are sums of numbers, less the base."""
    shifted = index + SPAN
    return np.asarray((shifted[:, 0] << 42) + (shifted[:, 1] << 21) + shifted[:, 2])


def _together(size_m: float, code: Integers, columns: Array) -> tuple[Voxels, Integers]:
    """Return voxels from rows with these codes (m,), and the voxel of each; columns (10, m): count, Σ d, Σ d dᵀ."""
    found, inverse = np.unique(code, return_inverse=True)
    sums = np.array([np.bincount(inverse, weights=column, minlength=len(found)) for column in columns])
    return Voxels(size_m, found, np.rint(sums[0]).astype(np.int64), sums[1:4].T.copy(), sums[4:].T.copy()), inverse
