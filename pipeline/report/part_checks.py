"""Whether the mount from a part of the session agrees with that of the whole session (table ``parts``)."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.reason_codes import ReasonCode, Statement


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
    if "soundings" in row["part"]:  # those on a face
        cause = (
            "that wall or another does not go on below the water as above: see what is there, and strike it "
            "(target.strike)"
        )
    else:
        cause = (
            "something changed during the session (the bracket, a clock, the water, the INS's solution); sail again, "
            "or calibrate the passes apart to find which of them is wrong"
        )
    where = f"{row['part']}," if row["part"].startswith("without") else f"from the {row['part']} alone"
    off = f"{name} would be another by {change} ± {sigma} ({row['normalised']:.1f} sigma over all parameters)"
    words = f"{where} {off}: {cause}"
    return [Statement(ReasonCode.PARTS_DISAGREE, words)]


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3f}°" if unit == "deg" else f"{1000 * value:.1f} mm"


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
