"""Sessions at places that nobody has drawn: whether the target is found, and the mount is as right as it is said to be.

Each session is simulated, with all errors drawn by their sigmas and wet faces off by 2 cm and 0.1°; ``poolcal run``
finds the target in the laser's points and calibrates. Its rows stand in runs/places/ (``tools.campaign_files``).

    python -m tools.place_campaign [--only wall return ...] [--sessions 60] [--jobs 2] [--resume]
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from pipeline.config.pool import AsBuilt
from pipeline.config.yaml_models import parse
from pipeline.simulation.scenario import Scenario
from pipeline.target.design import target_of
from tools.campaign_files import collect_rows
from tools.campaign_statistics import nse_band
from tools.campaigns import DRIFT, TASKS_OF_A_WORKER
from tools.drawn_errors import errors_at
from tools.places import PLACES, scenario_of_place
from tools.session_rows import NAMES, error_columns

FOLDER = Path("runs/places")
FIRST_SEED = 70_000
AS_BUILT = AsBuilt(offset_sigma_m=0.02, angle_sigma_deg=0.1)
CONFIG: dict[str, Any] = {"target": {"kind": "found", "depth_m": 4.0}, "verdict": {"purpose": "special_order"}}


@dataclass(frozen=True)
class Task:
    """A session: its place, and its seed; ``planned``: whether the plan's sigmas are computed, too."""

    place: str
    seed: int
    planned: bool = False


def row_of(task: Task) -> dict[str, Any]:
    """Simulate and calibrate a session; return its row. A place without a target has the program's words as reason."""
    bare = scenario_of_place(task.place, {"ins": DRIFT})
    model = target_of(parse(Scenario, bare, "place").target)
    scenario = scenario_of_place(task.place, {"ins": DRIFT}, errors_at(model, task.seed, AS_BUILT))
    row: dict[str, Any] = {"place": task.place, "seed": task.seed}
    with tempfile.TemporaryDirectory() as folder:
        file, session, run, config = (Path(folder, name) for name in ("scenario.yaml", "session", "run", "pool.yaml"))
        file.write_text(yaml.safe_dump(scenario), encoding="utf-8")
        config.write_text(yaml.safe_dump(CONFIG), encoding="utf-8")
        _poolcal(["simulate", session, "--scenario", file, "--seed", task.seed], (0,))
        command = ["run", session, "--config", config, "--run", run, "--jobs", "1", "--no-report", "--no-recordings"]
        said = _poolcal(command, (0, 1, 2))
        written = run / "report" / "calibration.json"
        if not written.is_file():
            return row | {"verdict": "no result", "reasons": said.strip().splitlines()[-1]}
        calibration = json.loads(written.read_text("utf-8"))
        truth = json.loads(Path(f"{session}.truth.json").read_text("utf-8"))
        found = json.loads((run / "found.json").read_text("utf-8"))["found"]
        if task.planned:
            row |= _predicted(session, found, scenario)
    row |= {"verdict": calibration["verdict"], "reasons": " | ".join(calibration["reasons"])}
    row |= {"codes": " ".join(dict.fromkeys(calibration["reason_codes"])), "faces": len(found["target"]["faces"])}
    return row | error_columns(calibration["methods"]["adjustment"], truth)


def _predicted(session: Path, found: dict[str, Any], scenario: dict[str, Any]) -> dict[str, float]:
    """Return the total sigmas that ``poolcal plan`` predicts for these passes at the found faces, deg and mm."""
    pool, plan, out = (session.parent / name for name in ("found.yaml", "plan.yaml", "planned.yaml"))
    pool.write_text(yaml.safe_dump(found), encoding="utf-8")
    settings = parse(Scenario, scenario, "place")
    courses = settings.track.courses
    content = {
        "ins_rate_hz": settings.ins.rate_hz,
        "laser": settings.laser.model_dump(include={"point_rate_hz", "line_rate_hz", "field_deg"}, mode="json"),
        "mbes": settings.mbes.model_dump(include={"ping_rate_hz", "sector_deg"}, mode="json"),
        "passes": [
            {"distance_m": distance, "course": courses[k % len(courses)], "half_length_m": settings.half_length_m}
            for k, distance in enumerate(settings.track.distances_m)
        ],
    }
    plan.write_text(yaml.safe_dump(content), encoding="utf-8")
    _poolcal(["plan", plan, "--session", session, "--config", pool, "--yaml", out], (0, 1))
    sigmas = yaml.safe_load(out.read_text("utf-8"))["given"]["sigma_mount_total"] or {}
    keys = {"pitch": "pitch_deg", "roll": "roll_deg", "yaw": "yaw_deg", "x": "x_m", "y": "y_m", "z": "z_m"}
    return {
        f"planned_{name}": sigmas.get(key, np.nan) * (1000.0 if key.endswith("_m") else 1.0)
        for name, key in keys.items()
    }


def _poolcal(words: list[Any], allowed: tuple[int, ...]) -> str:
    done = subprocess.run([sys.executable, "-m", "stages.cli", *map(str, words)], capture_output=True, text=True)
    if done.returncode not in allowed:
        raise RuntimeError(done.stderr)
    return done.stderr


def summary(table: pd.DataFrame) -> str:
    """Return the table of the places in Markdown."""
    heads = ("place", "sessions", "with a result", "accepted", "mean NSE (99 % band)", "accepted beyond 5 σ")
    ratio = f"RMS ÷ total σ: {', '.join(NAMES)}"
    lines = [f"| {' | '.join(heads)} | {ratio} | median σ ÷ plan's |", "|---" * (len(heads) + 2) + "|"]
    for place, rows in table.groupby("place", sort=False):
        ended = rows[rows["error_x"].notna()] if "error_x" in rows else rows.iloc[:0]
        low, high = nse_band(max(len(ended), 1))
        errors, totals, planned = (
            rows[[f"{kind}_{name}" for name in NAMES]].to_numpy(float)
            for kind, rows in (("error", ended), ("total", ended), ("planned", ended.iloc[:1]))
        )
        accepted = (ended["verdict"] == "accepted").to_numpy()
        beyond = int((accepted & (np.abs(errors) > 5 * totals).any(axis=1)).sum())
        shares = np.sqrt((errors**2).mean(axis=0) / (totals**2).mean(axis=0)) if len(ended) else np.full(6, np.nan)
        against = np.median(totals / planned, axis=0) if len(ended) else np.full(6, np.nan)
        cells = (
            str(place), str(len(rows)), str(len(ended)), str(int(accepted.sum())),
            f"{ended['nse_total'].mean():.2f} ({low:.2f} to {high:.2f})", str(beyond),
            ", ".join(f"{share:.2f}" for share in shares), ", ".join(f"{share:.2f}" for share in against),
        )  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=list(PLACES), choices=list(PLACES), help="places; default: all")
    parser.add_argument("--sessions", type=int, default=60, help="of each place; default: 60")
    parser.add_argument("--jobs", type=int, default=2, help="sessions at a time; default: 2")
    parser.add_argument("--resume", action="store_true", help="keep the rows of an interrupted campaign")
    given = parser.parse_args()
    tables = []
    for place in given.only:
        first = FIRST_SEED + 1000 * list(PLACES).index(place)
        tasks = [Task(place, first + k, planned=k == 0) for k in range(given.sessions)]
        path = FOLDER / f"{place}.parquet"
        tables.append(collect_rows(path, row_of, tasks, given.jobs, given.resume, TASKS_OF_A_WORKER))
    print(summary(pd.concat(tables)))


if __name__ == "__main__":
    main()
