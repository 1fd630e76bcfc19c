"""The report's table of the contributions to the total sigmas."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.maths.mount_parameters import MOUNT_NAMES, PARAMETERS
from pipeline.report.sigma_sources import NOISE

Row = Mapping[str, Any]


def sigma_source_rows(sources: Mapping[str, NDArray[np.float64]]) -> Iterator[Row]:
    """Yield the contribution of each source of errors to the mount parameters' total sigmas.

    ``sources``: as of :func:`~pipeline.report.sigma_sources.contributions`.
    """
    for words, of_source in sources.items():
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
