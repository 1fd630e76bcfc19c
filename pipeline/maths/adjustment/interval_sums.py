"""Sums over what one sensor sees of one surface between two records of the INS (an *epoch*): all that a solution needs.

Between two records the body moves along one straight step, and all points of an epoch (a ping's beams on the wall, some
hundred laser points on a block) are seen from one pose p, T = R_target_from_body. With r = X - p the vector from the
body to a point and α = t1 · r, β = t2 · r along the surface's tangents, the observation v = n · (X - c) - shift changes

    with a pose error (δ, ω), X -> X + δ + ω × r:    n · δ + ω · (r × n),        r × n = β t1 - α t2
    with the mount (ε, λ), body axes:                ε · Tᵀ((r - T l) × n) + λ · Tᵀ n
    with the surface's turns and shift:              (α + t1 · (p - c), β + t2 · (p - c), -1)

all linear in q = (1, α, β) with coefficients that are the same for the whole epoch (t1 × t2 = n; a part of r along n
does not count). What does not follow from these (an error of the ranges, of the sound speed) brings a feature of its
own: q = (1, α, β, …), F in all. So Σ w q qᵀ (F, F), Σ w q v (F,) and Σ w v² hold the normal equations of every unknown,
whatever the number of points: a stream is read once for each linearisation.

Within the step the error of the pose goes from that of one record to that of the next, (1 - s) e_k + s e_{k+1}. A
scanner's line meets a wall from top to bottom in that time, so that s goes with β, and 2 mm of white noise between two
records turn the wall by 0.02° in this epoch: sums with s and s² are needed as well, of the three features that a pose
error moves. (With the mean of s in their stead the mean normalised squared error of the six rose from 6-7 to 8.3.)
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
MOVING = 3  # 1, α, β: the features that a pose error moves


@dataclass(frozen=True)
class EpochSums:
    """Epochs of one sensor, ascending by record and surface.

    record (g,): the last record of the INS before them; surface (g,); with q₃ the first three features, s the place
    between two records:

    normal (g, F, F) = Σ w q qᵀ, swept (g, 3, F) = Σ w s q₃ qᵀ, swept_twice (g, 3, 3) = Σ w s² q₃ q₃ᵀ,
    right (g, F) = Σ w q v, right_swept (g, 3) = Σ w s q₃ v, squares (g,) = Σ w v², count (g,): those with a weight.
    """

    record: Integers
    surface: Integers
    normal: Array
    swept: Array
    swept_twice: Array
    right: Array
    right_swept: Array
    squares: Array
    count: Array

    def __len__(self) -> int:
        return len(self.record)

    @property
    def share(self) -> Array:
        """The weighted mean of s of each epoch (g,)."""
        return np.asarray(self.swept[:, 0, 0] / self.normal[:, 0, 0])

    def taken(self, rows: Integers) -> "EpochSums":
        """Some of the epochs."""
        return EpochSums(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def moved(self, change: Array) -> "EpochSums":
        """The same observations after v has changed by q · ``change`` (g, F): no need to read the points again.

        Exact but for the turn of q itself, which is of second order: 1e-3 rad of 10 m are 5 µm.
        """
        pulled = np.einsum("gij,gj->gi", self.normal, change)
        return replace(
            self,
            right=self.right + pulled,
            right_swept=self.right_swept + np.einsum("gij,gj->gi", self.swept, change),
            squares=self.squares + np.einsum("gi,gi->g", change, 2 * self.right + pulled),
        )


@dataclass(frozen=True)
class Runs:
    """Points that follow one another and belong together: first of each run (g,), how many (g,).

    Sums over neighbours cost a quarter of sums by number (bincount), and what a run shares is spread, not looked up.
    """

    starts: Integers
    lengths: Integers

    @classmethod
    def of(cls, *keys: Integers) -> "Runs":
        """Of equal keys, (n,) each."""
        n = len(keys[0])
        new = np.ones(n, dtype=bool)
        if n:
            new[1:] = np.any([key[1:] != key[:-1] for key in keys], axis=0)
        starts = np.flatnonzero(new)
        return cls(starts, np.diff(starts, append=n))

    def total(self, values: Array) -> Array:
        """Sums over each run of values (…, n): (…, g)."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=-1))

    def spread(self, values: Array) -> Array:
        """What belongs to each run (…, g), for each of its points (…, n)."""
        return np.asarray(np.repeat(values, self.lengths, axis=-1))


def epoch_sums(record: Integers, share: Array, surface: Integers, q: Array, weight: Array, v_m: Array) -> EpochSums:
    """Of one batch: record, share s, surface, weight and v (n,), q (F, n); quickest where epochs lie together."""
    runs = Runs.of(record, surface)
    features, epochs, total = len(q), len(runs.starts), runs.total
    normal, swept = np.empty((epochs, features, features)), np.empty((epochs, MOVING, features))
    twice, right = np.empty((epochs, MOVING, MOVING)), np.empty((epochs, features))
    right_swept = np.empty((epochs, MOVING))
    for row in range(features):
        weighted = weight * q[row] if row else weight
        right[:, row] = total(weighted * v_m)
        for column in range(row + 1):
            normal[:, row, column] = normal[:, column, row] = total(weighted * q[column] if column else weighted)
    weighted = weight * share
    for row in range(MOVING):
        once = weighted * q[row] if row else weighted
        right_swept[:, row] = total(once * v_m)
        again = once * share
        for column in range(row, features):
            swept[:, row, column] = total(once * q[column] if column else once)
            if column < MOVING:
                swept[:, column, row] = swept[:, row, column]
                twice[:, row, column] = twice[:, column, row] = total(again * q[column] if column else again)
    count, squares = total((weight > 0).astype(np.float64)), total(weight * v_m**2)
    first = runs.starts
    sums = EpochSums(record[first], surface[first], normal, swept, twice, right, right_swept, squares, count)
    return merged([sums.taken(np.flatnonzero(normal[:, 0, 0] > 0))])


def merged(pieces: Iterable[EpochSums]) -> EpochSums:
    """All batches together, in order; an epoch may be spread over several."""
    parts = list(pieces)
    record, surface = (np.concatenate([getattr(one, name) for one in parts]) for name in ("record", "surface"))
    order = np.lexsort((surface, record))
    first = Runs.of(record[order], surface[order]).starts

    def added(name: str) -> Array:
        return np.asarray(np.add.reduceat(np.concatenate([getattr(one, name) for one in parts])[order], first))

    sums = (added(name) for name in list(EpochSums.__dataclass_fields__)[2:])
    return EpochSums(record[order[first]], surface[order[first]], *sums)
