"""Mean residuals that deviate by more than noise and a tolerance: which, by how much, and what the cause may be.

Every row of the table ``patterns`` is one mean, or the difference of two, with its normal_deviates excess over the
tolerance (``maths/adjustment/mean_tests.py``). All rows together have one limit: where nothing is beyond the tolerance,
the chance that any row exceeds it is at most the test's level. The rows that exceed it deviate. The farthest of each
variable is named, and the farthest of all comes first.
"""

from dataclasses import dataclass

import pandas as pd

from pipeline.adjustment.pattern_tests import OF_PASSES, limit_for
from pipeline.report.reason_codes import Statement
from pipeline.report.residual_words import ExceededTests, ResidualTests, Row, describe_pass, describe_pattern

LOCAL = ("face", "step", "pass", "ping_2", "ping_3", "ping_4")  # a deviation may concern a part of the points


@dataclass(frozen=True)
class Deviation:
    """A reason from residuals.

    Attributes
    ----------
    statement : code and words
    excess : sigmas beyond the tolerance
    is_local : whether only a part of the points deviates (a face, a step): a parameter of all points does not explain
        that
    """

    statement: Statement
    excess: float
    is_local: bool


def deviations(tests: ResidualTests, level: float) -> list[Deviation]:
    """Return what deviates at a test's ``level``, the farthest first: one of the passes, one of everything else."""
    limit = limit_for(tests.patterns, level)
    exceeded = ExceededTests(tests, tests.patterns[tests.patterns["normalised"].abs() > limit], limit)
    is_of_passes = exceeded.rows["by"].isin(OF_PASSES)
    reasons = []
    for rows, describe in ((is_of_passes, describe_pass), (~is_of_passes, describe_pattern)):
        farthest = _farthest_of_each(exceeded.rows[rows])
        if farthest:
            reasons.append(_deviation(farthest, describe(farthest[0], exceeded)))
    return sorted(reasons, key=lambda deviation: -deviation.excess)


def _farthest_of_each(rows: pd.DataFrame) -> list[Row]:
    """Return the row of each variable that deviates most; the farthest of all first."""
    farthest: list[Row] = [
        group.iloc[int(group["normalised"].abs().argmax())].to_dict() for _, group in rows.groupby("by", sort=True)
    ]
    return sorted(farthest, key=lambda row: -abs(row["normalised"]))


def _deviation(farthest: list[Row], statement: Statement) -> Deviation:
    """Return the deviation of the first row, with its ``statement``, and name the variables of the other rows."""
    first, others = farthest[0], [str(row["by"]) for row in farthest[1:]]
    more = f"; residuals by {' and '.join(others)} lie beyond it too" if others else ""
    return Deviation(
        statement=Statement(statement.code, f"{statement.words}{more}"),
        excess=abs(float(first["normalised"])),
        is_local=first["by"] in LOCAL,
    )
