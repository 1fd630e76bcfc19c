"""What each source of errors contributes to the total sigmas of the mount parameters."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.error_sources import ERROR_SOURCES, OWNERS, source_of
from pipeline.maths.mount_parameters import MOUNT_NAMES

NOISE = "noise"  # the random sigma


def laser_correlates(calibrated: str, laser_covariance: object | None) -> bool:
    """Return whether errors of the laser's mount correlate: the sonar is calibrated, and the mount has a covariance."""
    return calibrated == "mbes" and laser_covariance is not None


def contributions(
    freed: pd.DataFrame, estimate: pd.DataFrame, correlated: bool
) -> dict[str, NDArray[np.float64]]:
    """Return the contribution (6,) of each source to the total sigmas, rad and m, by its words; noise comes first.

    A contribution is the root of the sum of squares of the effects of the source's parameters. For an angle, it is the
    contribution to the rotation about the body's axis. The squares of all contributions add up to the square of the
    total sigma. If the laser's mount has a covariance, its parameters correlate. They are then one source, and its
    square is the square of the total sigma minus the squares of all other contributions.

    Parameters
    ----------
    freed
        The table of single-parameter tests, with the effect of each parameter's error on the mount.
    estimate
        The table of estimates, with random and total sigmas.
    correlated
        Whether the errors of the laser's mount correlate (:func:`laser_correlates`).
    """
    by_name = estimate.set_index("unknown").reindex(MOUNT_NAMES)
    noise, total = (by_name[name].to_numpy(np.float64) for name in ("sigma", "sigma_total"))
    effects = freed[[f"effect_{name}" for name in MOUNT_NAMES]].to_numpy(np.float64)
    source = freed["unknown"].map(lambda name: source_of(name).words)
    present = [one.words for one in ERROR_SOURCES if (source == one.words).any()]
    squares = {words: np.sum(effects[(source == words).to_numpy()] ** 2, axis=0) for words in present}
    if correlated:
        of_mount = {one.words for one in ERROR_SOURCES if one.owner == "laser_mount"}
        others = {words: square for words, square in squares.items() if words not in of_mount}
        left = total**2 - noise**2 - np.sum(list(others.values()), axis=0)
        squares = {OWNERS["laser_mount"]: np.maximum(left, 0.0), **others}
    return {NOISE: noise} | {words: np.sqrt(square) for words, square in squares.items()}
