"""Suspected causes (parameters that would explain the residuals), and the parameters that adjust.free names.

Table ``freed`` has the single-parameter test of each parameter that is fixed, or known beforehand: its estimate from
the points alone. The residuals contradict it if this estimate is farther from zero than noise and all a-priori errors
explain: its own, and those of others that look alike. All these tests have one limit (Šidák,
:func:`~pipeline.maths.adjustment.mean_tests.joint_limit`): if all errors are as the settings say, one of them exceeds
it with the chance ``adjust.test_level``. So with a hundred parameters it is 4.4 sigmas.

One error often moves the estimates of several parameters. A parameter is a cause if its estimate is farther from zero
than noise and its own a-priori error explain: a face that stands out by its sigma is as it should be, however much that
explains. The report names the cause that explains most, by its strength: the root of the fall of the least sum of
squares if nothing is known of it beforehand (:mod:`~pipeline.maths.adjustment.joint_tests`). It may be a set of
parameters that are wrong all at once (table ``sets``). A set is a cause where it is stronger than each of its
parameters, in place of those that explain less by more than two sigmas. The data may also say that the INS drifts more
than its figures say. Where one parameter or set explains more than that (column ``by_session``), all count with the
drift as its figures say.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.adjustment.parameters import of_head
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.report.cause_words import words_of, words_of_set
from pipeline.report.reason_codes import ReasonCode, Statement

NEARLY_AS_WELL = 2.0  # a cause whose strength is smaller by no more is named beside the strongest
OF_HEAD = "projector_"  # beginning of the names of parameters that a survey with the head has as well
UNITS = {"sound_speed": "1"} | dict.fromkeys(("mbes_latency", "laser_latency"), "s")
UNITS |= dict.fromkeys(("mbes_incidence", "mbes_level_range", "laser_incidence"), "m")


@dataclass(frozen=True)
class SuspectedCause:
    """A parameter or a set of them that would explain the residuals: its name, words and strength.

    not_drift: it explains more than another drift than the session's would; ``strength`` is with the session's.
    is_set: it is a set of parameters.
    """

    name: str
    words: str
    strength: float
    not_drift: bool = False
    is_set: bool = False


@dataclass(frozen=True)
class EstimatedParameter:
    """A parameter that ``adjust.free`` names.

    Attributes
    ----------
    unknown : name of the parameter
    value, sigma_total : estimate and total sigma in ``unit``
    words : the estimate, and the setting or device to check
    normalised : the value over the sigma that its total sigma and its a-priori sigma explain
    """

    unknown: str
    value: float
    sigma_total: float
    unit: str
    words: str
    normalised: float


def significance_limit(freed: pd.DataFrame, level: float) -> float:
    """Return the limit of |value| over its expected sigma for all tests of table ``freed``."""
    return joint_limit(int(np.isfinite(freed["expected"]).sum()), level)


def suspected_causes(freed: pd.DataFrame, sets: pd.DataFrame, level: float) -> list[SuspectedCause]:
    """Return the suspected causes, the strongest first, from the tables ``freed`` and ``sets``.

    There are none unless the residuals contradict at least one parameter that ``adjust.free`` does not name. A coarse
    mount that is an observation is judged by itself (:mod:`~pipeline.report.coarse_mount`).
    """
    limit = significance_limit(freed, level)
    is_tested = ~freed["estimated"] & ~freed["unknown"].isin(MOUNT_NAMES) & np.isfinite(freed["value"])
    tested = freed[is_tested].to_dict("records")
    if not any(abs(row["value"]) > limit * row["expected"] for row in tested):
        return []
    strengths = {str(row["unknown"]): _strength(row) for row in tested}
    causes = {
        name: SuspectedCause(name, words_of(row), strengths[name], bool(np.isfinite(row["by_session"])))
        for name, row in zip(strengths, tested, strict=True)
        if abs(row["value"]) > limit * min(row["expected"], np.hypot(row["sigma"], row["considered"]))
        or row["by_session"] > limit
    }
    for row in sets.to_dict("records"):
        by_strength = sorted(row["parameters"].split(), key=lambda name: -strengths.get(name, 0.0))
        if _strength(row) > max(limit, strengths.get(by_strength[0], 0.0)):
            least = _strength(row) - NEARLY_AS_WELL
            causes = {name: one for name, one in causes.items() if name not in by_strength or one.strength >= least}
            most = [name for name in by_strength if strengths.get(name, 0.0) >= strengths.get(by_strength[0], 0.0) / 2]
            words, not_drift = words_of_set(row["set"], by_strength, most), bool(np.isfinite(row["by_session"]))
            causes[row["set"]] = SuspectedCause(row["set"], words, _strength(row), not_drift, is_set=True)
    return sorted(causes.values(), key=lambda cause: -cause.strength)


def _strength(row: Mapping[Any, Any]) -> float:
    by_session = float(row["by_session"])
    return by_session if np.isfinite(by_session) else float(row["strength"])


def errors_allowed_for(freed: pd.DataFrame, level: float) -> list[Statement]:
    """Return a warning for each known parameter that certainly is not zero, but within its a-priori sigma.

    The mount allows for such an error. Where it is the head's, the survey has it as well, unless it is corrected there.
    """
    limit, warnings = significance_limit(freed, level), []
    for row in freed[freed["known"] & ~freed["unknown"].isin(MOUNT_NAMES)].to_dict("records"):
        if limit * row["sigma"] < abs(row["value"]) <= limit * row["expected"]:
            survey = ", the survey does not yet" if of_head(row["unknown"])[1].startswith(OF_HEAD) else ""
            words = f"the mount allows for this{survey}: {words_of(row)}"
            warnings.append(Statement(ReasonCode.ERROR_ALLOWED_FOR, words))
    return warnings


def estimated_parameters(freed: pd.DataFrame) -> list[EstimatedParameter]:
    """Return the parameters of ``adjust.free`` with their estimates (table ``freed``); empty without a result."""
    return [
        EstimatedParameter(
            unknown=row["unknown"],
            value=row["value"],
            sigma_total=row["sigma"],
            unit=UNITS[of_head(row["unknown"])[1]],
            words=words_of(row),
            normalised=abs(row["value"]) / row["expected"],
        )
        for row in freed[freed["estimated"] & np.isfinite(freed["sigma"])].to_dict("records")
    ]
