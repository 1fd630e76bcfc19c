"""Accepted or rejected, and why: each reason names its evidence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline import config

SIX = ("pitch", "roll", "yaw", "lever arm x", "lever arm y", "lever arm z")  # body x, y, z
FAR_M = 0.05  # a mean residual beyond this is no drift: the model is another
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
    if cells.loc[cells["sensor"] == "mbes", "pass"].nunique() < 2:
        found.append(
            "only one pass has soundings on the target, so that drift of the INS or a clock cannot show: sail at least "
            "two, at different distances"
        )
    if not summary["test_passed"]:
        found.append(_inconsistency(summary, cells))
    found += _wide_sigmas(methods["adjustment"]["sigma"], limits)
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
    worst = cells.iloc[int(cells["normalised"].abs().argmax())]
    sensor = "the laser" if worst["sensor"] == "laser" else "the sonar"
    cause = "INS drift, a clock, the sound speed, a moved bracket, or a wrong laser.mount"
    if abs(worst["mean_m"]) > FAR_M:
        cause = "a wrong target.a, b, c or e, or a coarse mount farther off than segment searches"
    return (
        f"the passes do not agree: in pass {worst['pass']} {sensor} lies {1000 * worst['mean_m']:+.1f} mm off "
        f"{worst['family']} (statistic {summary['test_statistic']:.0f}, limit {summary['test_limit']:.0f}); likely "
        f"{cause}"
    )


def _wide_sigmas(sigma: Mapping[str, Any] | None, limits: config.Verdict) -> list[str]:
    if sigma is None:
        return ["the adjustment has no covariance"]
    values = [*sigma["rotation_vector_deg"], *sigma["lever_arm_m"]]
    bounds = [(limits.max_sigma_deg, "°")] * 3 + [(limits.max_sigma_m, " m")] * 3
    return [
        f"sigma of {name} is {value:.4g}{unit}, above the limit of {limit:g}{unit}"
        for name, value, (limit, unit) in zip(SIX, values, bounds, strict=True)
        if value > limit
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


def distance_advice(distances_m: Sequence[float]) -> str:
    """What to sail when all passes lie at about one distance; empty otherwise."""
    if not distances_m or np.ptp(distances_m) >= NEAR_M:
        return ""
    low, high = min(distances_m), max(distances_m)
    return (
        f"all passes lie at {low:.1f} to {high:.1f} m, where yaw and lever arm y are hard to tell apart: sail passes "
        "at different distances, such as 4 m and 8 m"
    )
