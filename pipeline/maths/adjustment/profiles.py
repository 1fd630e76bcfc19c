"""Profiles of mean residuals over height: a line that a part of the heights cannot move, and the scatter about it.

The line is that of Siegel 1982, "Robust regression using repeated medians", Biometrika 69, p. 242: its slope is the
median over the heights of each one's median slope to all others, its place the median of what remains. Up to half of
the heights may be wrong without moving it far. (Theil's, the median of the slopes of all pairs, bears 29 %: a footing
of a third of a wall's heights was taken for a bow of the wall.) The scatter is the median absolute deviation times
1.4826, the standard deviation of normal errors.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.residual_means import BinMean, ResidualSums, bin_means, merged_residual_sums

Array = NDArray[np.float64]
Profiles = Mapping[int, Sequence[BinMean]]  # by number of the face
FEWEST_BINS = 8  # heights of a face whose profile is judged
PATCHES = 3.0  # of the RMS of a rough wall's patches, or of its heights: a mean residual may be so much larger
NORMAL = 1.4826


def profiles_of(pieces: Iterable[ResidualSums]) -> Profiles:
    """Return by face the mean residuals by height, from the lowest on, from sums by face and height."""
    profiles: dict[int, list[BinMean]] = {}
    for mean in bin_means(merged_residual_sums(pieces)):
        profiles.setdefault(mean.key[0], []).append(mean)
    return profiles


def off_line(place: Array, value: Array) -> Array:
    """Return the values (n,) at places (n,), n > 1 and no two alike, less the robust line through them."""
    apart = place - place[:, None]
    np.fill_diagonal(apart, np.nan)
    slope = np.median(np.nanmedian((value - value[:, None]) / apart, axis=1))
    return np.asarray(value - slope * place - np.median(value - slope * place))


def roughness_allowance(patch_m: float, off_m: Array) -> float:
    """Return what a height of a rough wall may be off its line by, beyond the tolerance of a smooth one, m.

    Parameters
    ----------
    patch_m : float
        RMS of the wall's patches (:mod:`~pipeline.maths.adjustment.roughness`).
    off_m : (n,) array
        What its heights are off their line by.
    """
    return PATCHES * max(patch_m, NORMAL * float(np.median(np.abs(off_m))))


def profile_of(means: Sequence[BinMean]) -> tuple[Array, Array, Array]:
    """Return numbers (n,) of the heights, means (n,) m and their sigmas (n,) m."""
    number = np.array([mean.key[1] for mean in means], dtype=np.float64)
    value, sigma = (np.array([getattr(mean, name) for mean in means]) for name in ("mean_m", "sigma_mean_m"))
    return number, value, sigma
