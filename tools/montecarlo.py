"""Simulate and calibrate many sessions, and test whether the errors agree with the predicted sigmas.

For each campaign the program prints the errors of the six mount parameters, the number of accepted sessions, and the
mean normalised squared error with its 99 % band; the expectation of the latter is 6 if the covariance is right. Seeds
are fixed. In every session the coarse mount is wrong by 2.5° and 0.25 m on every axis at once, and the signs of these
errors go through all 64 combinations. Each session is a row of a file in runs/montecarlo/, which is CSV during the
campaign and Parquet at its end. ``tools.accuracy`` makes the README's table and an HTML page from these files.

    python -m tools.montecarlo [--only NAME ...] [--share 0.1] [--jobs 2] [--resume]
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray
from scipy.stats import chi2

from pipeline.maths.comparison import mount_error

Array = NDArray[np.float64]
NAMES = ("pitch", "roll", "yaw", "x", "y", "z")  # about / along body x, y, z
UNITS = np.array([np.radians(1.0)] * 3 + [1e-3] * 3)  # of errors and sigmas in the tables: degrees, millimetres
MOVED_DEG, MOVED_MM = 0.05, 2.0
FOLDER = Path("runs/montecarlo")
TASKS_OF_A_WORKER = 20  # then a new process: hundreds of ray casting scenes make a process slow and large
COARSE_DEG, COARSE_M = 2.5, 0.25
THIN: dict[str, Any] = {"laser": {"point_rate_hz": 5000.0}}  # enough laser points for the sonar's noise to dominate
WHITE: dict[str, Any] = {
    "ins": {"white": {"position_m": 0.0, "attitude_deg": 0.0}},
    "laser": {"outlier_share": 0.0, "water_return_share": 0.0},
    "mbes": {"point_beams": True, "corner_share": 0.0, "outlier_share": 0.0, "surface_share": 0.0},
}


DRIFT: dict[str, Any] = {
    "drift": {
        "horizontal_m": 0.015,
        "vertical_m": 0.02,
        "roll_pitch_deg": 0.01,
        "heading_deg": 0.03,
        "time_constant_s": 200.0,
    }
}


HALF: dict[str, Any] = {  # half the pings, and passes just long enough
    "mbes": WHITE["mbes"] | {"ping_rate_hz": 10.0},
    "track": {"half_length_m": 3.6},
}


def _sectors(border_deg: float) -> dict[str, Any]:
    """Return transmit sectors 0.254° apart, as a Kongsberg EM2042 has, symmetrical about the array's normal."""
    edges = ((-border_deg, -0.447), (border_deg, -0.701), (90.0, -0.447))
    return {"mbes": TABLE | {"sectors": [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges]}}


TABLE: dict[str, Any] = {"format": "parquet", "ping_rate_hz": 10.0}
TWELVE: dict[str, Any] = {"distances_m": [3.5, 6.0, 8.5] * 4, "speed_m_s": 0.18, "gap_s": 20.0}  # 50 s each


@dataclass(frozen=True)
class Campaign:
    """Sessions of one kind, whose seeds are consecutive."""

    name: str
    sessions: int
    first_seed: int
    scenario: dict[str, Any] = field(default_factory=dict)
    through_files: bool = False
    pairs: bool = False  # also compare sessions in pairs: how often does the comparison report a move?


def _target(**letters: Any) -> dict[str, Any]:
    origin = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
    return {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5, "azimuth_deg": 0.0, "origin": origin} | letters


CAMPAIGNS = (
    Campaign("white noise", 200, 1000, WHITE),
    Campaign("white noise, files and CLI", 10, 1900, WHITE, through_files=True),
    Campaign("azimuth 47, low side north", 64, 2000, WHITE | {"target": _target(azimuth_deg=47.0, low_side="north")}),
    Campaign("azimuth -163", 64, 3000, WHITE | {"target": _target(azimuth_deg=-163.0)}),
    Campaign("target 6/2.4/0.8/0.4", 64, 4000, WHITE | {"target": _target(a=6.0, b=2.4, c=0.8, e=0.4)}),
    Campaign(
        "the same, six passes",
        64,
        4500,
        WHITE
        | {
            "target": _target(a=6.0, b=2.4, c=0.8, e=0.4),
            "track": {"distances_m": [4.0, 8.0, 5.0, 7.0, 4.5, 6.0]},
        },
    ),
    Campaign(
        "origin off by 0.3 m, azimuth by 1",
        64,
        5000,
        WHITE | {"surroundings": {"origin_error_m": [0.3, -0.3, 0.15], "azimuth_error_deg": 1.0}},
    ),
    Campaign("finite beams, outliers, echoes", 600, 6000, {"ins": WHITE["ins"]}),
    Campaign("finite beams and INS white noise", 600, 7000, {}),
    Campaign("finite beams and INS drift", 600, 8000, {"ins": DRIFT}),
    Campaign("twelve passes, INS drift", 160, 9000, {"ins": DRIFT, "track": TWELVE}),
    Campaign("tilted sectors, border at 15", 24, 12000, _sectors(15.0)),
    Campaign("tilted sectors, border at 30", 24, 12100, _sectors(30.0)),
    Campaign("tilted sectors, border at 40", 24, 12200, _sectors(40.0)),
    Campaign("tilted sectors, border at 48", 24, 12300, _sectors(48.0)),
    Campaign("tilted from ping to ping", 24, 12400, {"mbes": TABLE | {"ping_tilts_deg": [0.0, 0.3]}}),
    Campaign("1000 pairs, half as dense", 2000, 10000, WHITE | HALF, pairs=True),
)


def path_of(campaign: Campaign) -> Path:
    """Return the file of a campaign's rows."""
    return FOLDER / f"{campaign.name.replace(' ', '_').replace('/', '-').replace(',', '')}.parquet"


def scenario_of(campaign: Campaign, number: int) -> dict[str, Any]:
    """Return the scenario of a session: the campaign's with thinned laser points and the session's coarse errors."""
    signs = [1.0 if number >> bit & 1 else -1.0 for bit in range(6)]
    keys = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")
    sizes = (COARSE_DEG,) * 3 + (COARSE_M,) * 3
    coarse = {key: sign * size for key, sign, size in zip(keys, signs, sizes, strict=True)}
    merged: dict[str, Any] = {"name": campaign.name}
    for part in (campaign.scenario, THIN, {"mbes": {"coarse_error": coarse}}):
        for key, value in part.items():
            merged[key] = merged.get(key, {}) | value
    return merged


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


def session_in_memory(campaign: Campaign, number: int) -> dict[str, Any]:
    """Simulate and calibrate a session in memory and return its row."""
    from pipeline.config.pool import PoolConfig
    from pipeline.config.session import SessionConfig
    from pipeline.config.yaml_models import parse
    from pipeline.simulation.scenario import Scenario
    from pipeline.simulation.session import simulate_session
    from stages.in_memory import calibrate_in_memory

    scenario = parse(Scenario, scenario_of(campaign, number), campaign.name)
    made = simulate_session(scenario, campaign.first_seed + number)
    artefacts = calibrate_in_memory(
        parse(SessionConfig, made.session, "session"),
        parse(PoolConfig, made.pool, "pool"),
        {"ins": made.ins, "laser": made.laser, "mbes": made.mbes},
    )
    return _row(json.loads(artefacts["report/calibration.json"]), made.truth)


def session_through_files(campaign: Campaign, number: int) -> dict[str, Any]:
    """Simulate and calibrate a session by the command line and return its row.

    Raises
    ------
    RuntimeError
        A command ended with neither status 0 nor 1.
    """
    with tempfile.TemporaryDirectory() as folder:
        scenario, session, run = Path(folder, "scenario.yaml"), Path(folder, "session"), Path(folder, "run")
        scenario.write_text(yaml.safe_dump(scenario_of(campaign, number)))
        poolcal = [sys.executable, "-m", "stages.cli"]
        seed = str(campaign.first_seed + number)
        place = ["--config", str(session / "pool.yaml"), "--run", str(run)]
        for command in (
            ["simulate", str(session), "--scenario", str(scenario), "--seed", seed],
            ["run", str(session), *place, "--jobs", "1", "--no-report", "--no-recordings"],
        ):
            done = subprocess.run(poolcal + command, capture_output=True, text=True)
            if done.returncode not in (0, 1):
                raise RuntimeError(done.stderr)
        calibration = json.loads((run / "report" / "calibration.json").read_text())
        return _row(calibration, json.loads(Path(f"{session}.truth.json").read_text()))


def _row(calibration: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    block = calibration["methods"]["adjustment"]
    covariance = np.array(block["covariance"])
    error = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), truth)
    row: dict[str, Any] = {
        "accepted": calibration["verdict"] == "accepted",
        "reasons": "; ".join(calibration["reasons"]),
    }
    row["nse"] = float(error @ np.linalg.solve(covariance, error))
    sigma = np.sqrt(np.diag(covariance))
    for k, name in enumerate(NAMES):
        row |= {f"error_{name}": error[k] / UNITS[k], f"sigma_{name}": sigma[k] / UNITS[k]}
    row |= {f"covariance_{i}{k}": covariance[i, k] for i in range(6) for k in range(i + 1)}
    return row


def session_row(task: tuple[Campaign, int]) -> dict[str, Any]:
    """Return the row of a session, by its campaign and number."""
    campaign, number = task
    row = session_through_files(*task) if campaign.through_files else session_in_memory(*task)
    return {"campaign": campaign.name, "seed": campaign.first_seed + number} | row


def report(campaign: Campaign, table: pd.DataFrame) -> str:
    """Return the summary of a campaign in five lines."""
    n = len(table)
    low, high = (float(q) / n for q in chi2.ppf([0.005, 0.995], 6 * n))
    mean = table["nse"].mean()
    verdict = "inside" if low <= mean <= high else "OUTSIDE"
    lines = [
        f"{campaign.name}: {n} sessions, {int(table['accepted'].sum())} accepted; mean normalised squared error "
        f"{mean:.2f}, {verdict} its 99 % band {low:.2f}-{high:.2f}",
        f"  {'':16}" + "".join(f"{name:>10}" for name in NAMES) + "     (degrees, millimetres)",
    ]
    for word, values in (
        ("RMS error", [np.sqrt(np.mean(table[f"error_{name}"] ** 2)) for name in NAMES]),
        ("largest error", [table[f"error_{name}"].abs().max() for name in NAMES]),
        ("mean sigma", [np.sqrt(np.mean(table[f"sigma_{name}"] ** 2)) for name in NAMES]),
    ):
        lines.append(
            f"  {word:16}" + "".join(f"{value:10.4f}" if k < 3 else f"{value:10.3f}" for k, value in enumerate(values))
        )
    return "\n".join(lines)


def pairs(table: pd.DataFrame) -> str:
    """Return the results of comparing sessions 0 and 1, 2 and 3, … as they are and with one mount parameter moved.

    The comparison is that of ``poolcal diff``.
    """
    from pipeline.maths.comparison import MountEstimate, compare_estimates
    from pipeline.maths.geometry.rotations import exp_so3
    from pipeline.results.mount_difference import SIGNIFICANCE

    def estimate(row: Any, moved: Array) -> MountEstimate:
        """Return the estimate of a true mount of zero plus ``moved``: estimated = Exp(-error) · true."""
        error = np.array([row[f"error_{name}"] for name in NAMES]) * UNITS
        covariance = np.zeros((6, 6))
        for i in range(6):
            for k in range(i + 1):
                covariance[i, k] = covariance[k, i] = row[f"covariance_{i}{k}"]
        return MountEstimate(exp_so3(-error[:3]) @ exp_so3(moved[:3]), moved[3:] - error[3:], covariance)

    rows = table.to_dict("records")
    pairs_of_rows = list(zip(rows[::2], rows[1::2], strict=True))
    count, still = len(pairs_of_rows), np.zeros(6)
    comparisons = [compare_estimates(estimate(a, still), estimate(b, still)) for a, b in pairs_of_rows]
    alarms = sum(comparison.probability < SIGNIFICANCE for comparison in comparisons)
    lines = [f"  compared in {count} pairs: {alarms} false alarms, {100 * alarms / count:.1f} % (level 1 %)"]
    for k, name in enumerate(NAMES):
        move = np.zeros(6)
        move[k] = np.radians(MOVED_DEG) if k < 3 else MOVED_MM / 1000
        comparisons = [compare_estimates(estimate(a, still), estimate(b, move)) for a, b in pairs_of_rows]
        significant = [comparison.significant(SIGNIFICANCE) for comparison in comparisons]
        detected = 100 * np.mean([bool(parameters) for parameters in significant])
        named = 100 * np.mean([k in parameters for parameters in significant])
        size = f"{MOVED_DEG}°" if k < 3 else f"{MOVED_MM} mm"
        lines.append(f"  {name} moved by {size}: found in {detected:.1f} % of the pairs, {name} named in {named:.1f} %")
    return "\n".join(lines)


def main() -> None:
    """Simulate and calibrate the campaigns, write their rows and print a summary of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="campaigns to run, by the beginning of their names; default: all"
    )
    parser.add_argument("--share", type=float, default=1.0, help="share of each campaign's sessions; default: 1")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument(
        "--resume", action="store_true", help="continue campaigns that were interrupted; the program must be the same"
    )
    options = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for campaign in CAMPAIGNS:
        if options.only and not any(campaign.name.startswith(name) for name in options.only):
            continue
        started = time.monotonic()
        path = path_of(campaign).with_suffix(".csv")
        done = len(pd.read_csv(path)) if options.resume and path.is_file() else 0
        tasks = [(campaign, number) for number in range(done, max(2, round(campaign.sessions * options.share)))]
        with get_context("spawn").Pool(options.jobs, maxtasksperchild=TASKS_OF_A_WORKER) as pool:
            # each row is written at once, so that an interruption loses none
            for number, row in enumerate(pool.imap(session_row, tasks), start=done):
                pd.DataFrame([row]).to_csv(path, index=False, mode="a" if number else "w", header=not number)
        table = pd.read_csv(path)
        table.to_parquet(path_of(campaign), index=False)
        words = [report(campaign, table), *([pairs(table)] if campaign.pairs else [])]
        print("\n".join(words), f"\n  ({time.monotonic() - started:.0f} s)\n", flush=True)


if __name__ == "__main__":
    main()
