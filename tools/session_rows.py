"""The row of a simulated session: the errors, sigmas and verdict of its calibration."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.maths.comparison import mount_error
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from stages.in_memory import calibrate_in_memory
from tools.campaigns import Campaign, scenario_of

Array = NDArray[np.float64]
NAMES = ("pitch", "roll", "yaw", "x", "y", "z")  # about / along body x, y, z
UNITS = np.array([np.radians(1.0)] * 3 + [1e-3] * 3)  # of errors and sigmas in the tables: degrees, millimetres


def errors_of(R_body_from_sensor: Array, lever_arm_m: Array, truth: Mapping[str, Any], sensor: str = "mbes") -> Array:
    """Return the errors (6,) of a mount: ε of R_true = Exp(ε) R_body_from_sensor in rad, lever arm in m.

    Parameters
    ----------
    R_body_from_sensor
        (3, 3): the estimated rotation.
    lever_arm_m
        (3,): the estimated lever arm, in the body frame.
    truth
        Content of the session's truth.json.
    sensor
        "mbes" or "laser".
    """
    R_true, lever_arm_true_m = (np.array(truth[sensor][name]) for name in (f"R_body_from_{sensor}", "lever_arm_m"))
    return mount_error(R_true, lever_arm_true_m, R_body_from_sensor, lever_arm_m)


def session_in_memory(
    campaign: Campaign, number: int, changed: Callable[[str, Any], Any] = lambda _, value: value
) -> dict[str, Any]:
    """Simulate and calibrate a session in memory and return its row.

    Parameters
    ----------
    campaign, number
        The session.
    changed
        Function of an artefact's key and value. Its result replaces the value for the following stages.
    """
    made, session, pool = simulated(campaign, number)
    raw = {"ins": made.ins, "laser": made.laser, "mbes": made.mbes}
    artefacts = calibrate_in_memory(session, pool, raw, changed=changed)
    return _row(campaign, json.loads(artefacts["report/calibration.json"]), made.truth)


def simulated(campaign: Campaign, number: int) -> tuple[SimulatedSession, SessionConfig, PoolConfig]:
    """Simulate a session and return it with its settings."""
    made = simulate_session(parse(Scenario, scenario_of(campaign, number), campaign.name), campaign.first_seed + number)
    return made, parse(SessionConfig, made.session, "session"), parse(PoolConfig, made.pool, "pool")


def session_through_files(campaign: Campaign, number: int) -> dict[str, Any]:
    """Simulate and calibrate a session by the command line and return its row.

    Raises
    ------
    RuntimeError
        A command failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        scenario, session, run = Path(folder, "scenario.yaml"), Path(folder, "session"), Path(folder, "run")
        scenario.write_text(yaml.safe_dump(scenario_of(campaign, number)))
        place = ["--config", session / "pool.yaml", "--run", run]
        poolcal(["simulate", session, "--scenario", scenario, "--seed", campaign.first_seed + number], (0,))
        poolcal(["run", session, *place, "--jobs", "1", "--no-report", "--no-recordings"], (0, 1))
        calibration = json.loads((run / "report" / "calibration.json").read_text())
        return _row(campaign, calibration, json.loads(Path(f"{session}.truth.json").read_text()))


def poolcal(words: Iterable[object], allowed: tuple[int, ...]) -> tuple[int, str]:
    """Run a command of poolcal; return its exit status, which must be an allowed one, and what it says on stderr.

    Raises
    ------
    RuntimeError
        It ended with another status.
    """
    done = subprocess.run([sys.executable, "-m", "stages.cli", *map(str, words)], capture_output=True, text=True)
    if done.returncode not in allowed:
        raise RuntimeError(done.stderr)
    return done.returncode, done.stderr


def _row(campaign: Campaign, calibration: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    block = calibration["methods"]["adjustment"]
    row: dict[str, Any] = {
        "accepted": calibration["verdict"] == "accepted",
        "reasons": "; ".join(calibration["reasons"]),
        "warnings": " ".join(calibration["warning_codes"]),
    }
    row |= error_columns(block, truth)
    covariance = np.array(block["covariance"]) if block["covariance"] else np.full((6, 6), np.nan)
    row |= {f"covariance_{i}{k}": covariance[i, k] for i in range(6) for k in range(i + 1)}
    if campaign.pairs:  # what poolcal diff reads
        read = {"methods": {"adjustment": block}, "systematic": calibration["systematic"]}
        row["calibration"] = json.dumps(read | {"limits": calibration["limits"]})
    return row


def error_columns(
    block: Mapping[str, Any], truth: Mapping[str, Any], sensor: str = "mbes", prefix: str = ""
) -> dict[str, float]:
    """Return columns of a mount: errors, random and total sigmas, and its normalised squared errors by both.

    Parameters
    ----------
    block
        The mount's block of calibration.json. Without a result all columns are NaN.
    truth
        Content of the session's truth.json.
    sensor
        "mbes" or "laser".
    prefix
        Beginning of the columns' names.
    """
    error, random, total = np.full(6, np.nan), np.eye(6) * np.nan, np.eye(6) * np.nan
    if block["covariance"] is not None and block["covariance_total"] is not None:
        error = errors_of(np.array(block[f"R_body_from_{sensor}"]), np.array(block["lever_arm_m"]), truth, sensor)
        random, total = np.array(block["covariance"]), np.array(block["covariance_total"])
    row = {f"{prefix}nse{end}": _squared(error, C) for end, C in (("", random), ("_total", total))}
    columns = {"error": error, "sigma": np.sqrt(np.diag(random)), "total": np.sqrt(np.diag(total))}
    for k, name in enumerate(NAMES):
        row |= {f"{prefix}{kind}_{name}": float(values[k] / UNITS[k]) for kind, values in columns.items()}
    return row


def _squared(error: Array, covariance: Array) -> float:
    return float(error @ np.linalg.solve(covariance, error))


def session_row(task: tuple[Campaign, int]) -> dict[str, Any]:
    """Return the row of a session, by its campaign and number."""
    campaign, number = task
    row = session_through_files(*task) if campaign.through_files else session_in_memory(*task)
    return {"campaign": campaign.name, "seed": campaign.first_seed + number} | row
