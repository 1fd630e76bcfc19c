"""Evidence of a good session for the report, and what can be changed in it."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.results import LEFT_OUT
from pipeline.config.verdict import VerdictLimits
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.report.ambiguities import MountSearch
from pipeline.report.evidence import Evidence
from pipeline.report.reason_codes import ReasonCode, Statement
from pipeline.report.verdict import Criteria, rejections

SIGMA = {"roll_deg": 0.002, "pitch_deg": 0.005, "yaw_deg": 0.006, "x_m": 1e-4, "y_m": 6e-4, "z_m": 3e-4}
ZERO = {"rotation_vector_deg": [0.8, -0.8, 0.8], "lever_arm_m": [0.1, 0.1, 0.1]}
FOUND = {"offset_m": [0.0, 0.05, -0.09], "tilt_deg": [0.05, -0.05]}  # of a target that is where it should be
FIGURES = ("horizontal_m", "vertical_m", "roll_pitch_deg", "heading_deg")
OFF = {"normalised": 3.5}  # beyond the limit of one row, 3.29
PASS_3 = {"by": "pass", "low": 3.0, "mean_m": -0.012, "normalised": -4.0}
SEARCH = MountSearch(sensor="mbes", max_angle_deg=4.5, max_lever_arm_m=0.45)
ADJUSTED = Criteria(
    limits=VerdictLimits(), test_level=0.001, method="adjustment", search=SEARCH,
    shape="target.a, b, c, e and low_side",
)  # fmt: skip


def methods(**patent: Any) -> dict[str, Any]:
    """Blocks of the adjustment and of a patent's form, the latter with another correction."""
    adjustment = {"sigma_mount_total": SIGMA, "correction": ZERO, "covariance_total": None}
    return {"adjustment": adjustment, "patent_alternating": {"sigma_mount": None, "correction": ZERO | patent}}


def evidence(
    *,
    pose: Mapping[str, Any] | None = None,
    mount: Mapping[str, Any] | None = None,
    summary: Mapping[str, Any] | None = None,
    alternating: Mapping[str, Any] | None = None,
    freed: Mapping[str, Any] | None = None,
    sets: Sequence[Mapping[str, Any]] = (),
    patterns: Sequence[Mapping[str, Any]] = ({},),
    parts: Mapping[str, Any] | None = None,
    count: int = 500,
    rms_m: float = 0.01,
    left_out: Sequence[Mapping[str, Any]] = (),
    value: Sequence[float] = (0.0,) * len(MOUNT_NAMES),
) -> Evidence:
    """Tables of a session that is accepted, with changes to their rows."""
    pose_row = {
        "ambiguous": False,
        "rival": "one block higher",
        "rival_agreement_m2": 9.0,
        "agreement_m2": 10.0,
        "within": True,
        "gate_m": 0.05,
    }
    mount_row = {"ambiguous": False, "rival_score": 0.1, "score": 0.4, "within": True, "gate_m": 0.08}
    mount_row |= {f"rotation_{axis}_deg": 4.4 for axis in "xyz"} | {f"lever_arm_{axis}_m": 0.44 for axis in "xyz"}
    summary_row = {"reason": "", "converged": True, "iterations": 6, "rival_strength": np.nan}
    row = {"method": "patent_alternating", "reason": "", "converged": True, "iterations": 9}
    cells = pd.DataFrame(
        {
            "sensor": ["laser", "mbes", "mbes"],
            "family": ["P1", "P2", "P2"],
            "pass": [0, 3, 4],
            "count": [5000, 400, count],
            "rms_m": [0.005, 0.01, rms_m],
        }
    )
    nothing: dict[str, Any] = {"unknown": "sound_speed", "estimated": False, "known": False}
    nothing |= {"expected": 1.4e-4, "value": 2e-4, "sigma": 1e-4, "by_session": np.nan}
    of_set = {"set": "wet_bows", "parameters": "wet_P2_bow", "strength": 0.0, "by_session": np.nan}
    pattern = {"by": "angle", "sensor": "mbes", "family": "P2", "low": 20.0, "width": 2.0, "mean_m": 0.001}
    pattern |= {"sigma_mean_m": 1e-4, "tolerated_m": 0.003}
    geometry = [("remedy", "two more passes at 3 m would do")]
    tables: dict[str, Any] = {field.name: pd.DataFrame() for field in fields(Evidence)}
    part: dict[str, Any] = {"part": "without pass 2", "passes": "0 1 3", "normalised": 1.0, "dof": 6}
    for name in ("roll", "pitch", "yaw", "x", "y", "z"):
        sigma = 0.01 if name in ("roll", "pitch", "yaw") else 0.001
        part |= {f"change_{name}": 0.5 * sigma, f"sigma_{name}": sigma}
    tables |= {
        "parts": pd.DataFrame([part | dict(parts or {}), part | {"part": "without pass 3"}]),
        "faces": pd.DataFrame({"name": ["P1-0", "P2"]}),
        "target_pose": pd.DataFrame([pose_row | dict(pose or {})]),
        "provisional_mount": pd.DataFrame([mount_row | dict(mount or {})]),
        "corrections": pd.DataFrame([row | dict(alternating or {})]),
        "summary": pd.DataFrame([summary_row | dict(summary or {})]),
        "cells": cells,
        "geometry": pd.DataFrame(geometry, columns=["kind", "words"]),
        "freed": freed_table(nothing | dict(freed or {})),
        "sets": pd.DataFrame([of_set | dict(changes) for changes in sets]),
        "estimate": pd.DataFrame({"unknown": MOUNT_NAMES, "value": value, "sigma": 1e-4, "sigma_total": 1e-4}),
        "left_out": left_out_table(*left_out),
        "patterns": pd.DataFrame([pattern | {"normalised": 0.3} | dict(changes) for changes in patterns]),
    }
    return Evidence(**tables)


def left_out_table(*rows: Mapping[str, Any]) -> pd.DataFrame:
    """The table of what is left out; a face at all its heights, by the sonar."""
    usual = {"family": "north", "why": "off", "points": 900, "sensor": "mbes", "low_m": -np.inf, "high_m": np.inf}
    usual |= {"unknown": "wet_north_shift", "value": 0.094, "sigma": 0.009}
    columns = [column.name for column in LEFT_OUT.columns]
    return pd.DataFrame([usual | dict(row) for row in rows], columns=columns)


def freed_table(*rows: Mapping[str, Any]) -> pd.DataFrame:
    """The table of single-parameter tests; each strength is that of a fixed parameter, and no error moves the mount."""
    usual = {"estimated": False, "considered": 0.0, "by_session": np.nan}
    usual |= {f"effect_{name}": 0.0 for name in MOUNT_NAMES}
    return pd.DataFrame([usual | {"strength": abs(row["value"]) / row["sigma"]} | dict(row) for row in rows])


def judged(tables: Evidence, criteria: Criteria = ADJUSTED) -> list[Statement]:
    """The reasons to reject."""
    return rejections(tables, methods(), criteria)


def codes(statements: Sequence[Statement]) -> list[ReasonCode]:
    """What they say, without the words."""
    return [statement.code for statement in statements]


def groups(**changes: Any) -> pd.DataFrame:
    """The table of variance factors, with one group."""
    row = {"group": "mbes_horizontal", "family": "", "count": 1000, "variance_factor": 1.0, "sigma": 0.1, "cut": 0}
    return pd.DataFrame([row | changes])


def families(
    sensor: str, effects: Mapping[str, tuple[float, float]] | None = None, sigma: float = 0.01, **factors: float
) -> pd.DataFrame:
    """The rows of one sensor and family each; ``effects``: of mean and slope; ``sigma``: of a factor of one."""
    rows = []
    for family in ("P1", "P2", "P3", "H"):
        factor, (mean, slope) = factors.get(family, 1.0), (effects or {}).get(family, (1.0, 1.0))
        row = {"group": f"{sensor}:{family}", "sensor": sensor, "family": family, "variance_factor": factor}
        rows.append(row | {"sigma": sigma * factor, "mean_effect": mean, "slope_effect": slope})
    return pd.DataFrame(rows)


def checked(**found: tuple[float, float]) -> pd.DataFrame:
    """The table estimate: variance by slots over sigma², and their number, by mount parameter; else 1 of 50 slots."""
    rows = [(name, *found.get(name, (1.0, 50.0))) for name in MOUNT_NAMES]
    rows.append(("P1_shift", np.nan, np.nan))
    return pd.DataFrame(rows, columns=["unknown", "slots_ratio", "slots_dof"])


def gaps(*words: str) -> pd.DataFrame:
    """The table geometry, with gaps and a remedy."""
    rows = [("gap", gap) for gap in words] + [("remedy", "two more")]
    return pd.DataFrame(rows, columns=["kind", "words"])


def drift(sigmas: float) -> pd.DataFrame:
    """The table drift with values of ``sigmas`` sigmas in every component, at three knots."""
    values = {"x": 0.015, "y": 0.015, "z": 0.02}, {"x": 0.01, "y": 0.01, "z": 0.03}
    columns = {f"{axis}_target_m": value for axis, value in values[0].items()}
    columns |= {f"turn_{axis}_target_deg": value for axis, value in values[1].items()}
    return pd.DataFrame([{name: sign * sigmas * value for name, value in columns.items()} for sign in (1, -1, -1)])


def drift_figures(**changes: tuple[float, float]) -> pd.DataFrame:
    """The table drift_figures, as configured; changes by figure: estimated value, and deviation."""
    configured = {"horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03}
    configured["time_constant_s"] = 200.0
    rows = [(name, value, *changes.get(name, (value, 0.0)), 0.3) for name, value in configured.items()]
    return pd.DataFrame(rows, columns=["figure", "configured", "estimated", "deviation", "sigma_log"])
