"""What each source of errors contributes to the total sigmas of the mount parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.error_sources import ERROR_SOURCES, OWNERS, source_of
from pipeline.config.mount import Mount
from pipeline.maths.geometry.rotations import mount_partials
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.mount import mount_of

Array = NDArray[np.float64]

NOISE = "noise"  # the random sigma


def laser_correlates(calibrated: str, laser_covariance: object | None) -> bool:
    """Return whether errors of the laser's mount correlate: the sonar is calibrated, and the mount has a covariance."""
    return calibrated == "mbes" and laser_covariance is not None


def contributions(freed: pd.DataFrame, block: Mapping[str, Any], correlated: bool) -> dict[str, Array]:
    """Return the contribution (6,) of each source to the total sigmas, rad and m, by its words; noise comes first.

    They are those of the settings pitch, roll, yaw, x, y, z. An error that turns the mount by ε about the body's axes
    changes the angles by J ε (:func:`~pipeline.maths.geometry.rotations.mount_partials`). A contribution is the root of
    the sum of squares of the effects of the source's parameters. The squares of all contributions add up to the square
    of the total sigma. If the laser's mount has a covariance, its parameters correlate. They are then one source, and
    its square is the square of the total sigma minus the squares of all other contributions.

    Parameters
    ----------
    freed
        The table of single-parameter tests, with the effect of each parameter's error on the mount.
    block
        The adjustment's block of calibration.json. Without a covariance there are no contributions.
    correlated
        Whether the errors of the laser's mount correlate (:func:`laser_correlates`).
    """
    from scipy.linalg import block_diag

    if block["covariance_total"] is None:
        return {}
    turned = mount_partials(mount_of(Mount(**block["mount"])).R_body_from_sensor)
    to_settings = block_diag(turned, np.eye(3))
    noise, total = (
        np.diag(to_settings @ np.array(block[name]) @ to_settings.T) for name in ("covariance", "covariance_total")
    )
    effects = freed[[f"effect_{name}" for name in MOUNT_NAMES]].to_numpy(np.float64) @ to_settings.T
    source = freed["unknown"].map(lambda name: source_of(name).words)
    present = [one.words for one in ERROR_SOURCES if (source == one.words).any()]
    squares = {words: np.sum(effects[(source == words).to_numpy()] ** 2, axis=0) for words in present}
    if correlated:
        of_mount = {one.words for one in ERROR_SOURCES if one.owner == "laser_mount"}
        others = {words: square for words, square in squares.items() if words not in of_mount}
        left = total - noise - np.sum(list(others.values()), axis=0)
        squares = {OWNERS["laser_mount"]: np.maximum(left, 0.0), **others}
    return {words: np.sqrt(square) for words, square in ({NOISE: noise} | squares).items()}
