"""Sums over the observations of one moment on one surface: all that a solution with corrected poses needs.

Between two records of the INS the body moves along one straight step, and what one sensor sees of one surface within it
(a *group*: a ping's beams on the wall, some hundred laser points on a block) is seen from one pose p, T =
R_target_from_body. With r = X - p the vector from the body to a point and α = t1 · r, β = t2 · r along the surface's
tangents, the observation v = n · (X - c) - shift changes

    with a pose error (δ, ω), X -> X + δ + ω × r:    n · δ + ω · (r × n),        r × n = β t1 - α t2
    with the mount (ε, λ), body axes:                ε · Tᵀ((r - T l) × n) + λ · Tᵀ n
    with the surface's turns and shift:              (α + t1 · (p - c), β + t2 · (p - c), -1)

all linear in q = (1, α, β) with coefficients that are the same for the whole group (t1 × t2 = n; a part of r along n
does not count). So Σ w q qᵀ (3, 3), Σ w q v (3,) and Σ w v² hold the normal equations of every unknown, whatever the
number of points: a stream is read once for each linearisation.

Within the step the error of the pose goes from that of one record to that of the next, (1 - s) e_k + s e_{k+1}. A
scanner's line meets a wall from top to bottom in that time, so that s goes with β, and 2 mm of white noise between two
records turn the wall by 0.02° in this group: Σ w s q qᵀ, Σ w s² q qᵀ and Σ w s q v are needed as well. (With the mean
of s in their stead the mean normalised squared error of the six rose from 6-7 to 8.3.)

The design must be taken at the adjusted point, not at the measured one. Noise along the ray moves the point along the
surface as well, so v and α, β are correlated, and Σ w α v would be off by σ² (n · d)(t1 · d) a point (errors in
variables): where the points of a moment spread over decimetres, that turns the heading by hundredths of a degree. The
least squares correction of a point with covariance Σ is -Σ n v / (nᵀ Σ n) (Gauss-Helmert), after which α and β carry
no noise that v knows of.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
FEATURES = 3  # 1, α, β
POWERS = 3  # of s


@dataclass(frozen=True)
class EpochSums:
    """Groups of one sensor, ascending by record and surface.

    record (g,): the last record of the INS before them; surface (g,); normal (g, 3, 3, 3) = Σ w sᵏ q qᵀ, k = 0, 1, 2;
    right (g, 2, 3) = Σ w sᵏ q v, k = 0, 1; squares (g,) = Σ w v²; count (g,): observations with a weight.
    """

    record: Integers
    surface: Integers
    normal: Array
    right: Array
    squares: Array
    count: Array

    @property
    def weight(self) -> Array:
        """Σ w of each group (g,)."""
        return self.normal[:, 0, 0, 0]

    @property
    def share(self) -> Array:
        """The weighted mean of s of each group (g,)."""
        return np.asarray(self.normal[:, 1, 0, 0] / self.normal[:, 0, 0, 0])

    def __len__(self) -> int:
        return len(self.record)

    def moved(self, change: Array) -> "EpochSums":
        """The same observations after v has changed by q · ``change`` (g, 3): no need to read the points again.

        Exact but for the turn of q itself, which is of second order: 1e-3 rad of 10 m are 5 µm.
        """
        pulled = np.einsum("gkqr,gr->gkq", self.normal[:, :2], change)
        squares = np.einsum("gq,gq->g", change, 2 * self.right[:, 0] + pulled[:, 0])
        return replace(self, right=self.right + pulled, squares=self.squares + squares)


def epoch_sums(
    record: Integers, share: Array, surface: Integers, surfaces: int, q: Array, weight: Array, v_m: Array
) -> EpochSums:
    """Of one batch: record, share s, surface, weight and v (n,), q (3, n)."""
    first = int(record.min()) if len(record) else 0
    key = (record - first) * surfaces + surface
    size = int(key.max()) + 1 if len(key) else 0
    found = np.flatnonzero(np.bincount(key, weights=weight, minlength=size) > 0)

    def total(values: Array) -> Array:
        return np.asarray(np.bincount(key, weights=values, minlength=size)[found])

    normal, right = np.empty((len(found), POWERS, FEATURES, FEATURES)), np.empty((len(found), POWERS - 1, FEATURES))
    weighted = weight
    for power in range(POWERS):
        for row in range(FEATURES):
            product = weighted * q[row]
            if power < POWERS - 1:
                right[:, power, row] = total(product * v_m)
            for column in range(row + 1):
                normal[:, power, row, column] = normal[:, power, column, row] = total(product * q[column])
        weighted = weighted * share
    squares, count = total(weight * v_m**2), total((weight > 0).astype(np.float64))
    return EpochSums(first + found // surfaces, found % surfaces, normal, right, squares, count)


def merged(pieces: Iterable[EpochSums]) -> EpochSums:
    """All batches together, in order; a group may be spread over several."""
    parts = list(pieces)
    keys = np.concatenate([np.column_stack([one.record, one.surface]) for one in parts])
    groups, inverse = np.unique(keys, axis=0, return_inverse=True)

    def added(name: str) -> Array:
        values = np.concatenate([getattr(one, name) for one in parts])
        total = np.zeros((len(groups), *values.shape[1:]))
        np.add.at(total, inverse.ravel(), values)
        return total

    return EpochSums(groups[:, 0], groups[:, 1], *(added(name) for name in ("normal", "right", "squares", "count")))


def adjusted(r_m: Array, normal: Array, v_m: Array, spread: Array) -> Array:
    """Vectors r (n, 3) to points moved by their least squares correction; ``spread`` = Σ n (n, 3) m², normal (n, 3)."""
    variance = np.einsum("ni,ni->n", spread, normal)
    return np.asarray(r_m - spread * (v_m / variance)[:, None])
