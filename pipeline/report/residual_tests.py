"""Residuals that lie off by more than noise and a tolerance: which, by how much, and what that may come from.

Every row of the table ``patterns`` is one mean, or the difference of two, with its normal_deviates excess over the
tolerance (``maths/adjustment/mean_tests.py``). All rows together have one limit: where nothing is beyond the tolerance,
the chance that any row exceeds it is at most the test's level. The rows that exceed it say what is off; of each
variable the farthest is named, and the farthest of all comes first.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.pattern_tests import OF_PASSES, limit_for

CYCLE = "ping_"  # and the number of pings in turn
ALONE = ("face", "step", "pass", "ping_2", "ping_3", "ping_4")  # what may be off by itself
CONCEDED = "{:.1f} times the drift that it is conceded"
SENSORS = {"laser": "the laser", "mbes": "the sonar"}
FAR_M = 0.05  # a mean residual beyond this is no drift: the model is another
ALIKE_DEG = 3.0  # steps nearer to each other than this are one
TURNS = {"turn_x": "pitch", "turn_y": "roll", "turn_z": "heading"}  # y of the target is the track
Row = Mapping[Any, Any]


@dataclass(frozen=True)
class Found:
    """One reason; how many sigmas beyond the tolerance; whether it is of some points alone (a face, a step), which what
    is freed for all points alike does not explain."""

    words: str
    excess: float
    alone: bool


@dataclass(frozen=True)
class Tables:
    """What the words are taken from; ``faces``: names by number; ``shape``: the settings that give the target's."""

    patterns: pd.DataFrame
    faces: list[str]
    shape: str
    tolerated_m: float


def off(tables: Tables, level: float) -> list[Found]:
    """What is off, the farthest first; passes and everything else one reason each."""
    limit = limit_for(tables.patterns, level)
    over = tables.patterns[tables.patterns["normalised"].abs() > limit]
    of_passes = over["by"].isin(OF_PASSES)
    found = []
    for rows, told in ((over[of_passes], _pass), (over[~of_passes], _pattern)):
        worst = _worst(rows)
        if worst:
            found.append(_found(worst, told, tables, over, limit))
    return sorted(found, key=lambda one: -one.excess)


def _worst(rows: pd.DataFrame) -> list[Row]:
    """The row of each variable that lies farthest off; the farthest of all first."""
    found: list[Row] = [
        group.iloc[int(group["normalised"].abs().argmax())].to_dict() for _, group in rows.groupby("by", sort=True)
    ]
    return sorted(found, key=lambda row: -abs(row["normalised"]))


def _found(
    worst: list[Row],
    told: Callable[[Row, Tables, pd.DataFrame, str], str],
    tables: Tables,
    over: pd.DataFrame,
    limit: float,
) -> Found:
    first, others = worst[0], [str(row["by"]) for row in worst[1:]]
    excess = abs(float(first["normalised"]))
    beyond = f"{excess:.1f} sigma beyond {1000 * tables.tolerated_m:g} mm"
    test = f"{CONCEDED.format(excess) if first['by'] == 'drift' else beyond}, limit {limit:.1f}"
    more = f"; residuals by {' and '.join(others)} lie beyond it too" if others else ""
    return Found(f"{told(first, tables, over, test)}{more}", excess, first["by"] in ALONE)


# --- passes ------------------------------------------------------------------------------------------------------
def _pass(row: Row, tables: Tables, over: pd.DataFrame, test: str) -> str:
    """The pass that lies off most; and whether the other sensor lies off there as well."""
    if row["by"] == "drift":
        return _drift(row, test)
    cells, number = tables.patterns[tables.patterns["by"] == "pass"], int(row["low"])
    place = (cells["family"] == row["family"]) & (cells["low"] == row["low"]) & (cells["sensor"] != row["sensor"])
    other = cells[place]["mean_m"]
    both = bool(len(other)) and float(other.iloc[0]) * row["mean_m"] > row["mean_m"] ** 2 / 4
    another = SENSORS["mbes" if row["sensor"] == "laser" else "laser"]
    also = f" and {another} {1000 * other.iloc[0]:+.1f} mm" if both else ""
    if abs(row["mean_m"]) > FAR_M:
        cause = f"wrong {tables.shape}, or a coarse mount farther off than segment searches"
    elif both:
        cause = "drift of the INS in that pass, or its clock: sail again, in shorter time"
    elif row["sensor"] == "mbes":
        cause = "the sonar's clock, the sound speed, or a bracket that moved"
    else:
        cause = "a wrong laser.mount, the laser's clock, or INS drift between the passes"
    return (
        f"the passes do not agree: in pass {number} {SENSORS[row['sensor']]} lies {1000 * row['mean_m']:+.1f} mm{also} "
        f"off {row['family']} against the other passes ({test}); likely {cause}"
    )


def _drift(row: Row, test: str) -> str:
    how = f"{abs(np.degrees(row['mean_m'])):.3f}° in {TURNS[str(row['family'])]}"
    return (
        f"the passes do not agree: for both sensors to fit in pass {int(row['low'])}, the INS must be wrong there by "
        f"{how} more than in the other passes ({test}); likely a bracket that moved in that pass, a sensor's clock, or "
        "ins.drift is too small"
    )


# --- everything else ---------------------------------------------------------------------------------------------
def _pattern(row: Row, tables: Tables, over: pd.DataFrame, test: str) -> str:
    by, low, high = row["by"], row["low"], row["low"] + row["width"]
    sensor = SENSORS[row["sensor"]]
    lies = f"{sensor} lies {1000 * row['mean_m']:+.1f} mm off {row['family']} ({test})"
    if by == "step":
        return _step(row, over, test)
    if by == "face":
        name = tables.faces[int(low)]
        return (
            f"residuals go with face: on face {name} {lies}; likely that face is not where the config has it: survey "
            "it (as_built.faces), and see what stands before it"
        )
    if by == "angle":
        what = "receive angles" if row["sensor"] == "mbes" else "elevations"
        return f"residuals go with angle: between {what} {low:.0f}° and {high:.0f}° {lies}"
    if by.startswith(CYCLE):
        return _cycle(row, test)
    if by == "distance":
        return f"residuals go with distance: from {low:.0f} to {high:.0f} m {lies}"
    return f"residuals go with time: for ten seconds (GPS {low:.0f}) {lies}"


def _cycle(row: Row, test: str) -> str:
    """Modes that a sonar takes in turn, whose fans are tilted differently, displace whole pings along the track."""
    pings = int(row["by"].removeprefix(CYCLE))
    which = f"one ping of {pings} (those whose number divided by {pings} leaves {row['low']:.0f})"
    return (
        f"residuals go with pings: in {which} the sonar lies {1000 * row['mean_m']:+.1f} mm off {row['family']} "
        f"against the other pings ({test}); likely modes taken in turn (frequencies, swaths) whose transmit fans have "
        "different tilts: give each sounding its tilt (column transmit_tilt_deg of a table), or record in a single mode"
    )


def _step(row: Row, over: pd.DataFrame, test: str) -> str:
    """Where steps of different families have different signs at one angle, soundings are displaced along the track:
    a face turned to one side then lies too near, one to the other too far."""
    steps = over[(over["by"] == "step") & ((over["low"] - row["low"]).abs() <= ALIKE_DEG)]
    against = steps[(steps["family"] != row["family"]) & (steps["mean_m"] * row["mean_m"] < 0)]
    also, cause = "", "a sector of the fan, or a detection, whose ranges or angles differ from the rest"
    if len(against):
        other = against.loc[against["normalised"].abs().idxmax()]
        also = f", and from {other['family']} by {1000 * other['mean_m']:+.1f} mm"
        cause = (
            "transmit sectors of different tilt: the soundings on one side of it lie farther forward than those on the "
            "other; give each its tilt (column transmit_tilt_deg of a table), or record with a single sector"
        )
    return (
        f"residuals go with angle: at a receive angle of {row['low']:.0f}° the sonar's distance from {row['family']} "
        f"steps by {1000 * row['mean_m']:+.1f} mm{also} ({test}); likely {cause}"
    )
