"""Tests of the rows of table ``patterns``, with one limit for all rows; the test whether the passes agree."""

from typing import Any

import pandas as pd

from pipeline.maths.adjustment.mean_tests import joint_limit

OF_PASSES = ("drift", "pass")


def limit_for(patterns: pd.DataFrame, level: float) -> float:
    """Return the limit of |normalised|. If all errors are tolerated, any row exceeds it with the chance ``level``."""
    return joint_limit(len(patterns), level)


def pattern_tests(patterns: pd.DataFrame, level: float) -> list[dict[str, Any]]:
    """Return one test for each variable: the largest |normalised|, the number of rows (``dof``), and the limit."""
    limit, tests = limit_for(patterns, level), []
    for by, rows in patterns.groupby("by", sort=True):
        statistic = float(rows["normalised"].abs().max())
        tests.append(
            {"by": str(by), "statistic": statistic, "dof": len(rows), "limit": limit, "passed": statistic <= limit}
        )
    return tests


def passes_test(patterns: pd.DataFrame, level: float) -> dict[str, Any]:
    """Return the test whether the passes agree: the largest |normalised| by pass or drift, and the common limit."""
    rows, limit = patterns[patterns["by"].isin(OF_PASSES)], limit_for(patterns, level)
    statistic = float(rows["normalised"].abs().max()) if len(rows) else 0.0
    return {"statistic": statistic, "dof": len(rows), "limit": limit, "passed": statistic <= limit}
