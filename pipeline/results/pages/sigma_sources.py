"""The report's table of the contributions to the total sigmas."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.error_sources import ERROR_SOURCES, OWNERS, source_of
from pipeline.config.session import SessionConfig
from pipeline.maths.mount_parameters import MOUNT_NAMES, PARAMETERS

Row = Mapping[str, Any]


def sigma_source_rows(tests: pd.DataFrame, estimate: pd.DataFrame, session: SessionConfig) -> Iterator[Row]:
    """Yield the contribution of each source of errors to the mount parameters' total sigmas; noise comes first.

    A contribution is the root of the sum of squares of the effects of the source's parameters. For an angle, it is the
    contribution to the rotation about the body's axis. The squares of all contributions add up to the square of the
    total sigma. If the laser's mount has a covariance, its parameters correlate. They are then one source, and its
    square is the square of the total sigma minus the squares of all other contributions.

    Parameters
    ----------
    tests
        The table of single-parameter tests, with the effect of each fixed parameter on the mount.
    estimate
        The table of estimates, with random and total sigmas.
    session
        The session's settings.
    """
    by_name = estimate.set_index("unknown").reindex(MOUNT_NAMES)
    noise, total = (by_name[name].to_numpy(np.float64) for name in ("sigma", "sigma_total"))
    effects = tests[[f"effect_{name}" for name in MOUNT_NAMES]].to_numpy(np.float64)
    source = tests["unknown"].map(lambda name: source_of(name).words)
    present = [one.words for one in ERROR_SOURCES if (source == one.words).any()]
    squares = {words: np.sum(effects[(source == words).to_numpy()] ** 2, axis=0) for words in present}
    if session.calibrated == "mbes" and session.laser.mount_covariance is not None:
        of_mount = {one.words for one in ERROR_SOURCES if one.owner == "laser_mount"}
        others = {words: square for words, square in squares.items() if words not in of_mount}
        left = total**2 - noise**2 - np.sum(list(others.values()), axis=0)
        squares = {OWNERS["laser_mount"]: np.maximum(left, 0.0), **others}
    for words, of_source in {"noise (the random sigma)": noise**2, **squares}.items():
        yield {
            "name": words,
            "cells": [
                f"{np.degrees(sigma):.4f}" if unit == "deg" else f"{1000 * sigma:.2f}"
                for sigma, unit in ((np.sqrt(of_source[place]), unit) for _, place, _, unit in PARAMETERS)
            ],
        }


def slot_checks(estimate: pd.DataFrame) -> list[str]:
    """Return for each mount parameter the random sigma by the scatter of slots of time, over the sigma, in words."""
    rows = estimate.set_index("unknown")
    checked = [(name, rows.loc[MOUNT_NAMES[place]]) for name, place, *_ in PARAMETERS]
    return [
        f"{name} {np.sqrt(row['slots_ratio']):.2f} ± {np.sqrt(row['slots_ratio'] / (2 * row['slots_dof'])):.2f}"
        for name, row in checked
        if row["slots_dof"] > 0
    ]
