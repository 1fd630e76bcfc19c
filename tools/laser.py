"""Simulate calibrations of the laser, each followed by a calibration of the sonar with its result.

Each number stands for two sessions with INS drift. In the first the laser's coarse mount has random errors with sigmas
of 0.3° and 3 cm on every axis, which the pool's config states, and the laser is calibrated. The second session takes
the laser's mount with its covariance and calibrates the sonar. The errors of the sonar's mount are then compared with a
total covariance whose only consider parameters are those of the laser's mount.

With ``--drift`` the INS errs faster than session.yaml says; then the laser alone is calibrated (``tools.stress`` has a
line for each such campaign).

    python -m tools.laser [--sessions 240] [--first 0] [--jobs 2] [--rows docs/accuracy/laser.parquet] [--resume]
    python -m tools.laser --drift "within 10 s" --sessions 100 [--resume]
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.maths.mount_parameters import SETTINGS
from tools.campaign_files import collect_rows, processes
from tools.campaign_statistics import nse_band
from tools.campaigns import DRIFT, FOLDER
from tools.session_rows import NAMES, UNITS, error_columns
from tools.stress_campaigns import WITHIN_10_S, WITHIN_30_S

Array = NDArray[np.float64]
ROWS = FOLDER / "laser.parquet"
FAST: dict[str, dict[str, float]] = {"within 10 s": WITHIN_10_S, "within 30 s": WITHIN_30_S}  # drifts by --drift
TASKS_OF_A_WORKER = 8  # two sessions each
FIRST_SEED, SECOND_SEED = 40_000, 50_000
PLUMB_DEG = 0.001
COARSE_DEG, COARSE_M = 0.3, 0.03  # sigmas of the coarse mount
FIT = {  # the target is as designed
    "face_sigma_deg": 0.001, "plumb_sigma_deg": PLUMB_DEG, "face_sigma_m": 0.0002,
    "coarse_sigma_deg": COARSE_DEG, "coarse_sigma_m": COARSE_M,
}  # fmt: skip
AS_DESIGNED = dict.fromkeys(("face_sigma_m", "offset_sigma_m", "angle_sigma_deg", "bow_sigma_m"), 0.0)
WIDE = {"max_sigma_deg": 1.0, "max_sigma_m": 1.0}
SURE = ("range_bias_sigma_m", "incidence_bias_sigma_m", "latency_sigma_s")
SURE_OF_MBES = ("level_bias_sigma_m", "projector_sigma_m", "sound_speed_sigma_m_s", "sound_speed_gradient_sigma_1_s")
BOUNDS = 12  # sessions over which the bound is averaged


def scenario_of(number: int) -> dict[str, Any]:
    """Return the scenario of one session, with its coarse errors."""
    sizes = np.repeat([COARSE_DEG, COARSE_M], 3)
    errors = sizes * np.random.default_rng([FIRST_SEED, number]).normal(size=6)  # not the simulator's numbers
    return {
        "name": "laser",
        "ins": DRIFT,
        "laser": {"point_rate_hz": 5000.0, "coarse_error": dict(zip(SETTINGS, errors.tolist(), strict=True))},
        "mbes": {"ping_rate_hz": 10.0},
    }


def calibrate(session: dict[str, Any], pool: dict[str, Any], made: Any) -> dict[str, Any]:
    """Calibrate in memory and return the content of calibration.json.

    Parameters
    ----------
    session
        Content of session.yaml.
    pool
        Content of pool.yaml.
    made
        The simulated session, for its raw data.
    """
    from pipeline.config.pool import PoolConfig
    from pipeline.config.session import SessionConfig
    from pipeline.config.yaml_models import parse
    from stages.in_memory import calibrate_in_memory

    raw = {"ins": made.ins, "laser": made.laser, "mbes": made.mbes}
    artefacts = calibrate_in_memory(parse(SessionConfig, session, "session"), parse(PoolConfig, pool, "pool"), raw)
    content: dict[str, Any] = json.loads(artefacts["report/calibration.json"])
    return content


def rows_of(drift: str) -> Path:
    """Return the file of a campaign's rows."""
    return ROWS.with_stem(f"laser_drift_{drift.replace(' ', '_')}") if drift else ROWS


def session_row(task: tuple[str, int]) -> dict[str, Any]:
    """Return the row of a drift and a number: errors and sigmas of laser and sonar, and the laser's verdict."""
    from pipeline.config.yaml_models import parse
    from pipeline.simulation.scenario import Scenario
    from pipeline.simulation.session import simulate_session

    drift, number = task
    scenario = scenario_of(number)
    if drift:
        scenario |= {"ins": {"drift": FAST[drift], "drift_declared": DRIFT["drift"]}, "mbes": {"ping_rate_hz": 0.5}}
    made = simulate_session(parse(Scenario, scenario, "laser"), FIRST_SEED + number)
    alone = {name: value for name, value in made.session.items() if name != "mbes"}
    alone["laser"] = alone["laser"] | dict.fromkeys(SURE, 0.0)
    result = calibrate(alone, made.pool | {"laser_fit": FIT, "as_built": AS_DESIGNED}, made)
    block = result["laser"]
    row: dict[str, Any] = {"number": number, "accepted": result["verdict"] == "accepted"}
    row |= {"held": " ".join(result["held"]), "rests_on_coarse": " ".join(result["rests_on_coarse"])}
    row |= error_columns(block, made.truth, "laser", "laser_")
    if drift:
        return row
    # the sonar, in another session, from the laser's result
    made = simulate_session(parse(Scenario, scenario_of(number), "laser"), SECOND_SEED + number)
    session = dict(made.session)
    found = {"mount": block["mount"], "mount_covariance": block["covariance_total"]}
    session["laser"] = session["laser"] | dict.fromkeys(SURE, 0.0) | found
    session["mbes"] = session["mbes"] | dict.fromkeys(SURE + SURE_OF_MBES, 0.0)
    pool = made.pool | {"as_built": AS_DESIGNED, "verdict": WIDE}
    sonar = calibrate(session, pool, made)["mbes"]
    return row | error_columns(sonar, made.truth, prefix="sonar_")


def laser_bound_of(number: int) -> Array:
    """Return the Cramér-Rao bound (6, 6) of a number's first session with its coarse mount, in rad and m."""
    from pipeline.config.yaml_models import parse
    from pipeline.simulation.scenario import Scenario
    from tools.bound import laser_bound

    bound = laser_bound(parse(Scenario, scenario_of(number), "laser"), FIRST_SEED + number, PLUMB_DEG)
    coarse = np.diag(np.repeat([np.radians(COARSE_DEG), COARSE_M], 3) ** -2.0)
    return np.asarray(np.linalg.inv(np.linalg.inv(bound) + coarse))


def report(table: pd.DataFrame, bound: Array) -> str:
    """Return the table of docs/theory/accuracy.md: RMS errors, bound and total sigmas, and the laser's verdicts."""
    n = len(table)
    low, high = nse_band(n)
    least = np.sqrt(np.diag(bound)) / UNITS
    lines = ["| | pitch ° | roll ° | yaw ° | x mm | y mm | z mm |", "|---|---:|---:|---:|---:|---:|---:|"]

    def line(words: str, values: Array, places: int | None = None) -> None:
        digits = [4, 4, 4, 1, 1, 1] if places is None else [places] * 6
        lines.append(f"| {words} | " + " | ".join(f"{v:.{d}f}" for v, d in zip(values, digits, strict=True)) + " |")

    def rms(stem: str) -> Array:
        return np.array([np.sqrt(np.mean(table[f"{stem}_{name}"] ** 2)) for name in NAMES])

    def head(sensor: str) -> None:
        nse = table[f"{sensor}_nse_total"].mean()
        lines.append(f"| **{sensor}**: {n} sessions, mean NSE {nse:.2f} ({low:.2f}–{high:.2f}) |  |  |  |  |  |  |")

    head("laser")
    line("RMS error", rms("laser_error"))
    line("RMS of the total sigmas", rms("laser_total"))
    line("Cramér–Rao bound, with the coarse mount", least)
    line("RMS ÷ bound", rms("laser_error") / least, 2)
    head("sonar")
    line("RMS error", rms("sonar_error"))
    line("RMS of the total sigmas", rms("sonar_total"))
    line("the same without the laser's covariance", rms("sonar_sigma"))
    line("RMS error ÷ RMS total sigma", rms("sonar_error") / rms("sonar_total"), 2)
    lines.append("")
    lines.append(f"{int(table['accepted'].sum())} accepted.")
    for column, words in (("held", "Not good enough"), ("rests_on_coarse", "Resting on the coarse mount")):
        kinds = [f"{names or 'none'} in {count}" for names, count in table[column].value_counts().items()]
        lines.append(f"{words}: {'; '.join(kinds)}.")
    return "\n".join(lines)


def main() -> None:
    """Simulate and calibrate the sessions, write their rows and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=240, help="count of numbers, two sessions each; default: 240")
    parser.add_argument("--first", type=int, default=0, help="first number; default: 0")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--rows", type=Path, help=f"Parquet file of the rows; default: {ROWS}, or one by the drift")
    parser.add_argument("--drift", choices=["", *FAST], default="", help="true drift; default: as session.yaml says")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted campaign of the same program")
    parser.add_argument("--report", action="store_true", help="print the table of an existing file of rows")
    options = parser.parse_args()
    path = options.rows or rows_of(options.drift)
    tasks = [(options.drift, number) for number in range(options.first, options.first + options.sessions)]
    if options.report:
        table = pd.read_parquet(path)
    else:
        table = collect_rows(path, session_row, tasks, options.jobs, options.resume, TASKS_OF_A_WORKER)
    if options.drift:
        return
    with processes(options.jobs) as pool:
        bound = np.mean(pool.map(laser_bound_of, table["number"].tolist()[:BOUNDS]), axis=0)
    print(report(table, np.asarray(bound)))


if __name__ == "__main__":
    main()
