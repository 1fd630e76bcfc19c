"""Tables of the report about the mount parameters: their values, how the methods differ, and their correlations."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import limits_by_setting
from pipeline.maths.adjustment.solution import CORRELATION_LIMIT
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.part_checks import part_and_head

Row = Mapping[str, Any]
STRONG = CORRELATION_LIMIT  # correlations of this size and above are in bold
STRONG_SIGMAS = 3.0  # changes beyond this many sigmas are in bold
POSITIVE = {
    "roll": "starboard down", "pitch": "bow up", "yaw": "to port",
    "x": "to starboard", "y": "forward", "z": "up",
}
METHODS = {
    "coarse": "coarse mount",
    "patent_literal": "(0) patent, word for word",
    "patent_sequential": "(1) patent, angles, then offsets",
    "patent_alternating": "(2) patent, in turn",
    "adjustment": "(3) adjustment",
}


@dataclass(frozen=True)
class Quantity:
    """A number with its unit, ``deg`` or ``m``, for display; NaN is shown as a dash."""

    number: float
    unit: str

    def __str__(self) -> str:
        return self.text()

    @property
    def known(self) -> bool:
        """Whether the number is finite."""
        return bool(np.isfinite(self.number))

    def text(self, sign: str = "") -> str:
        """Return the number with four decimals; ``sign`` is ``+`` to show the sign of a positive number too."""
        if not np.isfinite(self.number):
            return "–"
        return f"{round(self.number, 4) + 0.0:{sign}.4f} {'°' if self.unit == 'deg' else self.unit}"

    def entered(self) -> str:
        """Return the number with the digits in which it is entered elsewhere: 0.001°, or in metres 0.1 mm."""
        return f"{round(self.number, 3) + 0.0:.3f} °" if self.known and self.unit == "deg" else self.text()

    def small(self, sign: str = "") -> str:
        """Return a change or a sigma: to 0.001°, or in millimetres with one decimal; ``sign`` as in :meth:`text`."""
        if not self.known:
            return "–"
        number, unit, digits = (self.number, "°", 3) if self.unit == "deg" else (1000 * self.number, "mm", 1)
        return f"{round(number, digits) + 0.0:{sign}.{digits}f} {unit}"


def part_rows(parts: Sequence[Row]) -> list[Row]:
    """Return one row for each part of the session: the change of each mount parameter with its sigma, and the test.

    Parameters
    ----------
    parts
        The block ``parts`` of calibration.json.
    """
    rows: list[Row] = []
    for part in parts:
        cells = []
        for _, _, key, unit in PARAMETERS:
            change, sigma = (np.nan if part[kind][key] is None else part[kind][key] for kind in ("change", "sigma"))
            cells.append(
                {
                    "change": Quantity(change, unit),
                    "sigma": Quantity(sigma, unit),
                    "strong": abs(change) > STRONG_SIGMAS * sigma,
                }
            )
        name, head = part_and_head(part["part"])
        rows.append({"part": name, "head": head, "cells": cells, "test": part["test"]})
    return rows


def parameter_rows(
    table: pd.DataFrame, method: str, limits: VerdictLimits, held: Collection[str]
) -> list[dict[str, Any]]:
    """Return one row for each mount parameter: values, sigmas, limit of the sigma, and 95 % interval.

    Parameters
    ----------
    table
        The artefact ``calibration``.
    method
        The method of the result.
    limits
        The verdict's limits of the sigmas.
    held
        Names of the parameters that are not good enough.
    """
    rows = table[table["method"] == method].to_dict("records")
    largest = limits_by_setting(limits)
    keys = {name: key for name, _, key, _ in PARAMETERS}
    values = ("coarse", "total", "change", "correction", "sigma_random", "sigma_total", "low_95", "high_95")
    return [
        {"name": row["parameter"], "words": f"{row['parameter']} ({POSITIVE[row['parameter']]})"}
        | {"limit": Quantity(largest[keys[row["parameter"]]], row["unit"])}
        | {"sigma_in": "°" if row["unit"] == "deg" else "mm", "held": row["parameter"] in held}
        | {key: Quantity(row[key], row["unit"]) for key in values}
        for row in rows
    ]


def method_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield for each mount parameter the total of every method, and its difference from the adjustment's total."""
    for name, _, _, unit in PARAMETERS:
        rows = table[table["parameter"] == name].set_index("method")
        totals = {method: float(rows["total"][method]) for method in METHODS if method in rows.index}
        differences = {method: value - totals["adjustment"] for method, value in totals.items()}
        if unit == "deg":
            differences = {method: value - 360.0 * np.round(value / 360.0) for method, value in differences.items()}
        yield {
            "name": name,
            "totals": {method: Quantity(value, unit) for method, value in totals.items()},
            "differences": {method: Quantity(value, unit) for method, value in differences.items()},
        }


def correlation_rows(result: Row) -> list[dict[str, Any]] | None:
    """Return the mount parameters' correlations in the order roll, pitch, yaw, x, y, z; None without a solution."""
    matrix = result["geometry"]["correlation"]
    if matrix is None:
        return None
    places = [place for _, place, *_ in PARAMETERS]

    def cell(row: int, column: int) -> Row:
        value = matrix[row][column]
        return {"value": value, "strong": row != column and abs(value) >= STRONG}

    return [{"name": name, "cells": [cell(row, column) for column in places]} for name, row, *_ in PARAMETERS]
