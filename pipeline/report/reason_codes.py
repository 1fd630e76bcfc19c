"""Stable codes of all reasons and warnings of a verdict, and the verdict in words.

People read the words beside a code, which may be mended. Programs read the code, which never changes.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

from pipeline.maths.mount_parameters import PARAMETERS


class ReasonCode(StrEnum):
    """Code of a reason or a warning in calibration.json, with its meaning."""

    meaning: str

    def __new__(cls, code: str, meaning: str) -> Self:
        """Make a member whose value is the code alone."""
        member = str.__new__(cls, code)
        member._value_, member.meaning = code, meaning
        return member

    # Doubts about the pose of the target or the mount: these reject, and nothing else is judged.
    AMBIGUOUS_TARGET_POSE = "ambiguous_target_pose", "another pose of the target fits the laser points as well"
    TARGET_BEYOND_SEARCH = "target_beyond_search", "no pose of the target within the search limits fits"
    MOUNT_BEYOND_SEARCH = "mount_beyond_search", "no mount within the search limits brings the points onto the target"
    AMBIGUOUS_MOUNT = "ambiguous_mount", "another mount fits the soundings nearly as well"

    # The adjustment: these reject.
    NO_RESULT = "no_result", "the adjustment has no result"
    NOT_CONVERGED = "not_converged", "the adjustment did not converge"
    MOUNT_FAR_FROM_COARSE = "mount_far_from_coarse", "the adjustment took the mount beyond the search limits"
    TOO_FEW_SOUNDINGS = "too_few_soundings", "a family of faces has too few soundings for its labels to be trusted"
    NOISE_CUT_BY_GATE = "noise_cut_by_gate", "a family's noise is wider than the labels' gate, which cuts it off"
    NO_PARAMETER_ESTIMABLE = "no_parameter_estimable", "no mount parameter of the laser is good enough"
    COARSE_MOUNT_CONTRADICTED = "coarse_mount_contradicted", "the points contradict the laser's coarse mount"
    NO_COVARIANCE = "no_covariance", "the adjustment has no covariance"
    SIGMA_ABOVE_LIMIT = "sigma_above_limit", "the total sigma of a mount parameter is above verdict's limit"
    SOUNDINGS_ABOVE_LIMIT = "soundings_above_limit", "the mount alone takes too much of what soundings may be wrong by"
    FACES_IN_DOUBT = "faces_in_doubt", "unsurveyed faces contradict one another below the water: one is wrong"
    ESTIMATE_OFF_SETTINGS = "estimate_off_settings", "a parameter of adjust.free is significantly not as configured"

    # Mean residuals beyond the tolerance: these reject.
    PASSES_DISAGREE = "passes_disagree", "one pass lies off the others"
    INS_DRIFT_BETWEEN_PASSES = "ins_drift_between_passes", "the INS would have to drift too far in one pass"
    PARTS_DISAGREE = "parts_disagree", "a part of the session gives another mount than the whole session"
    RESIDUALS_BY_FACE = "residuals_by_face", "mean residuals differ from face to face"
    RESIDUALS_BY_ANGLE = "residuals_by_angle", "mean residuals depend on the beam's angle or elevation"
    RESIDUALS_STEP = "residuals_step", "mean residuals step at a receive angle"
    RESIDUALS_BY_HEIGHT = "residuals_by_height", "mean residuals step at a height above or below the water"
    RESIDUALS_BY_PING = "residuals_by_ping", "mean residuals alternate from ping to ping"
    RESIDUALS_BY_DISTANCE = "residuals_by_distance", "mean residuals depend on the distance"
    RESIDUALS_BY_TIME = "residuals_by_time", "mean residuals lie off for some seconds"
    SUSPECTED_CAUSE = "suspected_cause", "a fixed parameter that would explain the residuals"

    # A form of the patent as the result: these reject.
    PATENT_NO_RESULT = "patent_no_result", "the patent's form has no result"
    PATENT_NOT_CONVERGED = "patent_not_converged", "the patent's form did not converge"
    PATENT_OFF_ADJUSTMENT = "patent_off_adjustment", "the patent's form differs from the adjustment beyond the limits"

    # Drift of the INS: beside deviating residuals or a suspected cause these reject. Otherwise the second one warns.
    INS_DRIFT_NOT_GIVEN = "ins_drift_not_given", "ins.drift allows the INS no drift at all"
    INS_DRIFT_ABOVE_SETTINGS = "ins_drift_above_settings", "the INS drifts farther than its figures say"

    # These only warn.
    LABELS_UNSETTLED = "labels_unsettled", "labels were made with the INS's drift in them, or still changed at the end"
    INS_DRIFT_OFF_FIGURES = "ins_drift_off_figures", "by the data the INS drifts more, or faster, than its figures say"
    GEOMETRY_GAP = "geometry_gap", "the passes leave a gap in the geometry"
    NOISE_OFF_SIGMAS = "noise_off_sigmas", "observations scatter more, or less, than their sigmas say"
    INS_NOISE_ABOVE_SETTINGS = "ins_noise_above_settings", "INS poses scatter more than ins.white says"
    PING_NOISE_ABOVE_SETTINGS = "ping_noise_above_settings", "whole pings scatter more than ins.white says"
    NOISE_DIFFERS_BY_FAMILY = "noise_differs_by_family", "a sensor's noise is far larger on one family than on others"
    BEAMS_CORRELATED = "beams_correlated", "neighbouring beams of the sonar err alike"
    SIGMAS_OFF_SCATTER = "sigmas_off_scatter", "slots of time scatter more than the random sigmas say"
    MANY_OUTLIERS = "many_outliers", "an unusual share of the observations was cut as outliers"
    TARGET_OFF_ORIGIN = "target_off_origin", "the target stands far from target.origin, or out of plumb"
    WATER_CONTRADICTED = "water_contradicted", "the boat's height contradicts target.water_by_time"
    TARGET_FOUND = "target_found", "the target was found in laser points, and its faces go on below the water unproven"
    FACE_LEFT_OUT = "face_left_out", "soundings on a face are left out: it is not as above, or a thing stands before it"
    UNSEEN_FACE_ERROR = "unseen_face_error", "a wall could be off below the water unnoticed, and the mount be wrong"
    ROUGH_WALL = "rough_wall", "patches of the walls stand off their planes, and the sigmas allow for it"
    PASS_WITHOUT_SOUNDINGS = "pass_without_soundings", "in some passes the laser alone saw the target"
    PASS_WITHOUT_LASER = "pass_without_laser", "in some passes the sonar alone saw the target"
    SOUNDINGS_OUTSIDE_PASSES = "soundings_outside_passes", "a further head saw the target outside the first's passes"
    LENGTH_OFF_DESIGN = "length_off_design", "b or e of the target is measured otherwise than designed"
    ANGLE_OFF_DESIGN = "angle_off_design", "an angle between faces is measured otherwise than designed"
    ERROR_ALLOWED_FOR = "error_allowed_for", "a systematic error within its a-priori sigma shows, and is allowed for"
    CAST_OF_ANOTHER_TIME = "cast_of_another_time", "the cast was taken long before or after the soundings"
    CAST_OF_ANOTHER_PLACE = "cast_of_another_place", "the cast was taken far away"
    CAST_OFF_HEAD_SPEED = "cast_off_head_speed", "the cast disagrees with the sound speed recorded at the head"
    RAYS_TRACED_WITH_WRONG_MOUNT = "rays_traced_with_wrong_mount", "rays were traced with a mount that is far off"


WEAK_ALONE = frozenset({ReasonCode.SIGMA_ABOVE_LIMIT, ReasonCode.SOUNDINGS_ABOVE_LIMIT})  # too weak, and not wrong


@dataclass(frozen=True)
class Statement:
    """One reason or warning: a stable code for programs, and words for people."""

    code: ReasonCode
    words: str


def named(head: str, statements: Iterable[Statement]) -> list[Statement]:
    """Return statements with the name of the head that they are about; unchanged if the name is empty."""
    return [Statement(one.code, f"{head}: {one.words}" if head else one.words) for one in statements]


def verdict_in_words(verdict: str, held: Collection[str] = (), purpose: str = "") -> str:
    """Return the verdict in words.

    Parameters
    ----------
    verdict : ``accepted`` or ``rejected``
    held : mount parameters for which an accepted calibration is not good enough
    purpose : what an accepted calibration is good for, in words; empty: for every survey

    >>> verdict_in_words("accepted"), verdict_in_words("accepted", ["yaw", "x"]), verdict_in_words("rejected", ["yaw"])
    ('accepted', 'accepted in part: roll, pitch, y, z', 'rejected')
    >>> verdict_in_words("accepted", (), "Order 1a (IHO S-44) down to 20 m, beams to 60°")
    'accepted for Order 1a (IHO S-44) down to 20 m, beams to 60°'
    """
    if verdict == "accepted" and purpose:
        return f"accepted for {purpose}"
    if verdict != "accepted" or not held:
        return verdict
    return f"accepted in part: {', '.join(name for name, *_ in PARAMETERS if name not in held)}"


def verdict_of(result: Mapping[str, Any]) -> str:
    """Return the verdict in words, from the content of calibration.json, an older version's too."""
    return verdict_in_words(result["verdict"], result.get("held", {}), result.get("limits", {}).get("in_words", ""))
