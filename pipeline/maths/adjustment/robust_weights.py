"""Robust weights by the function IGG III, what they leave of the variance of good observations, and robust scales."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = np.linspace(0.0, 50.0, 2001)  # |residual| / sigma; larger ones count into the last bin
NORMAL_MEDIAN = 0.6744897501960817  # median of |standard normal|
NORMAL_END, NODES = 12.0, 12_001  # of integrals over the normal density: where it ends, and how finely they go
LEAST_SCALE = 0.01  # no sensor's noise is a hundred times smaller than its stated sigma: less is rounding


def igg3_weights(normalised: Array, k0: float, k1: float) -> Array:
    """Return the weights (n,) of IGG III (Yang 1999).

    They are 1 up to k0, k0 / |v| · ((k1 - |v|) / (k1 - k0))² up to k1, and 0 above.

    Parameters
    ----------
    normalised : (n,) array
        Residuals in units of their sigma.
    k0, k1 : float
        Largest residual with full weight, and with any weight.

    Examples
    --------
    >>> igg3_weights(np.array([0.0, 2.0, 7.0]), 3.0, 6.0)
    array([1., 1., 0.])
    """
    size = np.abs(normalised)
    middle = k0 / np.maximum(size, k0) * ((k1 - np.minimum(size, k1)) / (k1 - k0)) ** 2
    return np.where(size <= k0, 1.0, middle)


@dataclass(frozen=True)
class RobustEffects:
    """What robust weights do to good observations, compared with weights that are not reduced (1, 1 and 1).

    kept: part of the variance that observations with a weight still show. Of means Σ w v / Σ w: shift: the mean shows
    this part κ of a small error that all its observations share; variance: that of its observations' own noise is this
    part ν of 1 / Σ w.
    """

    kept: float = 1.0
    shift: float = 1.0
    variance: float = 1.0


NOT_REDUCED = RobustEffects()


@cache
def robust_effects(k0: float, k1: float) -> RobustEffects:
    """Return what the weights of IGG III do to normal observations.

    Of standard normal z they keep E[w z² | w > 0] = E[w z²] / P(|z| < k1). Of a mean of n observations z + e with the
    common error e, the weights follow z + e. With ψ(z) = z w(z),

        Σ w (z + e) / Σ w → E ψ(z + e) / E w(z + e) = e E ψ'(z) / E w(z) + O(e³),    E ψ'(z) = E z ψ(z) = E[w z²]

    (by parts, φ' = -z φ), and the variance of its noise is n E ψ² / (n E w)² = E[w² z²] / (E w Σ w). So

        κ = E[w z²] / E w,      ν = E[w² z²] / E w,

    integrals that are sums over fine steps here.

    Examples
    --------
    >>> of = robust_effects(3.0, 6.0)
    >>> round(of.kept, 4), round(of.shift, 4), round(of.variance, 4)
    (0.9924, 0.993, 0.9885)
    >>> round(robust_effects(30.0, 60.0).kept, 4)
    1.0
    """
    z = np.linspace(0.0, min(k1, NORMAL_END), NODES)
    w, density = igg3_weights(z, k0, k1), np.exp(-z * z / 2)
    parts = (np.ones_like(w), w, w * z**2, (w * z) ** 2)
    of_any, of_w, of_shift, of_square = (float(np.trapezoid(part * density)) for part in parts)
    return RobustEffects(of_shift / of_any, of_shift / of_w, of_square / of_w)


def histogram(normalised: Array) -> Array:
    """Return the counts of |v| in :data:`BINS`; counts of several batches add up, and their median gives the scale."""
    last = len(BINS) - 2
    width = BINS[-1] / (last + 1)
    return np.bincount(np.minimum(np.abs(normalised) / width, last).astype(np.int64), minlength=last + 1).astype(float)


def robust_scale(counts: Array) -> float:
    """Return the median of |v|, from the histogram, divided by NORMAL_MEDIAN; 1 without data.

    >>> round(robust_scale(histogram(np.random.default_rng(0).normal(scale=2.0, size=100_000))), 1)
    2.0
    """
    total = counts.sum()
    if total == 0:
        return 1.0
    cumulative = np.concatenate([[0.0], np.cumsum(counts)])
    return float(max(np.interp(total / 2, cumulative, BINS) / NORMAL_MEDIAN, LEAST_SCALE))
