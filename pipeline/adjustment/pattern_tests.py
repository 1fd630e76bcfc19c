"""Tests of the table patterns: all its rows have one limit; whether the passes agree."""

from typing import Any

import pandas as pd

from pipeline.maths.adjustment.mean_tests import limit_of

OF_PASSES = ("drift", "pass")


def limit_for(patterns: pd.DataFrame, level: float) -> float:
    """|normalised| that no row exceeds, but with a chance of ``level``."""
    return limit_of(len(patterns), level)


def pattern_tests(patterns: pd.DataFrame, level: float) -> list[dict[str, Any]]:
    """By what the residuals were sorted: the largest |normalised|, of how many (dof), and the limit for all of them."""
    limit, found = limit_for(patterns, level), []
    for by, rows in patterns.groupby("by", sort=True):
        statistic = float(rows["normalised"].abs().max())
        found.append(
            {"by": str(by), "statistic": statistic, "dof": len(rows), "limit": limit, "passed": statistic <= limit}
        )
    return found


def passes_test(patterns: pd.DataFrame, level: float) -> dict[str, Any]:
    """Whether the passes agree: the largest |normalised| by pass or drift, and the limit for all rows."""
    rows, limit = patterns[patterns["by"].isin(OF_PASSES)], limit_for(patterns, level)
    statistic = float(rows["normalised"].abs().max()) if len(rows) else 0.0
    return {"statistic": statistic, "dof": len(rows), "limit": limit, "passed": statistic <= limit}
