"""Accepted or rejected, and why: each reason names its evidence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline import config
from pipeline.mounts import PARAMETERS

SIX = ("pitch", "roll", "yaw", "lever arm x", "lever arm y", "lever arm z")  # body x, y, z
FAR_M = 0.05  # a mean residual beyond this is no drift: the model is another
WORDS_OF_GROUP = {
    "laser": "laser points",
    "mbes_vertical": "soundings on vertical faces",
    "mbes_horizontal": "soundings on horizontal faces",
}
SHARED = {
    "ins_white": "the INS's poses scatter from record to record {:.1f} times as much as ins.white says: its filter, or "
    "the laser's clock",
    "ping": "whole pings scatter {:.1f} times as much as ins.white says: the sonar's clock, or stabilised beams",
}
ODD_FACTOR = 2.0  # a variance factor above this, or below its inverse, is worth a look
ODD_COMMON = 4.0  # the same of what an epoch's points share: less is a good INS
ODD_CUT = 0.01  # and so is a share of cut observations above this
ODD_OFFSET_M, ODD_TILT_DEG = 0.1, 0.1  # and a target found so far off
NEAR_M = 1.5  # passes whose distances differ by less tell yaw from lever arm y badly


@dataclass(frozen=True)
class Evidence:
    """The tables that a verdict looks at."""

    target_pose: pd.DataFrame
    provisional_mount: pd.DataFrame
    corrections: pd.DataFrame
    summary: pd.DataFrame
    cells: pd.DataFrame


def reasons(
    evidence: Evidence, methods: Mapping[str, Mapping[str, Any]], limits: config.Verdict, chosen: config.Method
) -> list[str]:
    """Why the calibration is rejected; empty: accepted. Where labels are in doubt, nothing else is judged."""
    doubts = _ambiguities(evidence)
    if doubts:
        return doubts
    found = []
    summary, cells = evidence.summary.iloc[0], evidence.cells
    if summary["reason"]:
        return [f"the adjustment has no result: {summary['reason']}; sail more passes, at different distances"]
    if not summary["converged"]:
        found.append(f"the adjustment did not converge in {summary['iterations']} steps")
    if not summary["test_passed"]:
        found.append(_inconsistency(summary, cells))
    found += _wide_sigmas(methods["adjustment"]["sigma_mount_total"], limits)
    if chosen != "adjustment":
        found += _patent(chosen, evidence.corrections.set_index("method").loc[chosen], methods, limits)
    return found


def _ambiguities(evidence: Evidence) -> list[str]:
    found = []
    pose, mount = evidence.target_pose.iloc[0], evidence.provisional_mount.iloc[0]
    if pose["ambiguous"]:
        better = pose["rival_agreement_m2"] > pose["agreement_m2"]
        how = "better" if better else "nearly as well"
        remedy = "check" if better else "let the laser see the wall's top edge; check"
        found.append(
            f"the target's pose is ambiguous: '{pose['rival']}' fits the laser points {how} "
            f"({pose['rival_agreement_m2']:.2f} against {pose['agreement_m2']:.2f} m²); {remedy} target.origin (a "
            "height wrong by e or 2 e does this), azimuth_deg, a, b, c, e and low_side"
        )
    if not pose["within"]:
        found.append(
            "no pose of the target within the search limits fits the laser points: target.origin or target.azimuth_deg "
            "is farther off than segment.search_... allow"
        )
    if not mount["within"]:
        found.append(
            "no mount within the search limits brings the soundings onto the target: the coarse mbes.mount is farther "
            "off than segment.search_mount_deg and search_mount_m, target.a, b, c, e are wrong, or the clocks differ "
            "(UTC is 18 s behind GPS time)"
        )
    if mount["ambiguous"]:
        found.append(
            f"the soundings fit two ways (score {mount['rival_score']:.3f} against {mount['score']:.3f}): the coarse "
            "mount may be a block off; measure the coarse lever arm again"
        )
    return found


def _inconsistency(summary: Any, cells: pd.DataFrame) -> str:
    """The cell that lies off most; and whether the other sensor lies off there as well."""
    worst = cells.iloc[int(cells["normalised"].abs().argmax())]
    place = (cells["family"] == worst["family"]) & (cells["pass"] == worst["pass"])
    other = cells[place & (cells["sensor"] != worst["sensor"])]["mean_m"]
    both = bool(len(other)) and float(other.iloc[0]) * worst["mean_m"] > worst["mean_m"] ** 2 / 4
    one, another = ("the laser", "the sonar") if worst["sensor"] == "laser" else ("the sonar", "the laser")
    also = f" and {another} {1000 * other.iloc[0]:+.1f} mm" if both else ""
    if abs(worst["mean_m"]) > FAR_M:
        cause = "a wrong target.a, b, c or e, or a coarse mount farther off than segment searches"
    elif both:
        cause = "drift of the INS in that pass, or its clock: sail again, in shorter time"
    elif worst["sensor"] == "mbes":
        cause = "the sonar's clock, the sound speed, or a bracket that moved"
    else:
        cause = "a wrong laser.mount, the laser's clock, or INS drift between the passes"
    return (
        f"the passes do not agree: in pass {worst['pass']} {one} lies {1000 * worst['mean_m']:+.1f} mm{also} "
        f"off {worst['family']} (statistic {summary['test_statistic']:.0f}, limit {summary['test_limit']:.0f}); likely "
        f"{cause}"
    )


def _wide_sigmas(sigma: Mapping[str, float] | None, limits: config.Verdict) -> list[str]:
    if sigma is None:
        return ["the adjustment has no covariance"]
    bounds = {"deg": (limits.max_sigma_deg, "°"), "m": (limits.max_sigma_m, " m")}
    return [
        f"sigma of {SIX[place]} is {sigma[key]:.4g}{bounds[unit][1]}, above the limit of "
        f"{bounds[unit][0]:g}{bounds[unit][1]}"
        for _, place, key, unit in PARAMETERS
        if sigma[key] > bounds[unit][0]
    ]


def _patent(chosen: str, row: Any, methods: Mapping[str, Mapping[str, Any]], limits: config.Verdict) -> list[str]:
    """The patent's forms have no sigma: they must have converged and agree with the adjustment to the limits."""
    if row["reason"]:
        return [f"{chosen} has no result: {row['reason']}"]
    if not row["converged"]:
        return [f"{chosen} did not converge in {row['iterations']} turns"]
    ours, theirs = methods[chosen]["correction"], methods["adjustment"]["correction"]
    bounds = {"rotation_vector_deg": (limits.max_sigma_deg, "°", 0), "lever_arm_m": (limits.max_sigma_m, " m", 3)}
    return [
        f"{chosen} differs from the adjustment by {a - b:+.4f}{unit} in {SIX[first + k]}, more than {limit:g}{unit}"
        for part, (limit, unit, first) in bounds.items()
        for k, (a, b) in enumerate(zip(ours[part], theirs[part], strict=True))
        if abs(a - b) > limit
    ]


def warnings(groups: pd.DataFrame, target: Mapping[str, Any]) -> list[str]:
    """What does not reject a session, and still wants to be looked at before anyone leaves."""
    found = []
    for row in groups.to_dict("records"):
        factor, cut = row["variance_factor"], row["cut"] / max(row["count"], 1)
        if row["group"] in SHARED:
            if factor > ODD_COMMON:
                found.append(SHARED[row["group"]].format(np.sqrt(factor)))
            continue
        name = WORDS_OF_GROUP[row["group"]]
        if (factor > ODD_FACTOR or factor < 1 / ODD_FACTOR):
            how = "more" if factor > 1 else "less"
            found.append(
                f"{name} scatter {np.sqrt(factor):.1f} times as much as the session's sigmas say: {how} noise, or a "
                "target that is not as configured"
            )
        if cut > ODD_CUT:
            found.append(f"{100 * cut:.1f} % of {name} were cut as outliers: look at the residuals of the faces")
    x, y, z = target["offset_m"]
    tilts = target["tilt_deg"]
    if max(abs(x), abs(y), abs(z)) > ODD_OFFSET_M or max(map(abs, tilts)) > ODD_TILT_DEG:
        found.append(
            f"the target was found {x:+.2f}, {y:+.2f}, {z:+.2f} m (x, y, z) from target.origin, out of plumb by "
            f"{tilts[0]:+.2f}° and {tilts[1]:+.2f}°: if it was set up and surveyed better than this, check laser.mount"
        )
    return found


def distance_advice(distances_m: Sequence[float]) -> str:
    """What to sail when all passes lie at about one distance; empty otherwise."""
    if not distances_m or np.ptp(distances_m) >= NEAR_M:
        return ""
    low, high = min(distances_m), max(distances_m)
    if len(distances_m) == 1:
        return f"one pass alone has soundings, at {low:.1f} m: sail passes at different distances, such as 4 m and 8 m"
    return (
        f"all passes lie at {low:.1f} to {high:.1f} m, where yaw and lever arm y are hard to tell apart: sail passes "
        "at different distances, such as 4 m and 8 m"
    )
