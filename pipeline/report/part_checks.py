"""Whether the mount from a part of the session agrees with that of the whole session (table ``parts``)."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.reason_codes import ReasonCode, Statement, named


def parts_block(parts: pd.DataFrame, level: float) -> list[dict[str, Any]]:
    """Return the block ``parts`` of calibration.json: changes and sigmas of each part by setting, and its test.

    Parameters
    ----------
    parts : table ``parts``
    level : level of the test, for all parts together
    """
    limit = joint_limit(len(parts), level)
    return [
        {
            "part": row["part"],
            "passes": [int(number) for number in row["passes"].split()],
            "change": {key: _finite(row[f"change_{name}"]) for name, _, key, _ in PARAMETERS},
            "sigma": {key: _finite(row[f"sigma_{name}"]) for name, _, key, _ in PARAMETERS},
            "test": {
                "statistic": row["normalised"],
                "limit": limit,
                "dof": int(row["dof"]),
                "passed": bool(row["normalised"] <= limit),
            },
        }
        for row in parts.to_dict("records")
    ]


def disagreeing_parts(parts: pd.DataFrame, level: float) -> list[Statement]:
    """Return a reason with the part that differs most significantly from the whole, if any does.

    Parameters
    ----------
    parts : table ``parts``
    level : level of the test, for all parts together
    """
    if not len(parts) or parts["normalised"].max() <= joint_limit(len(parts), level):
        return []
    row = max(parts.to_dict("records"), key=lambda part: float(part["normalised"]))
    each = [(abs(row[f"change_{name}"] / row[f"sigma_{name}"]), name, unit) for name, _, _, unit in PARAMETERS]
    _, name, unit = max(entry for entry in each if np.isfinite(entry[0]))
    change, sigma = (_with_unit(row[f"{kind}_{name}"], unit) for kind in ("change", "sigma"))
    part, head = part_and_head(row["part"])
    if "soundings" in part:  # those on a face
        cause = (
            "that wall or another does not go on below the water as above: see what is there, and strike it "
            "(target.strike)"
        )
    else:
        cause = (
            "something changed during the session (the bracket, a clock, the water, the INS's solution); sail again, "
            "or calibrate the passes apart to find which of them is wrong"
        )
    where = f"{part}," if part.startswith("without") else f"from the {part} alone"
    off = f"{name} would be another by {change} ± {sigma} ({row['normalised']:.1f} sigma over all parameters)"
    return named(head, [Statement(ReasonCode.PARTS_DISAGREE, f"{where} {off}: {cause}")])


def part_and_head(name: str) -> tuple[str, str]:
    """Return the part and the further head of the sonar in a name of table ``parts``; empty if it is of the first.

    >>> part_and_head("first half (mbes_2)"), part_and_head("without pass 3")
    (('first half', 'mbes_2'), ('without pass 3', ''))
    """
    part, _, head = name.partition(" (")
    return part, head.removesuffix(")")


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3f}°" if unit == "deg" else f"{1000 * value:.1f} mm"


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
