"""Doubts about the pose of the target or the mount of the sensor. The labels of all points depend on both."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.config.pool import FARTHEST
from pipeline.config.session import Calibrated
from pipeline.maths.mount_parameters import MOUNT_NAMES, MOUNT_WORDS, too_far
from pipeline.report.reason_codes import ReasonCode, Statement
from pipeline.target.laser_search import LARGEST_TURN

LEAST_STRENGTH = 5.0  # of another minimum of the adjustment: at 5 it is exp(25 / 2) times less likely


@dataclass(frozen=True, kw_only=True)
class MountSearch:
    """The search for the provisional mount, and the advice of a reason about it.

    Attributes
    ----------
    sensor : the sensor that is calibrated
    max_angle_deg, max_lever_arm_m : a mount farther from the coarse one than this is not used for labelling
    angles_advice : advice to enter other angles; it appears only if nothing except the angles is in doubt
    """

    sensor: Calibrated
    max_angle_deg: float
    max_lever_arm_m: float
    angles_advice: str = ""


def ambiguities(pose: pd.Series, mount: pd.Series, search: MountSearch, shape: str, sides: str) -> list[Statement]:
    """Return the reasons why the labels are in doubt; empty if there is none.

    Parameters
    ----------
    pose : row of the table ``target_pose``
    mount : row of the table ``provisional_mount``
    search : limits of the mount's search
    shape : names of the settings of the target's shape, in words
    sides : name of the setting of the target's left and right, in words
    """
    statements = []
    if pose["ambiguous"]:
        statements.append(_ambiguous_pose(pose, shape, sides))
    if not pose["within"]:
        words = (
            "no pose of the target within the search limits fits the laser points: target.origin or target.azimuth_deg "
            "is farther off than segment.search_... allow; poolcal check tells by how much"
        )
        statements.append(Statement(ReasonCode.TARGET_BEYOND_SEARCH, words))
    if not mount["within"]:
        if search.sensor == "laser":
            words = _no_laser_mount(mount, search, shape)
        else:
            words = _no_sonar_mount(mount, search, shape, alone=not statements and not mount["ambiguous"])
        statements.append(Statement(ReasonCode.MOUNT_BEYOND_SEARCH, words))
    if mount["ambiguous"]:
        words = (
            f"the soundings fit two ways (score {mount['rival_score']:.3f} against {mount['score']:.3f}): the coarse "
            "mount may be a block off; measure the coarse lever arm again"
        )
        statements.append(Statement(ReasonCode.AMBIGUOUS_MOUNT, words))
    return statements


def ambiguous_minimum(summary: pd.Series) -> list[Statement]:
    """Return the reason that the adjustment has two minima, and hardly tells them apart; empty if it does.

    Parameters
    ----------
    summary : row of the table ``summary`` of the adjustment
    """
    if not summary["rival_strength"] < LEAST_STRENGTH:  # NaN without another minimum
        return []
    words = (
        f"two mounts fit the soundings nearly as well: the other's yaw differs by {summary['rival_yaw_deg']:+.2f}°, "
        f"its lever arm y by {1000 * summary['rival_lever_arm_y_m']:+.0f} mm (strength "
        f"{summary['rival_strength']:.1f}; {LEAST_STRENGTH:g} tells them apart). All walls look one way, and a sonar "
        "turned to either side of that way sees nearly the same: pass a wall that looks another way, too"
    )
    return [Statement(ReasonCode.AMBIGUOUS_MOUNT, words)]


def far_from_coarse(estimate: pd.DataFrame, search: MountSearch) -> list[Statement]:
    """Return the reason that the sonar's adjusted mount lies beyond the limits of its search; empty if it does not.

    Of the laser the coarse mount is an observation, which :mod:`~pipeline.report.coarse_mount` tests.

    Parameters
    ----------
    estimate : table ``estimate`` of the adjustment
    search : limits of the mount's search
    """
    if search.sensor == "laser":
        return []
    rows = estimate.set_index("unknown").loc[list(MOUNT_NAMES)]
    value, sigma = (rows[name].to_numpy(np.float64) for name in ("value", "sigma_total"))
    limits = np.repeat([np.radians(search.max_angle_deg), search.max_lever_arm_m], 3)
    far = too_far(value, sigma, limits)
    if not far:
        return []
    words = ", ".join(
        f"{np.degrees(value[k]):+.1f}° in {MOUNT_WORDS[k]}" if k < 3 else f"{value[k]:+.2f} m in {MOUNT_WORDS[k]}"
        for k in far
    )
    return [
        Statement(
            ReasonCode.MOUNT_FAR_FROM_COARSE,
            f"the adjustment took the mount farther from the coarse one than {search.max_angle_deg:g}° and "
            f"{search.max_lever_arm_m:g} m: {words}. Measure this again. If the coarse mount was right, a wall is not "
            "where it should be below the water, or too few walls hold the mount, and all its values are wrong",
        )
    ]


def _ambiguous_pose(pose: pd.Series, shape: str, sides: str) -> Statement:
    """Return a reason with the rival pose, its fit, and the settings to check first."""
    rival_is_better = pose["rival_agreement_m2"] > pose["agreement_m2"]
    fit = "better" if rival_is_better else "nearly as well"
    remedy = "check" if rival_is_better else "let the laser see the wall's top edge; check"
    if rival_is_better and str(pose["rival"]).startswith("left and right exchanged"):
        remedy += f" {sides} first, then"
    return Statement(
        ReasonCode.AMBIGUOUS_TARGET_POSE,
        f"the target's pose is ambiguous: '{pose['rival']}' fits the laser points {fit} "
        f"({pose['rival_agreement_m2']:.2f} against {pose['agreement_m2']:.2f} m² of its faces seen, those missed "
        f"deducted); {remedy} target.origin (a height wrong by e or 2 e, half a period or a whole one, does this), "
        f"azimuth_deg, and {shape}; poolcal check tells which",
    )


def _no_laser_mount(mount: pd.Series, search: MountSearch, shape: str) -> str:
    """Return the sentence that no laser mount within the search limits fits, with the components beyond them."""
    excess = _best_fit(mount, search)
    return (
        f"no mount of the laser within {search.max_angle_deg:g}° of the coarse one ({LARGEST_TURN:g} times "
        f"segment.search_laser_deg) brings its points onto the target{excess}: laser.mount is farther off than that, "
        f"or {shape} are wrong"
    )


def _no_sonar_mount(mount: pd.Series, search: MountSearch, shape: str, alone: bool) -> str:
    """Return the same sentence for the sonar's mount; ``alone``: nothing else is in doubt."""
    excess = _best_fit(mount, search)
    angles_alone = "°" in excess and " m" not in excess
    advice = search.angles_advice if angles_alone and alone else ""
    return (
        f"no mount within {search.max_angle_deg:g}° and {search.max_lever_arm_m:g} m of the coarse one ({FARTHEST:g} "
        f"times segment.search_mount_deg = {search.max_angle_deg / FARTHEST:g} and search_mount_m = "
        f"{search.max_lever_arm_m / FARTHEST:g}) brings the soundings onto the target{excess}: mbes.mount is farther "
        f"off than that (a sign, an axis, a block of 2 e), {shape} are wrong, or the clocks differ (UTC is "
        f"18 s behind GPS time): poolcal check tells which sign, clock or height it is{advice}"
    )


def _best_fit(mount: pd.Series, search: MountSearch) -> str:
    """Return as text the components of the best mount that lie beyond the limits; empty if none does."""
    angles = [(float(mount[f"rotation_{axis}_deg"]), "°", search.max_angle_deg) for axis in "xyz"]
    arms = [(float(mount[f"lever_arm_{axis}_m"]), " m", search.max_lever_arm_m) for axis in "xyz"]
    components = zip(MOUNT_WORDS, angles + arms, strict=True)
    excess = [f"{value:+.2f}{unit} in {name}" for name, (value, unit, limit) in components if abs(value) > limit]
    return f"; best fits {', '.join(excess)}" if excess else ""
