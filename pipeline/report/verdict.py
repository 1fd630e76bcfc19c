"""Accepted or rejected: every reason to reject, with its evidence. What does not reject is in ``warnings.py``."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from pipeline.config.pool import Method, VerdictLimits
from pipeline.console import plural
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.ambiguities import MountSearch, ambiguities
from pipeline.report.evidence import Evidence
from pipeline.report.limit_checks import patent_reasons, sigmas_above_limit
from pipeline.report.reason_codes import ReasonCode, Statement
from pipeline.report.residual_tests import deviations
from pipeline.report.residual_words import ResidualTests
from pipeline.report.suspected_causes import estimated_parameters, suspected_causes

MIN_SOUNDINGS = 30  # on a family of faces; with fewer its labels cannot be trusted


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """What a calibration is judged by.

    Attributes
    ----------
    limits : limits of the total sigmas
    test_level : level of the tests of mean residuals
    tolerance_m : mean residuals that the tests tolerate
    method : the method that is the result
    search : how the provisional mount was searched
    shape : the settings that give the target's shape, for people
    sides : the setting that tells the target's left from its right, for people
    """

    limits: VerdictLimits
    test_level: float
    tolerance_m: float
    method: Method
    search: MountSearch
    shape: str
    sides: str = "the target's left and right"


def rejections(
    evidence: Evidence,
    methods: Mapping[str, Mapping[str, Any]],
    criteria: Criteria,
    drift_check: Statement | None = None,
) -> list[Statement]:
    """Return why the calibration is rejected; empty if it is accepted.

    Where labels are in doubt, or the adjustment has no result, nothing else is judged.

    Parameters
    ----------
    evidence : tables of the run
    methods : blocks of calibration.json by method
    criteria : limits, levels and tolerances
    drift_check : what speaks against the figures of the INS's drift; said where residuals deviate
    """
    doubts = ambiguities(
        evidence.target_pose.iloc[0],
        evidence.provisional_mount.iloc[0],
        criteria.search,
        criteria.shape,
        criteria.sides,
    )
    if doubts:
        return doubts
    summary = evidence.summary.iloc[0]
    if summary["reason"]:
        words = "; ".join([summary["reason"], *evidence.geometry["words"]])
        return [Statement(ReasonCode.NO_RESULT, f"the adjustment has no result: {words}")]
    reasons = []
    if not summary["converged"]:
        words = f"the adjustment did not converge in {summary['iterations']} steps"
        reasons.append(Statement(ReasonCode.NOT_CONVERGED, words))
    reasons += _too_few_soundings(evidence.cells)
    reasons += _residual_reasons(evidence, criteria, drift_check)
    reasons += _estimates_off_settings(evidence.freed)
    if len(evidence.fixed) == len(PARAMETERS):
        words = "no mount parameter can be estimated: this target and these passes determine none within its limit"
        reasons.append(Statement(ReasonCode.NO_PARAMETER_ESTIMABLE, words))
    reasons += sigmas_above_limit(methods["adjustment"]["sigma_mount_total"], criteria.limits, evidence.fixed)
    if criteria.method != "adjustment" and evidence.corrections is not None:
        row = evidence.corrections.set_index("method").loc[criteria.method]
        reasons += patent_reasons(criteria.method, row, methods, criteria.limits)
    return reasons


def _residual_reasons(evidence: Evidence, criteria: Criteria, drift_check: Statement | None) -> list[Statement]:
    """Say which mean residuals deviate, whether the INS's drift is in doubt, and what would explain them."""
    tests = ResidualTests(
        patterns=evidence.patterns,
        face_names=evidence.faces["name"].tolist(),
        shape=criteria.shape,
        tolerance_m=criteria.tolerance_m,
    )
    deviating = deviations(tests, criteria.test_level)
    causes = _suspected_cause(evidence.freed, any(deviation.is_local for deviation in deviating))
    reasons = [deviation.statement for deviation in deviating]
    if (deviating or causes) and drift_check is not None:
        reasons.append(drift_check)
    return reasons + causes


def _too_few_soundings(cells: pd.DataFrame) -> list[Statement]:
    """Name families with so few soundings that their labels cannot be trusted; those with none are not used."""
    count = cells[cells["sensor"] == "mbes"].groupby("family")["count"].sum()
    return [
        Statement(
            ReasonCode.TOO_FEW_SOUNDINGS,
            f"only {number} soundings lie on {family}: too few to trust; sail so that the fan covers it (poolcal check "
            "tells why so few hit it)",
        )
        for family, number in count.items()
        if number < MIN_SOUNDINGS
    ]


def _suspected_cause(freed: pd.DataFrame, local: bool) -> list[Statement]:
    """Name the fixed parameter that explains the residuals best, and count the others.

    ``local``: a face, step, pass or ping has been named as well, and may itself be the cause.
    """
    causes = suspected_causes(freed)
    if not causes:
        return []
    first, others = causes[0], len(causes) - 1
    rest = f"; {plural(others, 'other parameter')} would explain it less well" if others else ""
    unless = ", unless the face, step, pass or ping named above is itself the cause" if local else ""
    words = f"likely cause of residuals{unless} ({first.normalised:.0f} sigma): {first.words}{rest}"
    return [Statement(ReasonCode.SUSPECTED_CAUSE, words)]


def _estimates_off_settings(freed: pd.DataFrame) -> list[Statement]:
    """Name what adjust.free estimates as significantly not what the session says.

    The mount is right only together with that estimate, and the same error is in the survey.
    """
    return [
        Statement(
            ReasonCode.ESTIMATE_OFF_SETTINGS,
            f"adjust.free found {parameter.words}: the mount is valid only with that value; correct it, in the "
            "settings and in the survey, and run again",
        )
        for parameter in estimated_parameters(freed)
        if parameter.is_significant
    ]
