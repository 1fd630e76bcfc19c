"""Differences of successive pings on a surface, from which their common noise follows.

Derivation: :mod:`pipeline.maths.adjustment.ping_noise`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import pose_design
from pipeline.maths.adjustment.interval_sums import N_MOVED, Intervals, IntervalSums, blocks
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.robust_weights import RobustEffects
from pipeline.maths.adjustment.weighting import FEWEST, EpochVarianceFactor

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
ROUNDS = 3  # of each estimation in turn
CERTAIN = 3.0  # sigmas by which an error must exceed what is expected, to be taken into the model
OVERLAP = 1.5  # variance of an estimate from overlapping differences over that from independent ones
NEAR = 3.0  # an interval farther from its successor than this multiple of the usual distance is left out
ALIKE = 0.9  # cosine of the directions of two lines whose slopes are compared
LEAST_SPREAD = 1e-300  # smallest divisor


@dataclass(frozen=True)
class Differences:
    """Differences of successive pings (n,) with E y² = d + (f + x) g: y², g, and the number of their surface."""

    squared: Array
    common: Array
    surface: Integers

    def design_effects(self, factor: float, n_surfaces: int) -> Array:
        """Return d by surface (s,), with f + x = ``factor``; 1 where it is not certainly larger."""
        effects = np.ones(n_surfaces)
        for surface in range(n_surfaces):
            rows = self.surface == surface
            common, squared = max(factor, 0.0) * self.common[rows], self.squared[rows]
            if not np.any(rows):
                continue
            certain = 1 + CERTAIN * np.sqrt(OVERLAP * 2 / np.sum((1 + common) ** -2))
            d = 1.0
            for _ in range(ROUNDS):
                weight = (max(d, 1.0) + common) ** -2
                d = float(weight @ (squared - common) / weight.sum())
            effects[surface] = d if d > certain else 1.0
        return effects

    def epoch_factor(self, effects: Array, factor: float) -> EpochVarianceFactor:
        """Return f + x, with the design effects (s,) and a first value of it."""
        d = effects[self.surface]
        sigma = np.inf
        for _ in range(ROUNDS):
            by_variance = self.common / (d + max(factor, 0.0) * self.common) ** 2
            information = float(by_variance @ self.common)
            if information <= 0:
                return EpochVarianceFactor(1.0, np.inf)
            factor = float(by_variance @ (self.squared - d)) / information
            sigma = float(np.sqrt(OVERLAP * 2 / information))
        return EpochVarianceFactor(factor, sigma)


@dataclass(frozen=True)
class Lines:
    """The line of each ping's soundings on a surface: what the differences of successive ones need, (g,) each.

    record, surface: numbers; total: Σ w; mean; spread: Σ w τ²; along (g, 2): its direction a; slope: along a; of_mean,
    of_slope: uᵀ U u and aᵀ U' a; sloping: whether the slope is determined.
    """

    record: Integers
    surface: Integers
    total: Array
    mean: Array
    spread: Array
    along: Array
    slope: Array
    of_mean: Array
    of_slope: Array
    sloping: NDArray[np.bool_]

    @classmethod
    def of(cls, sums: Intervals, surfaces: Sequence[ObservedSurface], white: Array) -> "Lines":
        """Return the lines of all intervals; ``white`` (6,): sigmas of a record's white noise, m and rad."""
        parts = [vars(cls._of_block(block, surfaces, white)) for block in blocks(sums)]
        return cls(**{name: np.concatenate([part[name] for part in parts]) for name in cls.__dataclass_fields__})

    @classmethod
    def _of_block(cls, sums: IntervalSums, surfaces: Sequence[ObservedSurface], white: Array) -> "Lines":
        U, total = white_covariance(sums, surfaces, white), sums.normal[:, 0, 0]
        u = sums.normal[:, 0, :N_MOVED] / total[:, None]
        C, right = centred(sums)
        values, vectors = np.linalg.eigh(C)
        spread, along = np.maximum(values[:, 1], LEAST_SPREAD), vectors[:, :, 1]
        along = along * np.where(along[:, :1] + along[:, 1:] < 0, -1.0, 1.0)
        return cls(
            record=sums.record,
            surface=sums.surface,
            total=total,
            mean=sums.right[:, 0] / total,
            spread=spread,
            along=along,
            slope=np.einsum("gi,gi->g", along, right) / spread,
            of_mean=np.einsum("gi,gij,gj->g", u, U, u),
            of_slope=np.einsum("gi,gij,gj->g", along, U[:, 1:, 1:], along),
            sloping=(sums.count >= FEWEST) & (values[:, 1] > LEAST_SPREAD),
        )

    def mean_differences(self, robust: RobustEffects) -> Differences:
        """Return the differences of the means of successive intervals."""
        first, second = self._pairs(np.ones(len(self.record), dtype=bool))
        squared = (self.mean[second] - self.mean[first]) ** 2
        return self._differences(squared, first, second, self.total, self.of_mean, robust)

    def slope_differences(self, robust: RobustEffects) -> Differences:
        """Return the differences of the slopes of successive intervals."""
        first, second = self._pairs(self.sloping)
        alike = np.einsum("ni,ni->n", self.along[first], self.along[second])
        near = np.abs(alike) > ALIKE
        first, second, sense = first[near], second[near], np.sign(alike[near])
        squared = (sense * self.slope[second] - self.slope[first]) ** 2
        return self._differences(squared, first, second, self.spread, self.of_slope, robust)

    def _differences(
        self, squared: Array, first: Integers, second: Integers, weight: Array, common: Array, robust: RobustEffects
    ) -> Differences:
        own = robust.variance * (1 / weight[first] + 1 / weight[second])
        shown = robust.shift**2 * (common[first] + common[second])
        return Differences(squared / own, shown / own, self.surface[first])

    def _pairs(self, enough: NDArray[np.bool_]) -> tuple[Integers, Integers]:
        """Return the intervals in the mask (g,) that have a successor, and this successor: their rows (n,) each."""
        first, second = [], []
        for surface in np.unique(self.surface):
            rows = np.flatnonzero((self.surface == surface) & enough)
            record = self.record[rows]
            place = np.searchsorted(record, record + 2)
            found = np.flatnonzero(place < len(rows))
            step = record[place[found]] - record[found]
            near = step <= NEAR * np.median(step) if len(step) else np.zeros(0, dtype=bool)
            first.append(rows[found[near]])
            second.append(rows[place[found[near]]])
        none = [np.empty(0, dtype=np.int64)]
        return np.concatenate(first + none), np.concatenate(second + none)


def centred(sums: IntervalSums) -> tuple[Array, Array]:
    """Return C = Σ w t tᵀ (g, 2, 2) and Σ w t v (g, 2), t from the interval's centroid."""
    normal, right = sums.normal[:, :N_MOVED, :N_MOVED], sums.right[:, :N_MOVED]
    centroid = normal[:, 1:, 0] / normal[:, :1, 0]
    return normal[:, 1:, 1:] - outer(centroid, normal[:, 0, 1:]), right[:, 1:] - centroid * right[:, :1]


def outer(first: Array, second: Array) -> Array:
    """Return the products (g, m, n) of each of (g, m) with each of (g, n)."""
    return first[:, :, None] * second[:, None, :]


def white_covariance(sums: IntervalSums, surfaces: Sequence[ObservedSurface], white: Array) -> Array:
    """Return c K W Kᵀ (g, 3, 3): the covariance of the coefficients of (1, α, β) by white noise of the records."""
    designs = pose_design(surfaces, np.arange(len(surfaces)))
    by_surface = (designs * white**2) @ np.swapaxes(designs, 1, 2)
    share = sums.share
    return np.asarray(((1 - share) ** 2 + share**2)[:, None, None] * by_surface[sums.surface])
