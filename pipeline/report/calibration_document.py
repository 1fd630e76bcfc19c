"""A calibration as other programs read it: the blocks of calibration.json, and its table."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from pipeline.artefacts.from_tables import vector_of
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.gps_time import utc_text
from pipeline.maths.adjustment.parameters import NAMES, SIX
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.mount_parameters import PARAMETERS, SETTINGS
from pipeline.mount import WITHIN_95, Mounted, parameters_of, setting_change
from pipeline.report.suspected_causes import estimated

Array = NDArray[np.float64]
SCHEMA = 1


def plain(value: Any) -> Any:
    """A number or truth value that JSON knows; None for what is not a number."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    number = float(value)
    return None if not np.isfinite(number) else int(number) if number.is_integer() and abs(number) < 1e9 else number


def instruments_block(sensors: Mapping[str, Ins | Laser | Mbes]) -> dict[str, Any]:
    """The presets that session.yaml names, by sensor; nothing where it names none."""
    used = {sensor: one.instrument for sensor, one in sensors.items() if one.instrument is not None}
    found = {
        sensor: {"name": one.name, "title": one.title, "unverified": list(one.unverified)}
        for sensor, one in used.items()
    }
    return {"instruments": found} if found else {}


def free_block(freed: pd.DataFrame) -> dict[str, Any]:
    """What adjust.free names, by name: value and total sigma in ``unit`` (of the sound speed a share), and in words."""
    found = {one.unknown: one for one in estimated(freed)}
    return {
        name: {"value": plain(one.value), "sigma_total": plain(one.sigma_total), "unit": one.unit, "words": one.words}
        for name, one in found.items()
    }


def target_block(pose: pd.Series) -> dict[str, Any]:
    """How the target was found, against the pool's config."""
    return {
        "offset_m": vector_of(pose, "origin_{}_pool_m").tolist(),
        "azimuth_correction_deg": float(pose["azimuth_correction_deg"]),
        "tilt_deg": [float(pose["tilt_x_deg"]), float(pose["tilt_y_deg"])],
        "rms_m": plain(pose["rms_m"]),
    }


def pass_rows(passes: pd.DataFrame, cells: pd.DataFrame) -> list[dict[str, Any]]:
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
                "distance_m": plain(round(row["distance_m"], 2)),
                "duration_s": plain(round(row["duration_s"], 1)),
                "laser_points": on_target["laser"],
                "soundings": on_target["mbes"],
            }
        )
    return rows


def method_block(
    vector_rad: Array,
    lever_m: Array,
    coarse: Mounted,
    outcome: Mapping[Any, Any],
    random: Array | None = None,
    total: Array | None = None,
    sensor: str = "mbes",
) -> dict[str, Any]:
    """One method's block of the contract, null where there is no result; ``outcome``: converged, iterations, reason;
    covariances ``random`` (of the noise) and ``total`` (with what is considered, not estimated)."""
    good = bool(np.all(np.isfinite(vector_rad)) and np.all(np.isfinite(lever_m)))
    mounted = (
        Mounted(exp_so3(vector_rad) @ coarse.R_body_from_sensor, coarse.lever_arm_body_m + lever_m) if good else None
    )
    block: dict[str, Any] = {
        f"R_body_from_{sensor}": mounted.R_body_from_sensor.tolist() if mounted else None,
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


def mounted_of(block: Mapping[str, Any]) -> Mounted:
    (R_body_from_sensor,) = (value for key, value in block.items() if key.startswith("R_body_from_"))
    return Mounted(np.array(R_body_from_sensor), np.array(block["lever_arm_m"]))


def adjustment_block(
    estimate: pd.DataFrame, covariance: pd.DataFrame, summary: Mapping[Any, Any], coarse: Mounted, sensor: str = "mbes"
) -> dict[str, Any]:
    values = estimate.set_index("unknown").loc[list(NAMES), "value"].to_numpy()
    tables = (covariance[name].to_numpy().reshape(SIX, SIX) for name in ("covariance", "covariance_total"))
    random, total = tables
    return method_block(values[:3], values[3:], coarse, summary, random, total, sensor)


def matrix(table: pd.DataFrame, column: str) -> list[list[float]] | None:
    values = table[column].to_numpy().reshape(SIX, SIX)
    return values.tolist() if np.all(np.isfinite(values)) else None


def calibration_table(methods: Mapping[str, Mapping[str, Any]], coarse: Mounted) -> pd.DataFrame:
    rows = []
    for method, block in methods.items():
        correction, sigma = (parameters_of(block[name]) for name in ("correction", "sigma"))
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
                    "change": setting_change(total, coarse.settings(), key) if block["mount"] else np.nan,
                    "correction": correction[place],
                    "sigma": sigma[place],
                    "sigma_random": random[key],
                    "sigma_total": sigma_mount[key],
                    "low_95": total[key] - WITHIN_95 * sigma_mount[key],
                    "high_95": total[key] + WITHIN_95 * sigma_mount[key],
                }
            )
    return pd.DataFrame(rows)


class _PlainDumper(yaml.SafeDumper):
    """Writes what is repeated in full: anchors and aliases are not for people."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def documents(result: Mapping[str, Any]) -> tuple[str, str]:
    """calibration.json and calibration.yaml."""
    return (
        json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        yaml.dump(result, Dumper=_PlainDumper, sort_keys=False, allow_unicode=True, width=120),
    )
