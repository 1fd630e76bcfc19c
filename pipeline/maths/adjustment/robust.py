"""Robust weights and scales."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = np.linspace(0.0, 50.0, 2001)  # |residual| / sigma; larger ones count into the last bin
NORMAL_MEDIAN = 0.6744897501960817  # median of |standard normal|
LEAST_SCALE = 0.01  # no sensor's noise is a hundred times smaller than its stated sigma: less is rounding


def igg3_weights(normalised: Array, k0: float, k1: float) -> Array:
    """Return the weights (n,) of IGG III (Yang 1999).

    They are 1 up to k0, k0 / |v| · ((k1 - |v|) / (k1 - k0))² up to k1, and 0 above.

    Parameters
    ----------
    normalised : (n,) array
        Residuals in units of their sigma.
    k0, k1 : float
        Bounds of full weight and of any weight.

    Examples
    --------
    >>> igg3_weights(np.array([0.0, 2.0, 7.0]), 3.0, 6.0)
    array([1., 1., 0.])
    """
    size = np.abs(normalised)
    middle = k0 / np.maximum(size, k0) * ((k1 - np.minimum(size, k1)) / (k1 - k0)) ** 2
    return np.where(size <= k0, 1.0, middle)


def histogram(normalised: Array) -> Array:
    """Return the counts of |v| in :data:`BINS`; they add up over chunks, and their median gives the scale."""
    last = len(BINS) - 2
    width = BINS[-1] / (last + 1)
    return np.bincount(np.minimum(np.abs(normalised) / width, last).astype(np.int64), minlength=last + 1).astype(float)


def robust_scale(counts: Array) -> float:
    """Return the median of |v|, from the histogram, divided by that of the standard normal; 1 without data.

    >>> round(robust_scale(histogram(np.random.default_rng(0).normal(scale=2.0, size=100_000))), 1)
    2.0
    """
    total = counts.sum()
    if total == 0:
        return 1.0
    cumulative = np.concatenate([[0.0], np.cumsum(counts)])
    return float(max(np.interp(total / 2, cumulative, BINS) / NORMAL_MEDIAN, LEAST_SCALE))
