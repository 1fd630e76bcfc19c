"""Names, colours and markers of the families of faces in the pictures."""

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
import pandas as pd

from pipeline.maths.target.bottom_names import PIECES, shown_name

T = TypeVar("T")


def shown_names(families: Sequence[str]) -> list[str]:
    """Return the names of families in the pictures, each once, in order."""
    return list(dict.fromkeys(map(shown_name, families)))


def together(means: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """Return means of residuals by family with those of the pieces of the bottom made one, weighted by their counts.

    Parameters
    ----------
    means
        Rows with family, count, mean_m, rms_m and, if known, sigma_mean_m.
    keys
        The other columns that tell one mean from another.
    """
    pieces = means["family"].map(shown_name) != means["family"]
    rows = means[pieces & np.isfinite(means["mean_m"])]
    if not len(rows):
        return means[~pieces]
    count = rows["count"].astype(np.float64)
    sums = rows[list(keys)].assign(family=PIECES, count=rows["count"], mean_m=count * rows["mean_m"])
    sums["rms_m"] = count * rows["rms_m"] ** 2
    if "sigma_mean_m" in rows:
        sums["sigma_mean_m"] = (count * rows["sigma_mean_m"]) ** 2
    whole: pd.DataFrame = sums.groupby(["family", *keys], as_index=False, sort=True).sum()
    whole["mean_m"] /= whole["count"]
    whole["rms_m"] = np.sqrt(whole["rms_m"] / whole["count"])
    if "sigma_mean_m" in rows:
        whole["sigma_mean_m"] = np.sqrt(whole["sigma_mean_m"]) / whole["count"]
    every: pd.DataFrame = pd.concat([means[~pieces], whole], ignore_index=True)
    return every


def styles_of_families(names: Sequence[str], standard: Mapping[str, T], turn: int = 0) -> dict[str, T]:
    """Return a colour or marker for each family.

    A family in ``standard`` (P1, P2, P3, H) gets its standard style. The other families get the unused styles in turn,
    each time ``turn`` further on: with markers that turn, no two families look alike when the colours are used up.
    """
    unused = [style for name, style in standard.items() if name not in names] or list(standard.values())
    others = [name for name in names if name not in standard]
    spare = {name: unused[(k + turn * (k // len(unused))) % len(unused)] for k, name in enumerate(others)}
    return {name: standard[name] if name in standard else spare[name] for name in names}
