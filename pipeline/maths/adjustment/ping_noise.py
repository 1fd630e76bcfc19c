"""Noise that the soundings of one ping share, beside the INS's: correlated beams, and an error of the whole ping.

Independent soundings determine the mean m = Σ w v / Σ w of an interval and the slopes of v along the surface with the
covariances 1 / Σ w and C⁻¹, C = Σ w t tᵀ, t = (α - ᾱ, β - β̄). The INS's white noise adds f c K W Kᵀ (see
:mod:`pipeline.maths.adjustment.weighting`). Two further errors are the sonar's:

* Neighbouring beams are correlated (they share array elements, filters, a bottom detection). The scatter of the points
  about the interval's own line hardly shows it. But the variance of a mean of n beams is larger by the *design effect*
  d (Kish 1965, "Survey sampling", 8.2), which for many beams with the correlation ρ^k of beams k apart is
  (1 + ρ) / (1 - ρ). The slopes have a design effect of their own; on a top that a few beams meet it is much smaller.
* A whole ping is displaced as by a wrong pose (an unsteady clock, beams stabilised by another attitude): the INS's
  factor f becomes f + x.

With u = (1, ᾱ, β̄), t = D⁻¹ t', the eigenvalues λ and eigenvectors e of D C D (D scales, as in the scatter), and
U = c K W Kᵀ, U' its part of (α, β),

    E m² Σ w = d + (f + x) uᵀ U u Σ w,            for each slope  E y² = d' + (f + x) λ (D⁻¹ e)ᵀ U' (D⁻¹ e),

y = eᵀ D (Σ w t v) / √λ. So d, d' (by surface) and f + x (by the sensor) follow by regression, in turn, with the weights
of maximum likelihood, (d + (f + x) g)⁻² for a variance d + (f + x) g.

All enter the interval sums. The scatter about the interval's own plane stays as it is. Of the sums M of products of the
columns (q, s q, v), the part of the mean, M_q1 M_1q / Σ w, is divided by d, and the rest by d'. Then the error of the
ping, N(0, x U), is eliminated: with the columns q₃ of (1, α, β),

    M - M q₃ (I + x U N₃₃)⁻¹ x U q₃ᵀ M.

Surfaces that one ping sees are treated as if each had its own error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import pose_design
from pipeline.maths.adjustment.interval_sums import N_MOVED, IntervalSums
from pipeline.maths.adjustment.parameters import ObservedSurface
from pipeline.maths.adjustment.weighting import FEWEST, FLAT, EpochVarianceFactor, epoch_variance_factor

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
CERTAIN = 3.0  # sigmas by which an error must exceed what is expected, to be taken into the model
ROUNDS = 3  # of each estimation in turn
LEAST_WEIGHT = 1e-300  # smallest divisor


@dataclass(frozen=True)
class DesignEffects:
    """Design effects (s,) by surface, of the means and of the slopes of a ping's soundings; 1: independent beams."""

    of_mean: Array
    of_slope: Array


@dataclass(frozen=True)
class PingNoise:
    """Noise that the soundings of a ping share; what is not certainly larger than expected is taken as expected.

    effects: the design effects; epoch: f + x; excess: x.
    """

    effects: DesignEffects
    epoch: EpochVarianceFactor
    excess: float


def ping_noise(
    sums: IntervalSums, surfaces: Sequence[ObservedSurface], white: Array, laser: EpochVarianceFactor
) -> PingNoise:
    """Return the noise that the soundings of a ping share.

    Parameters
    ----------
    sums : IntervalSums
        The sonar's intervals.
    surfaces : sequence of ObservedSurface
        The surfaces, in the order of their numbers in the sums.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    laser : EpochVarianceFactor
        Variance factor f of this noise, from the laser's points.
    """
    count, designs = len(surfaces), pose_design(surfaces, np.arange(len(surfaces)))
    U = _common_covariance(sums, designs, white)
    of_means, of_slopes = _means(sums, U), _slopes(sums, U)
    effects = DesignEffects(np.ones(count), np.ones(count))
    for _ in range(ROUNDS):
        epoch = epoch_variance_factor(with_design_effects(sums, effects), designs, white)
        factor = max(epoch.factor, 0.0)
        effects = DesignEffects(*(of.design_effects(factor, count) for of in (of_means, of_slopes)))
    epoch = epoch_variance_factor(with_design_effects(sums, effects), designs, white)
    excess, sigma = epoch.factor - laser.factor, float(np.hypot(epoch.sigma, laser.sigma))
    return PingNoise(effects, epoch, excess if excess > CERTAIN * sigma else 0.0)


def with_ping_noise(
    sums: IntervalSums, noise: PingNoise, surfaces: Sequence[ObservedSurface], white: Array
) -> IntervalSums:
    """Return the sums of the sonar's intervals with the noise that the soundings of a ping share.

    Parameters
    ----------
    sums : IntervalSums
        The sonar's intervals.
    noise : PingNoise
        The noise.
    surfaces : sequence of ObservedSurface
        The surfaces, in the order of their numbers in the sums.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    """
    sums = with_design_effects(sums, noise.effects)
    if noise.excess <= 0:
        return sums
    U = noise.excess * _common_covariance(sums, pose_design(surfaces, np.arange(len(surfaces))), white)
    of_moved = sums.normal[:, :N_MOVED]
    inverse = np.linalg.solve(np.eye(N_MOVED) + U @ of_moved[:, :, :N_MOVED], U)
    by_moved, swept = np.swapaxes(of_moved, 1, 2) @ inverse, sums.swept[:, :, :N_MOVED]
    right = sums.right[:, :N_MOVED, None]
    return replace(
        sums,
        normal=sums.normal - by_moved @ of_moved,
        swept=sums.swept - swept @ inverse @ of_moved,
        swept_twice=sums.swept_twice - swept @ inverse @ np.swapaxes(swept, 1, 2),
        right=sums.right - (by_moved @ right)[:, :, 0],
        right_swept=sums.right_swept - (swept @ inverse @ right)[:, :, 0],
        squares=sums.squares - (np.swapaxes(right, 1, 2) @ inverse @ right)[:, 0, 0],
    )


def with_design_effects(sums: IntervalSums, effects: DesignEffects) -> IntervalSums:
    """Return the sums with the variances of means and slopes multiplied by the design effects of their surface."""
    d_mean, d_slope = effects.of_mean[sums.surface], effects.of_slope[sums.surface]
    total, weighted, swept = sums.normal[:, 0, 0], sums.normal[:, 0], sums.swept[:, :, 0]
    mean = sums.right[:, 0] / total
    slopes, _, _ = _whitened_slopes(sums)
    fitted = np.sum(slopes**2, axis=1)

    def divided(whole: Array, of_mean: Array) -> Array:
        by = [d.reshape(-1, *[1] * (whole.ndim - 1)) for d in (d_mean, d_slope)]
        return np.asarray(of_mean / by[0] + (whole - of_mean) / by[1])

    return replace(
        sums,
        normal=divided(sums.normal, _outer(weighted, weighted / total[:, None])),
        swept=divided(sums.swept, _outer(swept, weighted / total[:, None])),
        swept_twice=divided(sums.swept_twice, _outer(swept, swept / total[:, None])),
        right=divided(sums.right, weighted * mean[:, None]),
        right_swept=divided(sums.right_swept, swept * mean[:, None]),
        squares=sums.squares - mean**2 * total * (1 - 1 / d_mean) - fitted * (1 - 1 / d_slope),
    )


def _outer(first: Array, second: Array) -> Array:
    return first[:, :, None] * second[:, None, :]


@dataclass(frozen=True)
class _Components:
    """Numbers y (n,) with E y² = d + f g: squared y², common g, number of their surface."""

    squared: Array
    common: Array
    surface: Integers

    def design_effects(self, factor: float, n_surfaces: int) -> Array:
        """Return d by surface (s,), with f + x = ``factor``; 1 where it is not certainly larger."""
        effects = np.ones(n_surfaces)
        for surface in range(n_surfaces):
            rows = self.surface == surface
            common, squared = factor * self.common[rows], self.squared[rows]
            certain = 1 + CERTAIN * np.sqrt(2 / max(float(np.sum((1 + common) ** -2)), LEAST_WEIGHT))
            d = 1.0
            for _ in range(ROUNDS):
                weight = (max(d, 1.0) + common) ** -2
                d = float(weight @ (squared - common)) / max(float(weight.sum()), LEAST_WEIGHT)
            effects[surface] = d if d > certain else 1.0
        return effects


def _means(sums: IntervalSums, common: Array) -> _Components:
    """Return the components of the intervals' means; ``common`` U (g, 3, 3)."""
    total, u = sums.normal[:, 0, 0], sums.normal[:, 0, :N_MOVED]
    return _Components(
        sums.right[:, 0] ** 2 / total, np.einsum("gi,gij,gj->g", u, common, u) / total, sums.surface
    )


def _slopes(sums: IntervalSums, common: Array) -> _Components:
    """Return the components of the slopes of intervals with enough points; ``common`` U (g, 3, 3)."""
    y, back, determined = _whitened_slopes(sums)
    by_pose = np.einsum("gik,gij,gjk->gk", back, common[:, 1:, 1:], back)
    use = determined & (sums.count >= FEWEST)[:, None]
    return _Components(y[use] ** 2, by_pose[use], np.broadcast_to(sums.surface[:, None], use.shape)[use])


def _whitened_slopes(sums: IntervalSums) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return y (g, 2), zero where undetermined; D⁻¹ e √λ (g, 2, 2), a column for each y; which are determined (g, 2).

    The scales are those of Σ w α² and Σ w β², as for the scatter. The eigenvalue of a direction in which the points do
    not spread is below FLAT.
    """
    q = sums.normal[:, :N_MOVED, :N_MOVED]
    beside = q[:, 1:, 0] / q[:, :1, 0]
    C = q[:, 1:, 1:] - _outer(beside, q[:, 0, 1:])
    right = sums.right[:, 1:N_MOVED] - beside * sums.right[:, :1]
    scale = 1 / np.sqrt(np.maximum(np.einsum("gii->gi", q)[:, 1:], 1e-300))
    values, vectors = np.linalg.eigh(C * _outer(scale, scale))
    determined = values > FLAT
    root = np.sqrt(np.where(determined, values, 1.0))
    y = np.einsum("gik,gi->gk", vectors, right * scale) / root
    back = vectors / scale[:, :, None] * root[:, None, :]
    return np.where(determined, y, 0.0), np.where(determined[:, None, :], back, 0.0), determined


def _common_covariance(sums: IntervalSums, designs: Array, white: Array) -> Array:
    """Return c K W Kᵀ (g, 3, 3): the covariance of the coefficients of (1, α, β) by white noise of the records."""
    by_surface = (designs * white**2) @ np.swapaxes(designs, 1, 2)
    share = sums.share
    return np.asarray(((1 - share) ** 2 + share**2)[:, None, None] * by_surface[sums.surface])
