"""Tests whether means of residuals exceed a tolerance, at one level for all means together.

All residuals contain systematic errors: of the target as built, of detection, of angles. With a million points these
errors are significant long before they matter. So a mean is compared with a *tolerance* τ. The hypothesis for a bin is
|μ| ≤ τ, μ being its true mean. With the mean M, its sigma s and ν degrees of freedom

    t = max(0, |M| - τ) / s

exceeds Student's quantile most often where |μ| = τ. There (|M| - τ) / s is Student's t with ν degrees of freedom, and
the probability is half of the two-sided one (both halves where τ = 0). Where |μ| < τ it is less. So t is compared as if
τ were zero.

Bins have different ν. Each t becomes the normal deviate u with the same probability of being exceeded (Wallace 1959,
"Bounds on normal approximations to Student's and the chi-square distributions"; from ν = 8 on to 1 %, and never too
large):

    u = (8 ν + 1) / (8 ν + 3) · root(ν ln(1 + t² / ν))

so that bins can be ranked, and one limit serves all bins. With m bins in all, tested one by one, each must have the
level p with 1 - (1 - p)^m = α (Šidák 1967, "Rectangular confidence regions for the means of multivariate normal
distributions"). Then α is the probability of a false alarm if the bins are independent, and an upper bound if they are
not. They are not, because the same points are sorted by face, by angle, by distance.

The residuals are those of adjusted surfaces and mounts, and so drawn towards zero. This also lowers the probability.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def normal_deviates(mean: Array, sigma: Array, dof: Array, tolerated: Array | float) -> Array:
    """Return the normal deviates u (n,) of the means' excess over the tolerance, with the means' signs; zero within.

    Parameters
    ----------
    mean, sigma : (n,) arrays
        Means and their standard deviations, in one unit.
    dof : (n,) array
        Degrees of freedom ν of the standard deviations.
    tolerated : (n,) array or float
        Tolerance τ, in the same unit.
    """
    t = np.maximum(0.0, np.abs(mean) - tolerated) / sigma
    u = (8 * dof + 1) / (8 * dof + 3) * np.sqrt(dof * np.log1p(t**2 / np.maximum(dof, np.finfo(float).tiny)))
    return np.asarray(np.copysign(u, mean))


def joint_limit(number: int, level: float) -> float:
    """Return the limit of |u| for ``number`` means.

    If no true mean exceeds its tolerance, at least one |u| exceeds the limit with a probability of at most ``level``.

    >>> round(joint_limit(1, 0.05), 2), round(joint_limit(500, 0.001), 2)
    (1.96, 4.75)
    """
    from scipy.special import ndtri

    each = -np.expm1(np.log1p(-level) / max(number, 1))
    return float(-ndtri(each / 2))
