"""Blocks of calibration.json that every calibration has, and the texts of the documents."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import pandas as pd
import yaml

from pipeline.adjustment.pattern_tests import pattern_tests
from pipeline.artefacts.from_tables import vector_of
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.gps_time import utc_text
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.report.evidence import Evidence
from pipeline.report.reason_codes import Statement
from pipeline.report.suspected_causes import estimated_parameters

SCHEMA = 1


def json_number(value: Any) -> bool | int | float | None:
    """Return a value as a number or truth value of JSON; None if it is NaN or infinite."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    number = float(value)
    return None if not np.isfinite(number) else int(number) if number.is_integer() and abs(number) < 1e9 else number


def statement_lists(kind: Literal["reason", "warning"], statements: Sequence[Statement]) -> dict[str, list[str]]:
    """Return the words of reasons or warnings, and their codes in the same order."""
    return {
        f"{kind}s": [statement.words for statement in statements],
        f"{kind}_codes": [statement.code.value for statement in statements],
    }


def instruments_block(sensors: Mapping[str, Ins | Laser | Mbes]) -> dict[str, Any]:
    """Return the block ``instruments``: the presets in session.yaml by sensor; empty if there are none."""
    presets = {sensor: block.instrument for sensor, block in sensors.items() if block.instrument is not None}
    described = {
        sensor: {"name": preset.name, "title": preset.title, "unverified": list(preset.unverified)}
        for sensor, preset in presets.items()
    }
    return {"instruments": described} if described else {}


def free_block(freed: pd.DataFrame) -> dict[str, Any]:
    """Return the parameters of ``adjust.free`` by name: value, total sigma, unit ('1' for sound speed), words."""
    return {
        parameter.unknown: {
            "value": json_number(parameter.value),
            "sigma_total": json_number(parameter.sigma_total),
            "unit": parameter.unit,
            "words": parameter.words,
        }
        for parameter in estimated_parameters(freed)
    }


def estimated_drift_block(figures: pd.DataFrame) -> dict[str, Any]:
    """Return the drift's figures by data and session, and by figure the sigma of its logarithm and its deviation."""
    names = figures["figure"].tolist()
    columns = {
        column: {name: json_number(value) for name, value in zip(names, figures[column], strict=True)}
        for column in ("estimated", "sigma_log", "deviation")
    }
    return columns.pop("estimated") | columns


def target_block(pose: pd.Series) -> dict[str, Any]:
    """Return the target's pose relative to the pool's config, from a row of the table ``target_pose``."""
    return {
        "offset_m": vector_of(pose, "origin_{}_pool_m").tolist(),
        "azimuth_correction_deg": float(pose["azimuth_correction_deg"]),
        "tilt_deg": [float(pose["tilt_x_deg"]), float(pose["tilt_y_deg"])],
        "rms_m": json_number(pose["rms_m"]),
    }


def geometry_block(evidence: Evidence, advice: str, test_level: float) -> dict[str, Any]:
    """Return the block ``geometry``: how well the geometry determines the mount, and the tests of the residuals.

    Parameters
    ----------
    evidence : tables of the run
    advice : weaknesses of the geometry and their remedy, in words
    test_level : level of the tests
    """
    summary = evidence.summary.iloc[0]
    return {
        "correlation": correlation_matrix(evidence.covariance),
        "weakest": str(summary["weakest"]),
        "advice": advice,
        "test": {name: json_number(summary[f"test_{name}"]) for name in ("statistic", "limit", "dof", "passed")},
        "patterns": pattern_tests(evidence.patterns, test_level),
    }


def correlation_matrix(covariance: pd.DataFrame) -> list[list[float]] | None:
    """Return the correlations of the mount parameters (6, 6) from the table ``covariance``; None without a result."""
    values = covariance["correlation"].to_numpy().reshape(N_MOUNT, N_MOUNT)
    return values.tolist() if np.all(np.isfinite(values)) else None


def pass_rows(passes: pd.DataFrame, water_levels: pd.DataFrame, cells: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a row for each pass: start, distance, duration, water, and the target's observations by table ``cells``.

    Of a sonar with several heads the soundings are also counted by head.
    """
    rows, heads = [], sorted({"mbes", *cells["sensor"]} - {"laser"})
    for row in passes.merge(water_levels, on="pass").to_dict("records"):
        means = cells[cells["pass"] == row["pass"]]
        on_target = {sensor: int(means.loc[means["sensor"] == sensor, "count"].sum()) for sensor in ("laser", *heads)}
        rows.append(
            {
                "pass": int(row["pass"]),
                "start_utc": utc_text(int(row["start_ns"])),
                "distance_m": json_number(round(row["distance_m"], 2)),
                "duration_s": json_number(round(row["duration_s"], 1)),
                "water_level_m": json_number(round(row["level_m"], 3)),
                "laser_points": on_target["laser"],
                "soundings": sum(on_target[head] for head in heads),
                **({f"soundings_{head}": on_target[head] for head in heads} if len(heads) > 1 else {}),
            }
        )
    return rows


class _PlainDumper(yaml.CSafeDumper):
    """YAML dumper without anchors and aliases, which are hard to read: it writes repeated values in full."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def documents(result: Mapping[str, Any]) -> tuple[str, str]:
    """Return the texts of calibration.json and calibration.yaml."""
    return (
        json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        yaml.dump(result, Dumper=_PlainDumper, sort_keys=False, allow_unicode=True, width=120),
    )
