"""Block ``systematic`` of calibration.json: what the errors of the fixed parameters do to the mount.

With it two sessions can be compared from their calibration.json alone: which errors they share, and which not.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.error_sources import OWNERS, Owner, source_of
from pipeline.config.mount import Covariance
from pipeline.maths.mount_parameters import MOUNT_NAMES


def systematic_block(
    freed: pd.DataFrame, laser_covariance: Covariance | None, stated: Mapping[Owner, Any]
) -> dict[str, Any]:
    """Return the block: by what the errors belong to, their effects, correlation and a digest of what is stated.

    ``effects`` has for each fixed parameter the change (6,) of the mount, rad and m, by an error of one a-priori sigma:
    S σ. ``correlation`` is that of these errors, in the same order; None: they are independent. With E (6, n) of the
    effects and the correlation R, E R Eᵀ is their part of the total covariance. ``stated`` is the same in two sessions
    that share the errors; None: they are never shared.

    Parameters
    ----------
    freed
        The table of single-parameter tests, with the effects.
    laser_covariance
        The covariance of the laser's mount, if the session states one.
    stated
        Settings that must be the same in two sessions that share the errors.
    """
    blocks: dict[str, Any] = {owner: {"stated": _digest(stated[owner]), "effects": {}} for owner in OWNERS}
    for row in freed[~freed["estimated"]].to_dict("records"):
        effects = blocks[source_of(row["unknown"]).owner]["effects"]
        effects[row["unknown"]] = [float(row[f"effect_{name}"]) for name in MOUNT_NAMES]
    for owner, block in blocks.items():
        block["correlation"] = _correlation(laser_covariance) if owner == "laser_mount" else None
    return blocks


def _digest(stated: Any) -> str | None:
    return None if stated is None else hashlib.sha256(json.dumps(stated, sort_keys=True).encode()).hexdigest()


def _correlation(covariance: Covariance | None) -> list[list[float]] | None:
    """Return the correlations of a covariance; 0 where a sigma is 0."""
    if covariance is None:
        return None
    matrix = np.array(covariance)
    sigma = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    product = np.outer(sigma, sigma)
    correlation = np.divide(matrix, product, out=np.zeros_like(matrix), where=product > 0)
    np.fill_diagonal(correlation, 1.0)
    return [[float(value) for value in row] for row in correlation]
