"""The verdict: all reasons for which a calibration is rejected. Without a reason it is accepted.

The limits are defined at these places (paths from ``pipeline/``):

* pose of the target and provisional mount, judged by stage segment: class ``Segment`` of config/pool.py
  (``search_...``, ``farthest_mount``, ``ambiguity_share``, ``ambiguity_margin``), ``_best_start`` of
  target/pose_search.py (largest distance of a pose), ``LARGEST_TURN`` of target/laser_search.py;
* no result: ``RANK_TOLERANCE`` of maths/adjustment/solution.py;
* convergence: ``max_iterations`` of class ``Adjust`` of config/pool.py, ``SETTLED`` of
  adjustment/weighted_iteration.py, ``CONVERGED`` and ``CLOSING_STEPS`` of adjustment/iteration.py;
* a mount far from the coarse one: ``farthest_mount`` of class ``Segment``, ``SIGNIFICANT`` of
  maths/mount_parameters.py;
* another minimum of the adjustment: ``SAME`` of adjustment/two_starts.py, ``LEAST_STRENGTH`` of ambiguities.py;
* number of soundings on a family, and its noise against the gate: ``FEWEST_SOUNDINGS`` and ``LARGEST_SHARE_OF_GATE``
  of adjustment/wet_planes.py; faces in doubt at unsurveyed walls: ``LEVEL``, ``NEARLY_AS_WELL`` and ``ROUNDS`` there,
  ``CERTAIN`` of adjustment/wall_stripes.py;
* mean residuals: ``test_level`` and ``test_tolerance_m`` of class ``Adjust`` of config/pool.py; ``FEWEST``,
  ``FEWEST_SLOTS`` and ``FEWEST_DOF`` of maths/adjustment/residual_means.py decide which means are tested; on rough
  walls ``PATCHES`` of maths/adjustment/profiles.py;
* the mount from parts of the session: ``test_level`` of class ``Adjust``, ``APART_M`` of adjustment/parts.py, and
  ``SAME`` of maths/adjustment/parts.py;
* drift of the INS, beside deviating residuals or a suspected cause: ``MAX_DRIFT_RATIO`` of drift_check.py;
* suspected causes, estimates off their settings, a contradicted coarse mount of the laser: ``test_level`` of class
  ``Adjust``;
* total sigmas, and difference of a patent's form from the adjustment: class ``VerdictLimits`` of config/verdict.py,
  ``POOL_...`` and ``MOST_...`` of limits/verdict_limits.py;
* uncertainty of soundings by all errors of the mount together: ``mount_share`` of the same class;
* no mount parameter of the laser good enough: ``hold_share`` of class ``LaserFit`` of config/pool.py, and the limits of
  the total sigmas;
* result and convergence of a patent's form: classes ``FitPlanes``, ``AngleIterate`` and ``Offsets`` of config/pool.py.

Warnings do not reject. Their limits are the ``MAX_...`` constants of warnings.py, as_built.py and cast_checks.py,
``MAX_DRIFT_RATIO`` and ``MAX_DEVIATION`` of drift_check.py, and, for gaps in the geometry, ``NEAR_M`` of
planning/observability.py.
``MAX_DRIFT_M`` and ``SAME_STEP_DEG`` of residual_words.py only change the words of a reason.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from pipeline.config.pool import Method
from pipeline.config.verdict import VerdictLimits
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.ambiguities import MountSearch, ambiguities, ambiguous_minimum, far_from_coarse
from pipeline.report.coarse_mount import contradicted_coarse_mount
from pipeline.report.evidence import Evidence
from pipeline.report.hypotheses import Hypothesis, hypotheses
from pipeline.report.label_checks import noise_cut_by_gate, too_few_soundings
from pipeline.report.limit_checks import patent_reasons, sigmas_above_limit, soundings_above_limit
from pipeline.report.part_checks import disagreeing_parts
from pipeline.report.reason_codes import ReasonCode, Statement, named
from pipeline.report.residual_tests import deviating_parts, deviations
from pipeline.report.residual_words import ResidualTests
from pipeline.report.sigma_sources import contributions
from pipeline.report.suspected_causes import (
    NEARLY_AS_WELL,
    SuspectedCause,
    estimated_parameters,
    significance_limit,
    suspected_causes,
)
from pipeline.report.wall_checks import faces_in_doubt


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Limits of the verdict, and words for its reasons.

    Attributes
    ----------
    limits : limits of the total sigmas
    test_level : level of the tests of mean residuals
    method : the method that is the result
    search : the search for the provisional mount
    shape : names of the settings of the target's shape, in words
    sides : name of the setting of the target's left and right, in words
    held : mount parameters of a laser that need not be good enough, as long as others are
    laser_correlates : whether the sonar is calibrated, and the laser's mount has a covariance
    """

    limits: VerdictLimits
    test_level: float
    method: Method
    search: MountSearch
    shape: str
    sides: str = "the target's left and right"
    held: Collection[str] = ()
    laser_correlates: bool = False


@dataclass(frozen=True, kw_only=True)
class JudgedHead:
    """A further head of the sonar, which was adjusted together with the first.

    Attributes
    ----------
    name : name of the head
    evidence : tables of the run, with those of this head in place of the first's
    methods : blocks of its calibration by method
    criteria : as for the first head
    """

    name: str
    evidence: Evidence
    methods: Mapping[str, Mapping[str, Any]]
    criteria: Criteria


def rejections(
    evidence: Evidence,
    methods: Mapping[str, Mapping[str, Any]],
    criteria: Criteria,
    drift_check: Statement | None = None,
    off_figures: Statement | None = None,
    further: Sequence[JudgedHead] = (),
) -> list[Statement]:
    """Return the reasons for which the calibration is rejected; empty if it is accepted.

    If the labels are in doubt, or the adjustment has no result, nothing else is judged; if it did not converge, nothing
    that rests on its values.

    Parameters
    ----------
    evidence : tables of the run
    methods : blocks of calibration.json by method
    criteria : limits, levels and tolerances
    drift_check : doubt about the figures of the INS's drift; a reason only if residuals deviate or a cause is suspected
    off_figures : that the INS drifts more than its figures say; a reason only if sigmas are above their limits
    further : the sonar's further heads; one that is beyond its limits rejects the whole
    """
    first = JudgedHead(name="mbes" if further else "", evidence=evidence, methods=methods, criteria=criteria)
    heads = (first, *further)
    if doubts := [one for head in heads for one in named(head.name, _doubts(head.evidence, head.criteria))]:
        return doubts
    summary = evidence.summary.iloc[0]
    if summary["reason"]:
        words = "; ".join([summary["reason"], *evidence.geometry["words"]])
        return [Statement(ReasonCode.NO_RESULT, f"the adjustment has no result: {words}")]
    reasons = ambiguous_minimum(summary)
    gates_m = {"laser": evidence.target_pose["gate_m"].iloc[0]}
    for head in heads:
        gates_m[head.name or "mbes"] = head.evidence.provisional_mount["gate_m"].iloc[0]
        reasons += named(head.name, too_few_soundings(evidence.cells, head.name or "mbes"))
    reasons += faces_in_doubt(evidence.left_out)
    reasons += [one for head in heads for one in named(head.name, _far_from_coarse(head))]
    if not summary["converged"]:
        steps = summary["iterations"]
        words = f"the adjustment did not converge in {steps} steps: its values and residuals say nothing"
        return [*reasons, Statement(ReasonCode.NOT_CONVERGED, words)]
    reasons += _residual_reasons(evidence, criteria, drift_check)
    reasons += noise_cut_by_gate(evidence.cells, gates_m)  # a face that is off scatters too, and is named before
    reasons += disagreeing_parts(evidence.parts, criteria.test_level)
    reasons += _estimates_off_settings(evidence.freed, criteria.test_level)
    reasons += contradicted_coarse_mount(evidence.freed, criteria.test_level)
    if len(criteria.held) == len(PARAMETERS):
        words = "no mount parameter is good enough: none is within its limit and better than the coarse mount"
        reasons.append(Statement(ReasonCode.NO_PARAMETER_ESTIMABLE, words))
    wide = [one for head in heads for one in named(head.name, _beyond_limits(head))]
    reasons += [off_figures, *wide] if wide and off_figures is not None else wide
    return reasons + [one for head in heads for one in named(head.name, _patent_reasons(head))]


def own_reasons(head: JudgedHead) -> list[Statement]:
    """Return the reasons that are about one head alone: doubts about it, too few soundings, a far mount, its limits."""
    if doubts := _doubts(head.evidence, head.criteria):
        return doubts
    return [
        *too_few_soundings(head.evidence.cells, head.name),
        *_far_from_coarse(head),
        *_beyond_limits(head),
        *_patent_reasons(head),
    ]


def _far_from_coarse(head: JudgedHead) -> list[Statement]:
    return far_from_coarse(head.evidence.estimate, head.criteria.search)


def _patent_reasons(head: JudgedHead) -> list[Statement]:
    corrections, method = head.evidence.corrections, head.criteria.method
    if method == "adjustment" or corrections is None:
        return []
    row = corrections.set_index("method").loc[method]
    return list(patent_reasons(method, row, head.methods, head.criteria.limits))


def _beyond_limits(head: JudgedHead) -> list[Statement]:
    """Return the reasons by the limits of the total sigmas."""
    adjusted, criteria = head.methods["adjustment"], head.criteria
    sources = contributions(head.evidence.freed, adjusted, criteria.laser_correlates)
    wide = sigmas_above_limit(adjusted["sigma_mount_total"], criteria.limits, criteria.held, sources)
    return [*wide, *soundings_above_limit(adjusted["covariance_total"], criteria.limits)]


def _doubts(evidence: Evidence, criteria: Criteria) -> list[Statement]:
    return ambiguities(
        evidence.target_pose.iloc[0],
        evidence.provisional_mount.iloc[0],
        criteria.search,
        criteria.shape,
        criteria.sides,
    )


def has_values(summary: pd.DataFrame) -> bool:
    """Return whether the adjustment has values that can be judged (table ``summary``): a result, and it converged."""
    return not summary["reason"].iloc[0] and bool(summary["converged"].iloc[0])


def explanations(evidence: Evidence, criteria: Criteria) -> list[Hypothesis]:
    """Return what would explain the residuals, the strongest explanation first; empty if they need none."""
    if _doubts(evidence, criteria) or not has_values(evidence.summary):
        return []
    parts = deviating_parts(_residual_tests(evidence, criteria), evidence.parts, criteria.test_level)
    return hypotheses(parts, suspected_causes(evidence.freed, evidence.sets, criteria.test_level))


def _residual_reasons(evidence: Evidence, criteria: Criteria, drift_check: Statement | None) -> list[Statement]:
    """Return the reasons from deviating mean residuals, from a suspected cause, and from the INS's drift.

    What explains the residuals best comes first: a parameter, or a part of the points. What only shows that something
    is wrong comes after it.
    """
    deviating = deviations(_residual_tests(evidence, criteria), evidence.parts, criteria.test_level)
    causes = suspected_causes(evidence.freed, evidence.sets, criteria.test_level)
    strongest = causes[0].strength if causes else 0.0
    stronger = [deviation.statement for deviation in deviating if deviation.strength > strongest]
    weaker = [deviation.statement for deviation in deviating if deviation.strength <= strongest]
    reasons = stronger + _suspected_cause(causes, bool(stronger)) + weaker
    exonerated = any(cause.not_drift for cause in causes)
    drift = [drift_check] if reasons and drift_check is not None and not exonerated else []
    return reasons[:1] + drift + reasons[1:]


def _residual_tests(evidence: Evidence, criteria: Criteria) -> ResidualTests:
    return ResidualTests(
        patterns=evidence.patterns,
        face_names=evidence.faces["name"].tolist(),
        shape=criteria.shape,
    )


def _suspected_cause(causes: list[SuspectedCause], is_second: bool) -> list[Statement]:
    """Return a reason with the parameter or set that explains the residuals best, and the number of the others.

    Others that explain them nearly as well are named, too. ``is_second``: a face, step, height, pass or ping explains
    them better.
    """
    if not causes:
        return []
    first = causes[0]
    rivals = [cause for cause in causes[1:] if first.strength - cause.strength <= NEARLY_AS_WELL]
    others = len(causes) - 1 - len(rivals)
    unless = ", unless the face, step, height, pass or ping named above is itself the cause" if is_second else ""
    strength = f"{first.strength:.0f}"
    if first.not_drift:
        strength = f"{strength}; a larger drift of the INS would explain less"
    parts = [f"likely cause of residuals{unless} (strength {strength}): {first.words}"]
    parts += [f"nearly as well (strength {cause.strength:.0f}): {cause.words}" for cause in rivals]
    parts += [f"other causes that would explain it less well: {others}"] if others else []
    return [Statement(ReasonCode.SUSPECTED_CAUSE, "; ".join(parts))]


def _estimates_off_settings(freed: pd.DataFrame, level: float) -> list[Statement]:
    """Return a reason for each parameter of ``adjust.free`` that differs significantly from its setting.

    The mount is right only together with this estimate, and the survey has the same error.
    """
    return [
        Statement(
            ReasonCode.ESTIMATE_OFF_SETTINGS,
            f"adjust.free found {parameter.words}: the mount is valid only with that value; correct it, in the "
            "settings and in the survey, and run again",
        )
        for parameter in estimated_parameters(freed)
        if parameter.normalised > significance_limit(freed, level)
    ]
