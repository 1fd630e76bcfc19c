"""Mount, correction and covariances of each method, as blocks of calibration.json and as table ``calibration``."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.from_tables import rotation_vector_deg, vector_of
from pipeline.config.session import Calibrated
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.mount_parameters import MOUNT_NAMES, N_MOUNT, PARAMETERS, SETTINGS
from pipeline.mount import WITHIN_95, Mounted, parameters_of, setting_change

Array = NDArray[np.float64]
Block = dict[str, Any]
WARNINGS = {
    "patent_literal": "as the patent prints it, faults included: to compare, never to be entered"
}  # by method, for people; a method without one has an empty text


@dataclass(frozen=True, kw_only=True)
class MethodResult:
    """Result of a method. Its corrections are NaN if the method has no result.

    Attributes
    ----------
    rotation_vector_rad : correction of the rotation about body x, y, z, (3,)
    lever_arm_m : correction of the lever arm, body axes, (3,)
    outcome : converged, iterations, and the reason if there is no result
    covariance : covariance from noise, (6, 6), rad and m
    covariance_total : covariance from noise and consider parameters, (6, 6), rad and m
    """

    rotation_vector_rad: Array
    lever_arm_m: Array
    outcome: Mapping[Any, Any]
    covariance: Array | None = None
    covariance_total: Array | None = None

    def mounted(self, coarse: Mounted) -> Mounted | None:
        """Return the total mount; None if there is no result."""
        if not (np.all(np.isfinite(self.rotation_vector_rad)) and np.all(np.isfinite(self.lever_arm_m))):
            return None
        R_body_from_sensor = exp_so3(self.rotation_vector_rad) @ coarse.R_body_from_sensor
        return Mounted(R_body_from_sensor, coarse.lever_arm_body_m + self.lever_arm_m)


def method_block(result: MethodResult, coarse: Mounted, sensor: Calibrated = "mbes", warning: str = "") -> Block:
    """Return a method's block of calibration.json. Its values are null if the method has no result.

    Parameters
    ----------
    result : corrections and covariances
    coarse : the coarse mount
    sensor : the sensor that is calibrated
    warning : why the values are not to be used; empty if they may be
    """
    mount = result.mounted(coarse)
    block: Block = {
        f"R_body_from_{sensor}": mount.R_body_from_sensor.tolist() if mount else None,
        "lever_arm_m": mount.lever_arm_body_m.tolist() if mount else None,
        "mount": mount.settings() if mount else None,
        "correction": {
            "rotation_vector_deg": np.degrees(result.rotation_vector_rad).tolist() if mount else None,
            "lever_arm_m": result.lever_arm_m.tolist() if mount else None,
        },
    }
    for suffix, covariance in (("", result.covariance), ("_total", result.covariance_total)):
        if mount is not None and covariance is not None and np.all(np.isfinite(covariance)):
            block |= _uncertainty(mount, covariance, suffix)
        else:
            block |= dict.fromkeys((f"sigma{suffix}", f"covariance{suffix}", f"sigma_mount{suffix}"))
    return block | {
        "converged": bool(result.outcome["converged"]),
        "iterations": int(result.outcome["iterations"]),
        "no_result": str(result.outcome["reason"]),
        "warning": warning,
    }


def _uncertainty(mount: Mounted, covariance: Array, suffix: str) -> Block:
    sigma = np.sqrt(np.diag(covariance))
    return {
        f"sigma{suffix}": {"rotation_vector_deg": np.degrees(sigma[:3]).tolist(), "lever_arm_m": sigma[3:].tolist()},
        f"covariance{suffix}": covariance.tolist(),
        f"sigma_mount{suffix}": mount.sigmas(covariance),
    }


def adjustment_block(
    estimate: pd.DataFrame,
    covariance: pd.DataFrame,
    summary: pd.DataFrame,
    coarse: Mounted,
    sensor: Calibrated = "mbes",
) -> Block:
    """Return the block of the adjustment.

    Parameters
    ----------
    estimate, covariance, summary : tables of the adjustment
    coarse : the coarse mount
    sensor : the sensor that is calibrated
    """
    values = estimate.set_index("unknown").loc[list(MOUNT_NAMES), "value"].to_numpy()
    result = MethodResult(
        rotation_vector_rad=values[:3],
        lever_arm_m=values[3:],
        outcome=summary.to_dict("records")[0],
        covariance=covariance["covariance"].to_numpy().reshape(N_MOUNT, N_MOUNT),
        covariance_total=covariance["covariance_total"].to_numpy().reshape(N_MOUNT, N_MOUNT),
    )
    return method_block(result, coarse, sensor)


def patent_blocks(corrections: pd.DataFrame, coarse: Mounted) -> dict[str, Block]:
    """Return the blocks of the patent's forms, by method, from the table ``corrections``."""
    blocks = {}
    for row in corrections.to_dict("records"):
        result = MethodResult(
            rotation_vector_rad=np.radians(rotation_vector_deg(row)),
            lever_arm_m=vector_of(row, "lever_arm_{}_m"),
            outcome=row,
        )
        method = str(row["method"])
        blocks[method] = method_block(result, coarse, warning=WARNINGS.get(method, ""))
    return blocks


def mounted_of(block: Mapping[str, Any]) -> Mounted:
    """Return the total mount of a block that has a result."""
    (R_body_from_sensor,) = (value for key, value in block.items() if key.startswith("R_body_from_"))
    return Mounted(np.array(R_body_from_sensor), np.array(block["lever_arm_m"]))


def calibration_table(methods: Mapping[str, Mapping[str, Any]], coarse: Mounted) -> pd.DataFrame:
    """Return the table ``calibration``: one row per method and mount parameter."""
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
