"""The largest total sigmas of an accepted calibration, and the order of survey by which its soundings are judged.

They follow from the settings of class :class:`~pipeline.config.verdict.VerdictLimits`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.session import Calibrated
from pipeline.config.verdict import VerdictLimits
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.maths.survey.mount_limits import largest_share, sigmas_alone
from pipeline.maths.survey.sounding_uncertainty import EXCLUSIVE, SPECIAL, Order

Array = NDArray[np.float64]
BY_PURPOSE = {  # orders of survey; the pool's limits have no order, and serve every survey
    "construction": Order("construction", 0.10, 0.0075, 0.5),  # no order of S-44: poolcal's own
    "exclusive_order": EXCLUSIVE,
    "special_order": SPECIAL,
    "order_1a": Order("Order 1a", 0.5, 0.013, 5.0, 0.05),
    "order_1b": Order("Order 1b", 0.5, 0.013, 5.0, 0.05),
    "order_2": Order("Order 2", 1.0, 0.023, 20.0, 0.10),
}
POOL_DEG, POOL_M = 0.05, 0.005  # what a pool gives
MOST_DEG, MOST_M = 0.25, 0.025  # a larger sigma is no calibration, whatever the survey allows: a tape does as well


def limits_of(verdict: VerdictLimits, calibrated: Calibrated) -> VerdictLimits:
    """Return the settings for a sensor. The points of a laser are no soundings: only stated numbers count for it."""
    if calibrated == "mbes":
        return verdict
    return VerdictLimits(max_sigma_deg=verdict.max_sigma_deg, max_sigma_m=verdict.max_sigma_m)


def order_of(verdict: VerdictLimits) -> Order | None:
    """Return the order of survey by which soundings are judged; None for the pool's limits."""
    return BY_PURPOSE.get(verdict.purpose)


def largest_sigmas(verdict: VerdictLimits) -> Array:
    """Return the largest total sigmas (6,) in the order of covariances, rad and m."""
    order = order_of(verdict)
    if order is None:
        limits = np.repeat([np.radians(POOL_DEG), POOL_M], 3)
    else:
        alone = sigmas_alone(order, verdict.depth_m, verdict.swath_deg, verdict.mount_share)
        limits = np.minimum(alone, np.repeat([np.radians(MOST_DEG), MOST_M], 3))
    if verdict.max_sigma_deg is not None:
        limits[:3] = np.radians(verdict.max_sigma_deg)
    if verdict.max_sigma_m is not None:
        limits[3:] = verdict.max_sigma_m
    return limits


def in_report_units(vector: Array) -> Array:
    """Return a vector (6,) of rotation (rad) and lever arm (m) with its rotation in degrees."""
    return np.asarray(vector * np.repeat([np.degrees(1.0), 1.0], 3))


def limits_by_setting(verdict: VerdictLimits) -> dict[str, float]:
    """Return the largest total sigmas by name of the setting, degrees and m."""
    limits = in_report_units(largest_sigmas(verdict))
    return {key: round(float(limits[place]), 12) for _, place, key, _ in PARAMETERS}


def soundings_too_uncertain(verdict: VerdictLimits, covariance: Array) -> str:
    """Return in words that the mount takes too much of what the order allows soundings; empty if it does not.

    Parameters
    ----------
    verdict
        The settings. The pool's limits do not judge soundings.
    covariance
        (6, 6): total covariance of the mount's rotation (rad) and lever arm (m), body axes.
    """
    order = order_of(verdict)
    if order is None:
        return ""
    worst = largest_share(covariance, order, verdict.depth_m, verdict.swath_deg)
    if worst.share <= verdict.mount_share:
        return ""
    where = f"at a depth of {worst.depth_m:.3g} m, {verdict.swath_deg:g}° from the vertical"
    allowed = f"{100 * worst.share:.0f} % of the {worst.allowed_m:.3g} m that {order.name} allows"
    return (
        f"by the mount alone a sounding is uncertain by {worst.by_mount_m:.3g} m (95 %) in {worst.direction}, "
        f"{where}: {allowed}, above the share of {100 * verdict.mount_share:.3g} %"
    )


def purpose_in_words(verdict: VerdictLimits) -> str:
    """Return what a calibration by these limits is good for; empty for the pool's limits."""
    order = order_of(verdict)
    if order is None:
        return ""
    name = order.name if verdict.purpose == "construction" else f"{order.name} (IHO S-44)"
    return f"{name} down to {verdict.depth_m:g} m, beams to {verdict.swath_deg:g}°"


def limits_document(verdict: VerdictLimits) -> dict[str, Any]:
    """Return the limits for calibration.json: the largest of the angles and of the lever arm, and each."""
    each = limits_by_setting(verdict)
    angles, arm = ([each[key] for *_, key, one in PARAMETERS if one == unit] for unit in ("deg", "m"))
    survey = {"depth_m": verdict.depth_m, "swath_deg": verdict.swath_deg, "mount_share": verdict.mount_share}
    return {
        "max_sigma_deg": max(angles),
        "max_sigma_m": max(arm),
        "purpose": verdict.purpose,
        **(survey if order_of(verdict) else {}),
        "in_words": purpose_in_words(verdict),
        "each": each,
    }
