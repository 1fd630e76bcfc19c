"""Reasons from mean residuals that deviate by more than their noise and a tolerance.

Every row of the table ``patterns`` is a mean or the difference of two means. Its column ``normalised`` is the normal
deviate of the excess over the tolerance (``maths/adjustment/mean_tests.py``). All rows have one limit. If no true mean
exceeds the tolerance, the chance that any row exceeds the limit is at most the test's level. A row beyond the limit
deviates.

A deviation of a part of the points (a pass, a face, a step at an angle or height, one ping of two) is a hypothesis of
its own, beside the parameters of table ``freed``. Its ``strength`` is comparable with theirs: the mean over its sigma,
without tolerance; for a pass also the change of the mount without that pass, over all mount parameters (table
``parts``), because a pass may be wrong in more ways than one mean shows.

There is at most one reason for the passes, and one for all other variables. The first describes the row that deviates
most, a pass or the drift in one. The second describes the strongest part of the points, or, if none deviates, the row
that deviates most (by angle, distance or time). Each names the other variables.
"""

from dataclasses import dataclass

import pandas as pd

from pipeline.adjustment.pattern_tests import OF_PASSES, limit_for
from pipeline.report.reason_codes import Statement
from pipeline.report.residual_words import CYCLE, ExceededTests, ResidualTests, Row, describe_pass, describe_pattern

# A deviation by these concerns a part of the points.
LOCAL = ("face", "step", "height", "pass", "ping_2", "ping_3", "ping_4")


@dataclass(frozen=True)
class Deviation:
    """A reason from residuals.

    Attributes
    ----------
    statement : code and words
    excess : excess over the tolerance, in sigmas
    strength : as a hypothesis on a part of the points, in sigmas; 0 for a deviation by angle, distance or time, which
        only shows that something is wrong
    """

    statement: Statement
    excess: float
    strength: float


@dataclass(frozen=True)
class DeviatingPart:
    """A part of the points that deviates (pass, face, step, height, ping, drift in a pass), its name and strength."""

    kind: str
    name: str
    strength: float


def deviations(tests: ResidualTests, parts: pd.DataFrame, level: float) -> list[Deviation]:
    """Return at most two deviations, the stronger first: one of the passes, one of all else.

    Parameters
    ----------
    tests : means and their tests
    parts : table ``parts``
    level : level of the test
    """
    exceeded = _exceeded(tests, level)
    of_passes, others = _farthest_rows(exceeded, parts)
    reasons = []
    if of_passes:
        reasons.append(_deviation(of_passes, describe_pass(of_passes[0], exceeded), parts))
    if others:
        reasons.append(_deviation(others, describe_pattern(others[0], exceeded), parts))
    return sorted(reasons, key=lambda deviation: (-deviation.strength, -deviation.excess))


def deviating_parts(tests: ResidualTests, parts: pd.DataFrame, level: float) -> list[DeviatingPart]:
    """Return the pass or drift that the reason describes, and of each other variable the part that deviates most.

    Parameters
    ----------
    tests, parts, level
        As for :func:`deviations`.
    """
    of_passes, others = _farthest_rows(_exceeded(tests, level), parts)
    found = []
    for row in [*of_passes[:1], *others]:
        if strength := _strength(row, parts):
            by, name = str(row["by"]), f"{row['low']:g}"
            if by.startswith(CYCLE):
                by, name = "ping", by.removeprefix(CYCLE)
            found.append(DeviatingPart(by, tests.face_names[int(row["low"])] if by == "face" else name, strength))
    return found


def _exceeded(tests: ResidualTests, level: float) -> ExceededTests:
    limit = limit_for(tests.patterns, level)
    return ExceededTests(tests, tests.patterns[tests.patterns["normalised"].abs() > limit], limit)


def _farthest_rows(exceeded: ExceededTests, parts: pd.DataFrame) -> tuple[list[Row], list[Row]]:
    """Return each variable's row that deviates most: of passes, the largest first; of all else, the strongest first."""
    is_of_passes = exceeded.rows["by"].isin(OF_PASSES)
    of_passes, others = (_farthest_of_each(exceeded.rows[rows]) for rows in (is_of_passes, ~is_of_passes))
    others.sort(key=lambda row: -_strength(row, parts))  # stable: those without one stay behind, in their order
    return of_passes, others


def _farthest_of_each(rows: pd.DataFrame) -> list[Row]:
    """Return for each variable the row that deviates most, ordered from the largest deviation to the smallest."""
    farthest: list[Row] = [
        group.iloc[int(group["normalised"].abs().argmax())].to_dict() for _, group in rows.groupby("by", sort=True)
    ]
    return sorted(farthest, key=lambda row: -abs(row["normalised"]))


def _deviation(rows: list[Row], statement: Statement, parts: pd.DataFrame) -> Deviation:
    """Return the deviation of the first row. The words of its ``statement`` get the variables of the other rows."""
    first, others = rows[0], [str(row["by"]) for row in rows[1:]]
    more = f"; residuals by {' and '.join(others)} lie beyond it too" if others else ""
    return Deviation(
        statement=Statement(statement.code, f"{statement.words}{more}"),
        excess=abs(float(first["normalised"])),
        strength=_strength(first, parts),
    )


def _strength(row: Row, parts: pd.DataFrame) -> float:
    if row["by"] == "drift":
        return abs(float(row["normalised"]))
    if row["by"] not in LOCAL:
        return 0.0
    strength = abs(float(row["mean_m"] / row["sigma_mean_m"]))
    if row["by"] == "pass":
        without = parts.loc[parts["part"] == f"without pass {int(row['low'])}", "normalised"]
        strength = max([strength, *without.tolist()])
    return strength
