"""Descriptions of deviating residuals and their likely causes, in words."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.maths.adjustment.parameters import kind_of
from pipeline.report.reason_codes import ReasonCode, Statement

CYCLE = "ping_"  # before the length of the cycle in pings
MAX_DRIFT_M = 0.05  # a larger mean residual is no effect of drift: the model is wrong
SAME_STEP_DEG = 3.0  # steps at angles that differ by less are one step
NEAR_WATER_M = 0.6  # a step farther from the water is not due to it
TURNS = {"turn_x": "pitch", "turn_y": "roll", "turn_z": "heading"}  # the track runs along y of the target
Row = Mapping[Any, Any]  # a row of the table patterns


@dataclass(frozen=True, kw_only=True)
class ResidualTests:
    """Tested means, and the further data of their description.

    Attributes
    ----------
    patterns : the table
    face_names : names of the faces by number
    shape : names of the settings of the target's shape, in words
    """

    patterns: pd.DataFrame
    face_names: list[str]
    shape: str


@dataclass(frozen=True)
class ExceededTests:
    """Rows that exceed the ``limit``, with all tests."""

    tests: ResidualTests
    rows: pd.DataFrame
    limit: float

    def outcome(self, row: Row) -> str:
        """Return in words how far a row exceeds the tolerance, and the limit."""
        excess = abs(float(row["normalised"]))
        beyond = f"{excess:.1f} sigma beyond {round(1000 * float(row['tolerated_m']), 1):g} mm"
        if row["by"] == "drift":
            beyond = f"{excess:.1f} times the drift that is allowed"
        return f"{beyond}, limit {self.limit:.1f}"


def sensor_words(sensor: str) -> str:
    """Return words for a sensor.

    >>> sensor_words("mbes"), sensor_words("mbes_2")
    ('the sonar', 'the sonar mbes_2')
    """
    return {"laser": "the laser", "mbes": "the sonar"}.get(sensor, f"the sonar {sensor}")


# --- passes ------------------------------------------------------------------------------------------------------
def describe_pass(row: Row, exceeded: ExceededTests) -> Statement:
    """Return a reason that describes a pass that deviates, and whether the other sensor deviates there, too."""
    if row["by"] == "drift":
        return _drift(row, exceeded)
    patterns = exceeded.tests.patterns
    means, number = patterns[patterns["by"] == "pass"], int(row["low"])
    of_other = (means["family"] == row["family"]) & (means["low"] == row["low"]) & (means["sensor"] != row["sensor"])
    of_other &= means["sensor"].map(kind_of) != kind_of(row["sensor"])
    other_m = means[of_other]["mean_m"]
    is_of_both = bool(len(other_m)) and float(other_m.iloc[0]) * row["mean_m"] > row["mean_m"] ** 2 / 4
    other_sensor = sensor_words("mbes" if row["sensor"] == "laser" else "laser")
    also = f" and {other_sensor} {1000 * other_m.iloc[0]:+.1f} mm" if is_of_both else ""
    if abs(row["mean_m"]) > MAX_DRIFT_M:
        cause = f"wrong {exceeded.tests.shape}, or a coarse mount farther off than segment searches"
    elif is_of_both:
        cause = "drift of the INS in that pass, or its clock: sail again, in shorter time"
    elif kind_of(row["sensor"]) == "mbes":
        cause = "the sonar's clock, the sound speed, or a bracket that moved"
    else:
        cause = "a wrong laser.mount, the laser's clock, or INS drift between the passes"
    return Statement(
        ReasonCode.PASSES_DISAGREE,
        f"the passes do not agree: in pass {number} {sensor_words(row['sensor'])} lies {1000 * row['mean_m']:+.1f} "
        f"mm{also} off {row['family']} against the other passes ({exceeded.outcome(row)}); likely {cause}",
    )


def _drift(row: Row, exceeded: ExceededTests) -> Statement:
    """Return a reason that describes a pass in which the INS would have to drift too far."""
    turn = f"{abs(np.degrees(row['mean_m'])):.3f}° in {TURNS[str(row['family'])]}"
    return Statement(
        ReasonCode.INS_DRIFT_BETWEEN_PASSES,
        f"the passes do not agree: for both sensors to fit in pass {int(row['low'])}, the INS must be wrong there by "
        f"{turn} more than in the other passes ({exceeded.outcome(row)}); likely a bracket that moved in that pass, a "
        "sensor's clock, or ins.drift is too small",
    )


# --- everything else ---------------------------------------------------------------------------------------------
def describe_pattern(row: Row, exceeded: ExceededTests) -> Statement:
    """Return a reason that describes a deviation by face, angle, height, ping, distance or time."""
    variable, low, high = row["by"], row["low"], row["low"] + row["width"]
    if variable == "step":
        return _step(row, exceeded)
    if variable.startswith(CYCLE):
        return _cycle(row, exceeded)
    seen, outcome = sensor_words(row["sensor"]), exceeded.outcome(row)
    lies = f"{seen} lies {1000 * row['mean_m']:+.1f} mm off {row['family']} ({outcome})"
    if variable == "face":
        return Statement(
            ReasonCode.RESIDUALS_BY_FACE,
            f"residuals go with face: on face {exceeded.tests.face_names[int(low)]} {lies}; likely that face is not "
            "where the config has it: survey it (as_built.faces), and see what stands before it",
        )
    if variable == "angle":
        angles = "receive angles" if kind_of(row["sensor"]) == "mbes" else "elevations"
        words = f"residuals go with angle: between {angles} {low:.0f}° and {high:.0f}° {lies}"
        return Statement(ReasonCode.RESIDUALS_BY_ANGLE, words)
    if variable == "height":
        return _height(row, exceeded)
    if variable == "distance":
        words = f"residuals go with distance: from {low:.0f} to {high:.0f} m {lies}"
        return Statement(ReasonCode.RESIDUALS_BY_DISTANCE, words)
    words = f"residuals go with time: for ten seconds (GPS {low:.0f}) {lies}"
    return Statement(ReasonCode.RESIDUALS_BY_TIME, words)


def _cycle(row: Row, exceeded: ExceededTests) -> Statement:
    """Return a reason that describes pings that deviate in a cycle.

    If a sonar changes its mode from ping to ping, and the fans of the modes have different tilts, whole pings are
    displaced along the track.
    """
    pings = int(row["by"].removeprefix(CYCLE))
    which = f"one ping of {pings} (those whose number divided by {pings} leaves {row['low']:.0f})"
    return Statement(
        ReasonCode.RESIDUALS_BY_PING,
        f"residuals go with pings: in {which} {sensor_words(row['sensor'])} lies {1000 * row['mean_m']:+.1f} mm off "
        f"{row['family']} against the other pings ({exceeded.outcome(row)}); likely modes taken in turn (frequencies, "
        "swaths) whose transmit fans have different tilts: give each sounding its tilt (column transmit_tilt_deg of a "
        "table), or record in a single mode",
    )


def _height(row: Row, exceeded: ExceededTests) -> Statement:
    """Return a reason that describes a step of a sensor's distances from one face at a height."""
    height_m = float(row["low"])
    where = f"{abs(height_m):.1f} m {'above' if height_m > 0 else 'below'} the water"
    if abs(height_m) > NEAR_WATER_M:
        cause = "an edge beside these points, or what stands before the face: keep off by segment.margin_m"
    elif kind_of(row["sensor"]) == "mbes":
        cause = "echoes by way of the water's surface, or bubbles: keep off by segment.water_margin_m"
    else:
        cause = "drops, weed or a wet face: keep off by segment.water_margin_m"
    if kind_of(row["sensor"]) == "mbes":
        cause += "; or beams wider than session.yaml says (mbes.focused, beam_deg)"
    return Statement(
        ReasonCode.RESIDUALS_BY_HEIGHT,
        f"residuals go with height: {where} {sensor_words(row['sensor'])}'s distance from face {row['family']} steps "
        f"by {1000 * row['mean_m']:+.1f} mm, above less below ({exceeded.outcome(row)}); likely {cause}",
    )


def _step(row: Row, exceeded: ExceededTests) -> Statement:
    """Return a reason that describes a step of the sonar's distances at one receive angle.

    If the steps of two families at one angle have opposite signs, soundings are displaced along the track: a face that
    looks to one side then seems too near, and a face that looks to the other side too far.
    """
    rows = exceeded.rows
    steps = rows[(rows["by"] == "step") & ((rows["low"] - row["low"]).abs() <= SAME_STEP_DEG)]
    opposite = steps[(steps["family"] != row["family"]) & (steps["mean_m"] * row["mean_m"] < 0)]
    also, cause = "", "a sector of the fan, or a detection, whose ranges or angles differ from the rest"
    if len(opposite):
        other = opposite.loc[opposite["normalised"].abs().idxmax()]
        also = f", and from {other['family']} by {1000 * other['mean_m']:+.1f} mm"
        cause = (
            "transmit sectors of different tilt: the soundings on one side of it lie farther forward than those on the "
            "other; give each its tilt (column transmit_tilt_deg of a table), or record with a single sector"
        )
    return Statement(
        ReasonCode.RESIDUALS_STEP,
        f"residuals go with angle: at a receive angle of {row['low']:.0f}° {sensor_words(row['sensor'])}'s distance "
        f"from {row['family']} steps by {1000 * row['mean_m']:+.1f} mm{also} ({exceeded.outcome(row)}); likely {cause}",
    )
