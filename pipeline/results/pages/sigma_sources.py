"""The report's table of the contributions to the total sigmas."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from pipeline.config.session import SessionConfig
from pipeline.maths.mount_parameters import MOUNT_NAMES, PARAMETERS
from pipeline.report.sigma_sources import NOISE, contributions, laser_correlates

Row = Mapping[str, Any]


def sigma_source_rows(tests: pd.DataFrame, block: Row, session: SessionConfig) -> Iterator[Row]:
    """Yield the contribution of each source of errors to the mount parameters' total sigmas; noise comes first.

    Parameters
    ----------
    tests
        The table of single-parameter tests, with the effect of each fixed parameter on the mount.
    block
        The adjustment's block of calibration.json.
    session
        The session's settings.
    """
    correlates = laser_correlates(session.calibrated, session.laser.mount_covariance)
    for words, of_source in contributions(tests, block, correlates).items():
        yield {
            "name": f"{NOISE} (the random sigma)" if words == NOISE else words,
            "cells": [
                f"{np.degrees(of_source[place]):.4f}" if unit == "deg" else f"{1000 * of_source[place]:.2f}"
                for _, place, _, unit in PARAMETERS
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
