"""Plant mistakes in simulated sessions, and tabulate their effect on the result and on the verdict.

Each line of the table is the default scenario with one mistake, simulated with fixed seeds and calibrated in memory. It
shows how many sessions were accepted and the adjustment's largest errors in angles and lever arm. For the accepted
sessions it also shows the largest normalised squared error by the total covariance and the largest error in total
sigmas. The README must name every mistake that the verdict does not notice. Each session is a row of
runs/montecarlo/mistakes.parquet.

    python -m tools.mistakes [--jobs 2] [--seeds 27] [--only NAME ...]
"""

import argparse
import copy
import json
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tools.campaigns import DRIFT, TASKS_OF_A_WORKER, THIN
from tools.session_rows import NAMES, UNITS, errors_of

SEEDS = 3
Change = Callable[[dict[str, Any], dict[str, Any], dict[str, Any]], None]  # changes scenario, session and pool in place


def _scenario(**blocks: Any) -> Change:
    """Return a function that changes the scenario alone.

    The simulator writes session.yaml and pool.yaml from the changed scenario. Of its errors they have the INS's drift,
    and no others.
    """

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        for name, values in blocks.items():
            scenario[name] = scenario.get(name, {}) | values

    return change


def _laser(**values: float) -> Change:
    """Return a change that adds errors to the laser's mount in session.yaml."""

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        mount = session.get("laser", {}).get("mount", {})
        for name, value in values.items():
            if name in mount:
                mount[name] += value

    return change


def _swapped(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
    """Interchange x and y of the laser's mount in session.yaml."""
    mount = session.get("laser", {}).get("mount", {})
    if mount:
        mount["x_m"], mount["y_m"] = mount["y_m"], mount["x_m"]


def _target(**values: float) -> Change:
    """Return a change that adds errors to the target's dimensions in the pool's config."""

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        for name, value in values.items():
            if "target" in pool:
                pool["target"][name] += value

    return change


def _thrice(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
    """Make the INS drift three times as far as session.yaml says."""
    figures = dict(DRIFT["drift"])
    scenario["ins"] = {"drift": figures | {key: 3 * value for key, value in figures.items() if "constant" not in key}}
    if "ins" in session:
        session["ins"]["drift"] = figures


def _pool(**values: Any) -> Change:
    """Return a change that gives other values to the target in the pool's config."""

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        if "target" in pool:
            pool["target"].update(values)

    return change


MISTAKES: dict[str, Change] = {
    "nothing wrong": _scenario(),
    "nothing wrong, INS drifts": _scenario(ins=DRIFT),
    "drift three times the figures": _thrice,
    "sonar's clock 10 ms off": _scenario(mbes={"latency_s": 0.01}),
    "sonar's clock 20 ms off": _scenario(mbes={"latency_s": 0.02}),
    "sonar's clock 60 ms off": _scenario(mbes={"latency_s": 0.06}),
    "laser's clock 50 ms off": _scenario(laser={"latency_s": 0.05}),
    "sound speed 0.3 % wrong": _scenario(mbes={"sound_speed_recorded_m_s": 1504.5}),
    "sound speed 1 % wrong": _scenario(mbes={"sound_speed_recorded_m_s": 1515.0}),
    "sound speed changes by 0.05 °C/m": _scenario(mbes={"sound_speed_gradient_1_s": 0.15}),
    "transmitter 119 mm higher than told": _scenario(mbes={"projector_offset_m": [0.0, 0.0, 0.119]}),
    "transmitter 119 mm lower than told": _scenario(mbes={"projector_offset_m": [0.0, 0.0, -0.119]}),
    "transmitter 20 mm to starboard": _scenario(mbes={"projector_offset_m": [0.02, 0.0, 0.0]}),
    "target.e 2 cm too large": _target(e=0.02),
    "target leans by 0.3°": _scenario(surroundings={"tilt_deg": [0.0, 0.3]}),
    "one row of blocks missing": _pool(blocks_per_side=9),
    "wrong low_side": _pool(low_side="north"),
    "15 % outliers": _scenario(mbes={"outlier_share": 0.15}, laser={"outlier_share": 0.15}),
    "two passes, both at 6 m": _scenario(track={"distances_m": [6.0, 6.0]}),
    "four passes, all at 6 m": _scenario(track={"distances_m": [6.0, 6.0, 6.0, 6.0]}),
    "INS drifts, one pass alone": _scenario(ins=DRIFT, track={"distances_m": [5.0]}),
    "laser.mount: roll 0.1° wrong": _laser(roll_deg=0.1),
    "laser.mount: pitch 0.44° wrong (sign)": _laser(pitch_deg=0.44),
    "laser.mount: yaw 0.2° wrong": _laser(yaw_deg=0.2),
    "laser.mount: x and y interchanged": _swapped,
    "laser.mount: z 0.1 m wrong": _laser(z_m=0.1),
    "target.b 5 cm too large": _target(b=0.05),
    "target.c 20 cm too large": _target(c=0.2),
}


def session_row(task: tuple[str, int]) -> dict[str, Any]:
    """Return the row of a session, given its mistake and seed: verdict, errors and sigmas."""
    from pipeline.config.pool import PoolConfig
    from pipeline.config.session import SessionConfig
    from pipeline.config.yaml_models import parse
    from pipeline.errors import PoolcalError
    from pipeline.simulation.scenario import Scenario
    from pipeline.simulation.session import simulate_session
    from stages.in_memory import calibrate_in_memory

    name, seed = task
    scenario: dict[str, Any] = {"name": "mistake", **copy.deepcopy(THIN)}
    MISTAKES[name](scenario, {}, {})
    made = simulate_session(parse(Scenario, scenario, name), seed)
    session, pool = copy.deepcopy(made.session), copy.deepcopy(made.pool)
    MISTAKES[name]({}, session, pool)
    raw = {"ins": made.ins, "laser": made.laser, "mbes": made.mbes}
    empty = {f"{kind}_{axis}": np.nan for kind in ("error", "sigma") for axis in NAMES}
    row: dict[str, Any] = {"mistake": name, "seed": seed, "accepted": False, "nse": np.nan, "sigmas": np.nan} | empty
    try:
        artefacts = calibrate_in_memory(parse(SessionConfig, session, "session"), parse(PoolConfig, pool, "pool"), raw)
    except PoolcalError as error:
        return row | {"reasons": f"refused: {error}"}
    result = json.loads(artefacts["report/calibration.json"])
    block = result["methods"]["adjustment"]
    row |= {"accepted": result["verdict"] == "accepted", "reasons": " | ".join(result["reasons"])}
    if block["covariance_total"] is None:
        return row
    errors = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), made.truth)
    covariance = np.array(block["covariance_total"])
    sigma = np.sqrt(np.diag(covariance))
    row |= {"nse": float(errors @ np.linalg.solve(covariance, errors))}
    row |= {"sigmas": float(np.max(np.abs(errors) / sigma))}
    for k, axis in enumerate(NAMES):
        row |= {f"error_{axis}": errors[k] / UNITS[k], f"sigma_{axis}": sigma[k] / UNITS[k]}
    return row


def table_of(rows: pd.DataFrame) -> str:
    """Return a Markdown table with a line for each mistake."""
    lines = ["| what is wrong | accepted | largest error ° | mm | NSE if accepted | in sigmas |"]
    lines.append("|---|---:|---:|---:|---:|---:|")
    for name, group in rows.groupby("mistake", sort=False):
        accepted = group[group["accepted"]]
        errors = group[[f"error_{axis}" for axis in NAMES]].abs().to_numpy()
        cells = ["", "", "", ""]
        if np.isfinite(errors).any():
            cells[:2] = [f"{np.nanmax(errors[:, :3]):.3f}", f"{np.nanmax(errors[:, 3:]):.1f}"]
        if len(accepted):
            cells[2:] = [f"{accepted['nse'].max():.0f}", f"{accepted['sigmas'].max():.1f}"]
        lines.append(f"| {name} | {len(accepted)} of {len(group)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Simulate and calibrate the sessions, write their rows and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"sessions of each mistake; default: {SEEDS}")
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="mistakes to run, by the beginning of their names; default: all"
    )
    options = parser.parse_args()
    names = [name for name in MISTAKES if not options.only or any(name.startswith(start) for start in options.only)]
    tasks = [(name, seed) for name in names for seed in range(1, options.seeds + 1)]
    with get_context("spawn").Pool(options.jobs, maxtasksperchild=TASKS_OF_A_WORKER) as pool:
        rows = pd.DataFrame(list(pool.imap(session_row, tasks)))
    path = Path("runs/montecarlo/mistakes.parquet")
    path.parent.mkdir(parents=True, exist_ok=True)
    rows.to_parquet(path, index=False)
    print(table_of(rows))


if __name__ == "__main__":
    main()
