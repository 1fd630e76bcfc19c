"""Noise that the soundings of one ping share, beside the INS's: correlated beams, and an error of the whole ping.

Independent soundings determine the mean m = Σ w v / Σ w of an interval and the slopes of v along the surface with the
covariances 1 / Σ w and C⁻¹, C = Σ w t tᵀ, t = (α - ᾱ, β - β̄). The INS's white noise W adds f c K W Kᵀ with the design
K of pose errors and c = (1 - s)² + s² at the place s between two records (see
:func:`pipeline.maths.adjustment.weighting.common_variance`). Two further errors are the sonar's:

* Neighbouring beams are correlated (they share array elements, filters, a bottom detection). The scatter of the points
  about the interval's own line hardly shows it. But the variance of a mean of n beams is larger by the *design effect*
  d (Kish 1965, "Survey sampling", 8.2), which for many beams with the correlation ρ^k of beams k apart is
  (1 + ρ) / (1 - ρ). The slopes have a design effect of their own; on a top that a few beams meet it is much smaller.
* A whole ping is displaced as by a wrong pose (an unsteady clock, beams stabilised by another attitude): the INS's
  factor f becomes f + x.

With ᾱ, β̄ the interval's centroid, U = c K W Kᵀ and a the direction in which the points spread most, the mean and the
slope b along a have the variances

    d / Σ w + (f + x) uᵀ U u,  u = (1, ᾱ, β̄),              d' / Σ w τ² + (f + x) aᵀ U' a,  τ = aᵀ t,

U' being the part of U for (α, β). They are estimated from the *differences* of successive pings on a surface (von
Neumann 1941, "Distribution of the ratio of the mean square successive difference"). A mean itself contains what is
wrong for longer: a face that is not where it should be, a drift. That is no noise, and must not make the tests of it
blind. The first later interval that shares no INS record with an interval is its successor, so the variances add. With
y² the squared difference over the sum of 1 / Σ w, its mean is d + (f + x) g. (Robust weights take a part of both:
:func:`~pipeline.maths.adjustment.robust_weights.robust_effects`.) d and d' (by surface) and f + x (by the
sensor) follow by regression, in turn, with the weights of maximum likelihood, (d + (f + x) g)⁻². Differences that
overlap are correlated, so variances of these estimates are 3/2 of those of as many independent ones.

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

from pipeline.maths.adjustment.interval_sums import N_MOVED, Intervals, IntervalSums
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.ping_differences import (
    CERTAIN,
    LEAST_SPREAD,
    ROUNDS,
    Lines,
    centred,
    outer,
    white_covariance,
)
from pipeline.maths.adjustment.robust_weights import RobustEffects
from pipeline.maths.adjustment.weighting import FLAT, EpochVarianceFactor

Array = NDArray[np.float64]


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
    sums: Intervals,
    surfaces: Sequence[ObservedSurface],
    white: Array,
    laser: EpochVarianceFactor,
    robust: RobustEffects,
) -> PingNoise:
    """Return the noise that the soundings of a ping share.

    Parameters
    ----------
    sums : Intervals
        The sonar's intervals.
    surfaces : sequence of ObservedSurface
        The surfaces, in the order of their numbers in the sums.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    laser : EpochVarianceFactor
        Variance factor f of this noise, from the laser's points.
    robust : RobustEffects
        What robust weights do to means and slopes.
    """
    count, lines = len(surfaces), Lines.of(sums, surfaces, white)
    means, slopes = lines.mean_differences(robust), lines.slope_differences(robust)
    effects, epoch = DesignEffects(np.ones(count), np.ones(count)), laser
    for _ in range(ROUNDS):
        epoch = means.epoch_factor(effects.of_mean, epoch.factor)
        effects = DesignEffects(*(part.design_effects(epoch.factor, count) for part in (means, slopes)))
    epoch = means.epoch_factor(effects.of_mean, epoch.factor)
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
    U = noise.excess * white_covariance(sums, surfaces, white)
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
    fitted = _squares_of_slopes(sums)

    def divided(whole: Array, of_mean: Array) -> Array:
        by = [d.reshape(-1, *[1] * (whole.ndim - 1)) for d in (d_mean, d_slope)]
        return np.asarray(of_mean / by[0] + (whole - of_mean) / by[1])

    return replace(
        sums,
        normal=divided(sums.normal, outer(weighted, weighted / total[:, None])),
        swept=divided(sums.swept, outer(swept, weighted / total[:, None])),
        swept_twice=divided(sums.swept_twice, outer(swept, swept / total[:, None])),
        right=divided(sums.right, weighted * mean[:, None]),
        right_swept=divided(sums.right_swept, swept * mean[:, None]),
        squares=sums.squares - mean**2 * total * (1 - 1 / d_mean) - fitted * (1 - 1 / d_slope),
    )


def _squares_of_slopes(sums: IntervalSums) -> Array:
    """Return the part (g,) of Σ w v² that the slopes take; a direction in which the points do not spread takes none.

    The scales are those of Σ w α² and Σ w β², as for the scatter.
    """
    C, right = centred(sums)
    scale = 1 / np.sqrt(np.maximum(np.einsum("gii->gi", sums.normal)[:, 1:N_MOVED], LEAST_SPREAD))
    values, vectors = np.linalg.eigh(C * outer(scale, scale))
    along = np.einsum("gik,gi->gk", vectors, right * scale)
    determined = values > FLAT
    return np.asarray(np.sum(np.where(determined, along**2 / np.where(determined, values, 1.0), 0.0), axis=1))
