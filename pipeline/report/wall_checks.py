"""Checks of walls that nobody has surveyed: faces that are left out, and walls that are rough."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from pipeline.config.verdict import VerdictLimits
from pipeline.maths.adjustment.parameters import kind_of
from pipeline.report.calibration_document import json_number
from pipeline.report.cause_words import size_words
from pipeline.report.evidence import Evidence
from pipeline.report.noise_warnings import points_of
from pipeline.report.reason_codes import ReasonCode, Statement, named
from pipeline.report.unseen_faces import unseen_face_error

LEAST_PATCH_M = 0.001  # RMS of a wall's patches that is worth a word
SEEN_BY = {"laser": "above the water", "mbes": "below the water"}


def unsurveyed_walls(evidence: Evidence, limits: VerdictLimits) -> list[Statement]:
    """Return the warnings about walls that nobody has surveyed; ``limits``: those of the verdict."""
    return [
        *faces_left_out(evidence.left_out),
        *rough_walls(evidence.groups),
        *unseen_face_error(evidence.freed, limits),
    ]


def faces_left_out(left_out: pd.DataFrame) -> list[Statement]:
    """Return a warning for each face, or stripe of it, whose points are left out (table ``left_out``)."""
    rows = left_out[left_out["why"] != "doubt"].to_dict("records")
    return [Statement(ReasonCode.FACE_LEFT_OUT, _words(row)) for row in rows]


def faces_in_doubt(left_out: pd.DataFrame) -> list[Statement]:
    """Return a reason if faces contradict one another, and nobody can tell which of them is wrong."""
    rows = left_out[left_out["why"] == "doubt"].to_dict("records")
    if not rows:
        return []
    suspects = "; or ".join(_off_words(row) for row in rows)
    words = (
        f"below the water the faces contradict one another. It may be this: {suspects}. But too few faces are seen to "
        "tell which is wrong, or whether a sensor is: see what is there and strike the face (target.strike), or pass "
        "more walls"
    )
    return [Statement(ReasonCode.FACES_IN_DOUBT, words)]


def left_out_block(left_out: pd.DataFrame) -> dict[str, Any]:
    """Return the block ``left_out`` of calibration.json, a row for each face, stripe or squares of it; or nothing.

    Heights are m above the water, null at the end of the face.
    """
    rows = [
        {"family": row["family"], "why": row["why"], "sensor": row["sensor"], "points": int(row["points"])}
        | {name: json_number(row[name]) for name in ("low_m", "high_m")}
        | ({name: json_number(row[name]) for name in ("area_m2", "share")} if row["why"] == "mixed" else {})
        | {"words": _words(row)}
        for row in left_out[left_out["why"] != "doubt"].to_dict("records")
    ]
    return {"left_out": rows} if rows else {}


def _words(row: dict[Any, Any]) -> str:
    points, family, number = points_of(row["sensor"]), row["family"], int(row["points"])
    if row["why"] == "few":
        return (
            f"the soundings on {family} are left out, for they are too few to trust ({number}): below the water the "
            "wall is not where it stands above, or the fan does not cover it"
        )
    if row["why"] == "scatter":
        return (
            f"the soundings on {family} are left out ({number}): they lie all over the gate, as where no wall is; look "
            "at what stands there below the water"
        )
    if row["why"] == "mixed":
        return (
            f"the {points} on {row['area_m2']:.1f} m² of {family}, {_heights(row)}, are left out ({number}, "
            f"{100 * row['share']:.0f} % of those on it): pass after pass many of a square lie to one side, as where a "
            "ladder, a rope or a ledge stands before the wall; the map of the residuals shows where"
        )
    if row["why"] == "step":
        return (
            f"the {points} on {family} {_heights(row)} are left out ({number}): there the wall stands off its plane by "
            f"{1000 * row['value']:+.0f} mm (a footing, a ledge, growth, splash)"
        )
    contradicted = f"the soundings on {family} are left out ({number}), for the other faces contradict them"
    return f"{contradicted}: likely {_off_words(row)}"


def _off_words(row: dict[Any, Any]) -> str:
    """Return in words what is wrong with a face below the water, against its part above."""
    family, unknown, value, sigma = row["family"], str(row["unknown"]), float(row["value"]), float(row["sigma"])
    if not unknown:
        return f"{family} is no plane there"
    if unknown.endswith("_shift"):
        size = size_words(1e3 * abs(value), 1e3 * sigma, "mm").removeprefix("+")
        way = "toward the boat" if value > 0 else "back"
        return f"{family} stands there {size} farther {way} than above"
    if unknown.endswith("_bow"):
        return f"{family} is bowed there by {size_words(1e3 * value, 1e3 * sigma, 'mm')} at half depth"
    return f"{family} is turned there by {size_words(np.degrees(value), np.degrees(sigma), '°')} against its part above"


def _heights(row: dict[Any, Any]) -> str:
    low, high = float(row["low_m"]), float(row["high_m"])
    if np.isinf(low) and np.isinf(high):
        return "at all heights"
    if row["sensor"] == "laser":
        if np.isinf(low):
            return f"up to {max(high, 0.0):.1f} m above the water"
        if np.isinf(high):
            return f"from {low:.1f} m above the water up"
        return f"from {low:.1f} to {high:.1f} m above the water"
    if np.isinf(low):
        return f"from {max(-high, 0.0):.1f} m below the water down"
    if np.isinf(high):
        return f"down to {-low:.1f} m below the water"
    return f"from {max(-high, 0.0):.1f} to {-low:.1f} m below the water"


def rough_walls(groups: pd.DataFrame) -> Iterator[Statement]:
    """Yield a warning for each sensor to which walls are rough (table ``groups``); bottoms are none."""
    groups = groups[groups["family"].isin(groups["family"][groups["sensor"] == "laser"])]
    for sensor, of_sensor in groups.groupby("sensor", sort=True):
        rows, where = of_sensor[of_sensor["patch_m"] >= LEAST_PATCH_M], SEEN_BY[kind_of(str(sensor))]
        walls = ", ".join(f"{row['family']} by {1000 * row['patch_m']:.0f} mm" for row in rows.to_dict("records"))
        if walls:
            words = (
                f"{where}, patches of the walls stand off their planes ({walls}): fouled, or of rough stone; the "
                "sigmas allow for it, and a cleaner wall gives smaller ones"
            )
            head = "" if sensor in SEEN_BY else str(sensor)
            yield from named(head, [Statement(ReasonCode.ROUGH_WALL, words)])
