"""The answer: calibration.json for programs, calibration.yaml for people, a summary for the screen, and the verdict."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from pipeline import artefacts, config
from pipeline.built import as_found, oddities
from pipeline.causes import estimated
from pipeline.closing import closing_table
from pipeline.ins_sigmas import drift_of, told
from pipeline.maths.rotations import exp_so3
from pipeline.maths.unknowns import NAMES, SIX
from pipeline.mounts import PARAMETERS, SETTINGS, WITHIN_95, Mounted, change_of, mount_of, six_of
from pipeline.times import utc_text
from pipeline.verdict import (
    NO_DRIFT,
    Evidence,
    Settings,
    cast_doubts,
    drift_doubt,
    one_eyed,
    pattern_tests,
    reasons,
    warnings,
)

Array = NDArray[np.float64]
SCHEMA = 1


@dataclass(frozen=True)
class Config:
    name: str
    target: config.Target
    ins: config.Ins
    mbes: config.Mbes
    segment: config.Segment
    adjust: config.Adjust
    verdict: config.Verdict
    result: config.Method


@dataclass(frozen=True)
class Inputs:
    files: Annotated[pd.DataFrame, artefacts.FILES]
    passes: Annotated[pd.DataFrame, artefacts.PASSES]
    ins_sigmas: Annotated[pd.DataFrame, artefacts.INS_SIGMAS]
    faces: Annotated[pd.DataFrame, artefacts.FACES]
    planes: Annotated[pd.DataFrame, artefacts.PLANES]
    sounding_moments: Annotated[pd.DataFrame, artefacts.SOUNDING_MOMENTS]
    target_pose: Annotated[pd.DataFrame, artefacts.TARGET_POSE]
    provisional_mount: Annotated[pd.DataFrame, artefacts.PROVISIONAL_MOUNT]
    corrections: Annotated[pd.DataFrame, artefacts.CORRECTIONS]
    estimate: Annotated[pd.DataFrame, artefacts.ESTIMATE]
    covariance: Annotated[pd.DataFrame, artefacts.COVARIANCE]
    geometry: Annotated[pd.DataFrame, artefacts.GEOMETRY]
    drift: Annotated[pd.DataFrame, artefacts.DRIFT]
    freed: Annotated[pd.DataFrame, artefacts.FREED]
    patterns: Annotated[pd.DataFrame, artefacts.PATTERNS]
    cells: Annotated[pd.DataFrame, artefacts.CELLS]
    groups: Annotated[pd.DataFrame, artefacts.GROUPS]
    summary: Annotated[pd.DataFrame, artefacts.ADJUST_SUMMARY]
    provenance: Annotated[dict[str, Any], artefacts.Provenance]


@dataclass(frozen=True)
class Outputs:
    calibration: Annotated[pd.DataFrame, artefacts.CALIBRATION]
    closing: Annotated[pd.DataFrame, artefacts.CLOSING]
    calibration_json: Annotated[str, artefacts.CALIBRATION_JSON]
    calibration_yaml: Annotated[str, artefacts.CALIBRATION_YAML]


class _PlainDumper(yaml.SafeDumper):
    """Writes what is repeated in full: anchors and aliases are not for people."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def run(inputs: Inputs, config: Config) -> Outputs:
    coarse = mount_of(config.mbes.mount)
    methods = _patent_methods(inputs.corrections, coarse)
    methods["adjustment"] = _adjustment(
        inputs.estimate, inputs.covariance, inputs.summary.to_dict("records")[0], coarse
    )
    passes = _passes(inputs.passes, inputs.cells)
    evidence = Evidence(
        inputs.faces,
        inputs.target_pose,
        inputs.provisional_mount,
        inputs.corrections,
        inputs.summary,
        inputs.cells,
        inputs.geometry,
        inputs.freed,
        inputs.patterns,
    )
    from_files = told(config.ins, inputs.ins_sigmas, inputs.passes)
    drift = drift_of(config.ins, inputs.ins_sigmas, inputs.passes)
    doubt = drift_doubt(inputs.drift, drift, "the INS's files say" if from_files else "ins.drift says")
    farthest, level = config.segment.farthest_mount, config.adjust.test_level
    found = reasons(evidence, methods, Settings(config.verdict, level, config.result, farthest, doubt))
    built = as_found(inputs.planes, inputs.patterns, inputs.faces, config.target.e)
    summary, target = inputs.summary.iloc[0], _target(inputs.target_pose.iloc[0]) | {"as_found": built}
    result = {
        "schema": SCHEMA,
        "session": config.name,
        "verdict": "rejected" if found else "accepted",
        "reasons": found,
        "warnings": warnings(
            inputs.groups, target, inputs.geometry, methods["adjustment"]["sigma_mount_total"]
        )
        + ([doubt] if doubt not in ("", NO_DRIFT, *found) else [])
        + one_eyed(passes)
        + oddities(built, config.target)
        + cast_doubts(config.mbes, inputs.files, methods["adjustment"]["correction"]),
        "result": config.result,
        "mbes": methods[config.result],
        "methods": methods,
        "coarse": {"mount": coarse.settings()},
        "geometry": {
            "correlation": _matrix(inputs.covariance, "correlation"),
            "weakest": str(summary["weakest"]),
            "advice": "; ".join(inputs.geometry["words"]),
            "test": {name: _plain(summary[f"test_{name}"]) for name in ("statistic", "limit", "dof", "passed")},
            "patterns": pattern_tests(inputs.patterns, config.adjust.test_level),
        },
        "free": _free(inputs.freed),
        "target": target,
        "passes": passes,
        "ranges": _range_note(config.mbes),
        "ins_drift": drift.model_dump() | {"from_files": list(from_files)},
        "inputs": inputs.provenance["inputs"],
        "software": inputs.provenance["software"],
    }
    mounts = {"coarse": coarse} | {name: _mounted(block) for name, block in methods.items() if block["mount"]}
    return Outputs(
        _table(methods, coarse),
        closing_table(inputs.faces, inputs.planes, inputs.sounding_moments, coarse, mounts),
        json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        yaml.dump(result, Dumper=_PlainDumper, sort_keys=False, allow_unicode=True, width=120),
    )


def _plain(value: Any) -> Any:
    """A number or truth value that JSON knows; None for what is not a number."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    number = float(value)
    return None if not np.isfinite(number) else int(number) if number.is_integer() and abs(number) < 1e9 else number


def _free(freed: pd.DataFrame) -> dict[str, Any]:
    """What adjust.free names, by name: value and total sigma in ``unit`` (of the sound speed a share), and in words."""
    found = {one.unknown: one for one in estimated(freed)}
    return {
        name: {"value": _plain(one.value), "sigma_total": _plain(one.sigma_total), "unit": one.unit, "words": one.words}
        for name, one in found.items()
    }


def _target(pose: pd.Series) -> dict[str, Any]:
    """How the target was found, against the pool's config."""
    return {
        "offset_m": [float(pose[f"origin_{axis}_pool_m"]) for axis in "xyz"],
        "azimuth_correction_deg": float(pose["azimuth_correction_deg"]),
        "tilt_deg": [float(pose["tilt_x_deg"]), float(pose["tilt_y_deg"])],
        "rms_m": _plain(pose["rms_m"]),
    }


def _passes(passes: pd.DataFrame, cells: pd.DataFrame) -> list[dict[str, Any]]:
    """Each pass with what it gave: distance, time, observations on the target."""
    rows = []
    for row in passes.to_dict("records"):
        of_pass = cells[cells["pass"] == row["pass"]]
        on_target = {
            sensor: int(of_pass.loc[of_pass["sensor"] == sensor, "count"].sum()) for sensor in ("laser", "mbes")
        }
        rows.append(
            {
                "pass": int(row["pass"]),
                "start_utc": utc_text(int(row["start_ns"])),
                "distance_m": _plain(round(row["distance_m"], 2)),
                "duration_s": _plain(round(row["duration_s"], 1)),
                "laser_points": on_target["laser"],
                "soundings": on_target["mbes"],
            }
        )
    return rows


def _range_note(mbes: config.Mbes) -> str:
    said = "sonar ranges taken as recorded: half the two-way path"
    if mbes.projector_offset_m is not None:
        said = f"sonar ranges reduced for a transmitter at {list(mbes.projector_offset_m)} m in the mbes frame"
    return said if mbes.svp is None else f"{said}; rays traced through a cast of {len(mbes.svp)} depths"


def _method(
    vector_rad: Array,
    lever_m: Array,
    coarse: Mounted,
    outcome: Mapping[Any, Any],
    random: Array | None = None,
    total: Array | None = None,
) -> dict[str, Any]:
    """One method's block of the contract, null where there is no result; ``outcome``: converged, iterations, reason;
    covariances ``random`` (of the noise) and ``total`` (with what is considered, not estimated)."""
    good = bool(np.all(np.isfinite(vector_rad)) and np.all(np.isfinite(lever_m)))
    mounted = (
        Mounted(exp_so3(vector_rad) @ coarse.R_body_from_sensor, coarse.lever_arm_body_m + lever_m) if good else None
    )
    block: dict[str, Any] = {
        "R_body_from_mbes": mounted.R_body_from_sensor.tolist() if mounted else None,
        "lever_arm_m": mounted.lever_arm_body_m.tolist() if mounted else None,
        "mount": mounted.settings() if mounted else None,
        "correction": {
            "rotation_vector_deg": np.degrees(vector_rad).tolist() if good else None,
            "lever_arm_m": lever_m.tolist() if good else None,
        },
    }
    for suffix, covariance in (("", random), ("_total", total)):
        known = mounted is not None and covariance is not None and bool(np.all(np.isfinite(covariance)))
        block |= _uncertainty(mounted, covariance, suffix) if known and mounted and covariance is not None else (
            dict.fromkeys((f"sigma{suffix}", f"covariance{suffix}", f"sigma_mount{suffix}"))
        )
    return block | {
        "converged": bool(outcome["converged"]),
        "iterations": int(outcome["iterations"]),
        "no_result": str(outcome["reason"]),
    }


def _uncertainty(mounted: Mounted, covariance: Array, suffix: str) -> dict[str, Any]:
    sigma = np.sqrt(np.diag(covariance))
    return {
        f"sigma{suffix}": {"rotation_vector_deg": np.degrees(sigma[:3]).tolist(), "lever_arm_m": sigma[3:].tolist()},
        f"covariance{suffix}": covariance.tolist(),
        f"sigma_mount{suffix}": mounted.sigmas(covariance),
    }


def _mounted(block: Mapping[str, Any]) -> Mounted:
    return Mounted(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]))


def _patent_methods(corrections: pd.DataFrame, coarse: Mounted) -> dict[str, dict[str, Any]]:
    methods = {}
    for row in corrections.to_dict("records"):
        vector = np.radians([row[f"rotation_{axis}_deg"] for axis in "xyz"])
        lever = np.array([row[f"lever_arm_{axis}_m"] for axis in "xyz"])
        methods[str(row["method"])] = _method(vector, lever, coarse, row)
    return methods


def _adjustment(
    estimate: pd.DataFrame, covariance: pd.DataFrame, summary: Mapping[Any, Any], coarse: Mounted
) -> dict[str, Any]:
    values = estimate.set_index("unknown").loc[list(NAMES), "value"].to_numpy()
    tables = (covariance[name].to_numpy().reshape(SIX, SIX) for name in ("covariance", "covariance_total"))
    return _method(values[:3], values[3:], coarse, summary, *tables)


def _matrix(table: pd.DataFrame, column: str) -> list[list[float]] | None:
    values = table[column].to_numpy().reshape(SIX, SIX)
    return values.tolist() if np.all(np.isfinite(values)) else None


def _table(methods: Mapping[str, Mapping[str, Any]], coarse: Mounted) -> pd.DataFrame:
    rows = []
    for method, block in methods.items():
        correction, sigma = (six_of(block[name]) for name in ("correction", "sigma"))
        names = ("mount", "sigma_mount", "sigma_mount_total")
        total, random, sigma_mount = (block[name] or dict.fromkeys(SETTINGS, np.nan) for name in names)
        for parameter, place, key, unit in PARAMETERS:
            rows.append(
                {
                    "method": method,
                    "parameter": parameter,
                    "unit": unit,
                    "coarse": coarse.settings()[key],
                    "total": total[key],
                    "change": change_of(total, coarse.settings(), key) if block["mount"] else np.nan,
                    "correction": correction[place],
                    "sigma": sigma[place],
                    "sigma_random": random[key],
                    "sigma_total": sigma_mount[key],
                    "low_95": total[key] - WITHIN_95 * sigma_mount[key],
                    "high_95": total[key] + WITHIN_95 * sigma_mount[key],
                }
            )
    return pd.DataFrame(rows)
