"""The report's table of systematic errors: what the points say of each, and from which size on it is found."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.error_sources import source_of
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.report.cause_words import unit_of, words_of
from pipeline.report.suspected_causes import significance_limit

SURE = 1.645  # standard normal quantile of 95 %
SINGLE_FACE = "face_"  # beginning of the names of parameters that the table leaves to the residuals by face
OF_DESIGN = "surfaces_"  # beginning of the names of errors that have no test


def parameter_test_rows(freed: pd.DataFrame, level: float) -> Iterator[Mapping[str, Any]]:
    """Yield a row for each tested parameter: its estimate in words, its a-priori sigma, its test, and what is found.

    An error Δ moves the estimate by Δ; noise and the a-priori errors of all other parameters scatter it, with the
    variance expected² - considered². It is found if the estimate exceeds limit · expected. So an error is found with a
    probability of 95 % from this size on:

        Δ = limit · expected + 1.645 √(expected² - considered²)

    Parameters
    ----------
    freed
        The table of single-parameter tests.
    level
        Level of all tests together.
    """
    limit = significance_limit(freed, level)
    for row in freed.to_dict("records"):
        name, expected, considered = str(row["unknown"]), row["expected"], row["considered"]
        if not np.isfinite(expected) or name in MOUNT_NAMES or name.startswith(SINGLE_FACE) or row["estimated"]:
            continue
        found_from = limit * expected + SURE * np.sqrt(max(expected**2 - considered**2, 0.0))
        yield {
            "words": words_of(row).partition("; ")[0],  # without the advice
            "considered": _shown(name, considered),
            "normalised": abs(row["value"]) / expected,
            "found_from": _shown(name, found_from),
            "beyond": abs(row["value"]) > limit * expected,
        }


def untold_parameters(freed: pd.DataFrame) -> list[str]:
    """Return in words the parameters that move the mount, and of which the points tell nothing, each wording once."""
    words = []
    for row in freed[~np.isfinite(freed["expected"]) & ~freed["estimated"]].to_dict("records"):
        name = str(row["unknown"])
        moves = any(row[f"effect_{one}"] for one in MOUNT_NAMES)
        if moves and name not in MOUNT_NAMES and not name.startswith((SINGLE_FACE, OF_DESIGN)):
            axis = f", {name[-1]}" if name[-2:] in ("_x", "_y", "_z") else ""
            words.append(f"{source_of(name).words}{axis} (± {_shown(name, row['considered'])})")
    return list(dict.fromkeys(words))


def _shown(name: str, value: float) -> str:
    scale, unit = unit_of(name)
    return f"{float(f'{scale * value:.2g}'):g} {unit}"
