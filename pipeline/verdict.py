"""Accepted or rejected, and why: each reason names its evidence."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from pipeline import config

ANGLES = ("pitch", "roll", "yaw")  # rotation vector about body x, y, z


@dataclass(frozen=True)
class Evidence:
    """The tables that a verdict looks at."""

    target_pose: pd.DataFrame
    provisional_mount: pd.DataFrame
    corrections: pd.DataFrame
    summary: pd.DataFrame
    cells: pd.DataFrame
    groups: pd.DataFrame


def reasons(
    evidence: Evidence, sigma: Mapping[str, Any] | None, limits: config.Verdict, method: config.Method
) -> list[str]:
    """Why the calibration is rejected; empty: accepted."""
    found = []
    pose, mount = evidence.target_pose.iloc[0], evidence.provisional_mount.iloc[0]
    if pose["ambiguous"]:
        found.append(
            f"the target's pose is ambiguous: {pose['rival']} fits the laser points nearly as well "
            f"({pose['rival_agreement_m2']:.2f} against {pose['agreement_m2']:.2f} m²); check low_side, "
            "target.origin's height, and that the laser sees the wall's top"
        )
    if mount["ambiguous"]:
        found.append(
            f"the soundings fit two ways (score {mount['rival_score']:.3f} against {mount['score']:.3f}): the coarse "
            "mount may be a block off; measure the coarse lever arm again"
        )
    summary = evidence.summary.iloc[0]
    if summary["reason"]:
        found.append(f"the adjustment has no result: {summary['reason']}; sail more passes, at different distances")
    elif not summary["converged"]:
        found.append(f"the adjustment did not converge in {summary['iterations']} steps")
    if not summary["reason"] and not summary["test_passed"]:
        found.append(_inconsistency(summary, evidence.cells))
    if sigma is not None:
        values = [
            (name, v, limits.max_sigma_deg, "°") for name, v in zip(ANGLES, sigma["rotation_vector_deg"], strict=True)
        ]
        values += [
            (f"lever arm {axis}", v, limits.max_sigma_m, " m")
            for axis, v in zip("xyz", sigma["lever_arm_m"], strict=True)
        ]
        found += [
            f"sigma of {name} is {value:.4f}{unit}, above the limit of {limit:g}{unit}; {summary['weakest']}"
            for name, value, limit, unit in values
            if value > limit
        ]
    if method != "adjustment":
        row = evidence.corrections.set_index("method").loc[method]
        if row["reason"]:
            found.append(f"{method} has no result: {row['reason']}")
        elif not row["converged"]:
            found.append(f"{method} did not converge in {row['iterations']} turns")
    return found


def _inconsistency(summary: Any, cells: pd.DataFrame) -> str:
    worst = cells.iloc[int(cells["normalised"].abs().argmax())]
    sensor = "the laser" if worst["sensor"] == "laser" else "the sonar"
    return (
        f"the passes do not agree: in pass {worst['pass']} {sensor} lies {1000 * worst['mean_m']:+.1f} mm off "
        f"{worst['family']} (statistic {summary['test_statistic']:.0f}, limit {summary['test_limit']:.0f}); likely INS "
        "drift, a clock, the sound speed, or a moved bracket"
    )
