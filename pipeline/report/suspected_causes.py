"""Suspected causes (fixed parameters that the residuals contradict), and the parameters that adjust.free names.

Table ``freed`` has the single-parameter test of each fixed parameter. The residuals contradict a parameter if its
estimate is farther from zero than noise and all a-priori errors explain: its own, and those of others that look alike.
One error often moves the estimates of several parameters. The report names the cause that explains most, with the
largest value over sigma. Where one parameter is contradicted, this may be another that is not: a parameter with a large
a-priori sigma, which explains the residuals without being off its setting.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.report.cause_words import words_of

SIGNIFICANT = 4.0  # sigmas: by chance one of 16 000 parameters, so one of 400 sessions with forty parameters each
UNITS = {"sound_speed": "1"} | dict.fromkeys(("mbes_latency", "laser_latency"), "s")
UNITS |= dict.fromkeys(("mbes_incidence", "mbes_level_range", "laser_incidence"), "m")


@dataclass(frozen=True)
class SuspectedCause:
    """A fixed parameter that would explain the residuals: its words, and its value over the sigma from noise."""

    words: str
    normalised: float


@dataclass(frozen=True)
class EstimatedParameter:
    """A parameter that ``adjust.free`` names.

    Attributes
    ----------
    unknown : name of the parameter
    value, sigma_total : estimate and total sigma in ``unit``
    words : the estimate, and the setting or device to check
    is_significant : whether the value is farther from zero than its total sigma and its a-priori sigma explain
    """

    unknown: str
    value: float
    sigma_total: float
    unit: str
    words: str
    is_significant: bool


def suspected_causes(freed: pd.DataFrame) -> list[SuspectedCause]:
    """Return the suspected causes from table ``freed``, the one with the largest value over sigma first.

    There are none unless the residuals contradict at least one fixed parameter. A coarse mount that is an observation
    is judged by itself (:mod:`~pipeline.report.coarse_mount`).
    """
    fixed = freed[~freed["estimated"] & ~freed["unknown"].isin(MOUNT_NAMES)].to_dict("records")
    if not any(is_significant(row) for row in fixed):
        return []
    causes = [
        SuspectedCause(words_of(row), abs(row["value"]) / row["sigma"])
        for row in fixed
        if abs(row["value"]) > SIGNIFICANT * row["sigma"]
    ]
    return sorted(causes, key=lambda cause: -cause.normalised)


def estimated_parameters(freed: pd.DataFrame) -> list[EstimatedParameter]:
    """Return the parameters of ``adjust.free`` with their estimates (table ``freed``); empty without a result."""
    return [
        EstimatedParameter(
            unknown=row["unknown"],
            value=row["value"],
            sigma_total=row["sigma"],
            unit=UNITS[row["unknown"]],
            words=words_of(row),
            is_significant=is_significant(row),
        )
        for row in freed[freed["estimated"] & np.isfinite(freed["sigma"])].to_dict("records")
    ]


def is_significant(row: Mapping[Any, Any]) -> bool:
    """Return whether an estimate of table ``freed`` is farther from zero than noise and all a-priori errors explain."""
    return bool(abs(row["value"]) > SIGNIFICANT * row["expected"])
