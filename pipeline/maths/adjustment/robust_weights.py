"""Robust weights by the function IGG III, what they leave of the variance of good observations, and robust scales."""

from dataclasses import dataclass

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


def variance_kept(k0: float, k1: float) -> float:
    """Return E[w z² | w > 0], the part of the variance of a standard normal z that the weights of IGG III leave.

    With the normal density φ, its integral Φ and Mⱼ = ∫ zʲ φ dz from k0 to k1,

        E[w z²] = 2 (Φ(k0) - 1/2 - k0 φ(k0)) + 2 k0 / (k1 - k0)² · (k1² M₁ - 2 k1 M₂ + M₃),
        M₁ = φ(k0) - φ(k1),  M₂ = k0 φ(k0) - k1 φ(k1) + Φ(k1) - Φ(k0),  M₃ = k0² φ(k0) - k1² φ(k1) + 2 M₁,

    divided by 2 Φ(k1) - 1, the share of observations with a weight.

    Examples
    --------
    >>> round(variance_kept(3.0, 6.0), 4), round(variance_kept(30.0, 60.0), 4)
    (0.9924, 1.0)
    """
    from scipy.special import ndtr

    low, high = (np.exp(-k * k / 2) / np.sqrt(2 * np.pi) for k in (k0, k1))
    first, between = low - high, float(ndtr(k1) - ndtr(k0))
    second = k0 * low - k1 * high + between
    third = k0**2 * low - k1**2 * high + 2 * first
    reduced = 2 * k0 / (k1 - k0) ** 2 * (k1**2 * first - 2 * k1 * second + third)
    return float((2 * (ndtr(k0) - 0.5 - k0 * low) + reduced) / (2 * ndtr(k1) - 1))


@dataclass(frozen=True)
class RobustMeans:
    """What robust weights do to means Σ w v / Σ w, compared with weights that are not reduced (1 and 1).

    shift: the mean shows this part κ of a small error that all its observations share; variance: that of its
    observations' own noise is this part ν of 1 / Σ w.
    """

    shift: float = 1.0
    variance: float = 1.0


NOT_REDUCED = RobustMeans()


def robust_means(k0: float, k1: float) -> RobustMeans:
    """Return what the weights of IGG III do to means of normal observations.

    The weights follow the observations z + e, z standard normal, with their common error e. With ψ(z) = z w(z), the
    mean of n of them is

        Σ w (z + e) / Σ w → E ψ(z + e) / E w(z + e) = e E ψ'(z) / E w(z) + O(e³),    E ψ'(z) = E z ψ(z) = E[w z²]

    (by parts, φ' = -z φ), and the variance of its noise is n E ψ² / (n E w)² = E[w² z²] / (E w Σ w). So

        κ = E[w z²] / E w,      ν = E[w² z²] / E w,

    integrals that are sums over fine steps here.

    Examples
    --------
    >>> of = robust_means(3.0, 6.0)
    >>> round(of.shift, 4), round(of.variance, 4)
    (0.993, 0.9885)
    """
    z = np.linspace(0.0, min(k1, NORMAL_END), NODES)
    w = igg3_weights(z, k0, k1)
    of_w, of_shift, of_square = (float(np.trapezoid(part * np.exp(-z * z / 2))) for part in (w, w * z**2, (w * z) ** 2))
    return RobustMeans(of_shift / of_w, of_square / of_w)


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
