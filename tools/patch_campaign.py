"""Patch tests over a bottom, without a target: whether their angles are as right as they are said to be.

Each session is the scenario ``patch_test``, over its slope or over a bottom that is level all over, with all errors of
the sonar drawn by their sigmas, angles of the coarse mount wrong by 2.5°, and its lever arm by 2 cm (1 sigma) on each
axis. Its rows stand in runs/patch/ (``tools.campaign_files``).

    python -m tools.patch_campaign [--sessions 60] [--jobs 2] [--resume] > FILE.md
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from pipeline.artefacts.streams import Stream, serial
from pipeline.config.load import load_session
from pipeline.config.stage_settings import SonarPlacement, narrow
from pipeline.config.yaml_models import parse
from pipeline.maths.comparison import mount_error
from pipeline.patch_test.passes import read_passes
from pipeline.patch_test.solve import LEVER_M, HeadBefore, patch_test
from pipeline.readers.casts import with_cast
from pipeline.readers.dispatch import raw_parts
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import simulate_session, write_session
from pipeline.target.design import target_of
from tools.campaign_files import collect_rows
from tools.campaign_statistics import nse_band
from tools.campaigns import TASKS_OF_A_WORKER, coarse_error
from tools.drawn_errors import errors_at
from tools.session_rows import NAMES

FOLDER, SCENARIO = Path("runs/patch"), Path("configs/scenarios/patch_test.yaml")
FIRST_SEEDS = {"slope": 18_000, "level": 18_500}

HEAD = """# Patch tests

Made by `python -m tools.patch_campaign`, {sessions} sessions of each kind. Each is four passes over a bottom of 14 m by
20 m, 6 m deep, both ways, by a boat whose head looks to starboard: with a slope of 17° along the passes, or level all
over. The INS drifts; all errors of the sonar are drawn by their sigmas; the coarse angles are wrong by 2.5°, the lever
arm by 2 cm (1 sigma) on each axis, which nobody knows.

"""

EXPLAINED = """
The normalised squared error (NSE) of angles and lever arm by the total covariance is 6 in the mean if the sigmas are
true. "Seen in": the number of sessions in which pitch, roll, yaw is seen, that is, to 0.3° or better.
"""


def row_of(task: tuple[str, int]) -> dict[str, Any]:
    """Simulate a session, and make its patch test; return its row."""
    kind, seed = task
    scenario = yaml.safe_load(SCENARIO.read_text("utf-8"))
    if kind == "level":
        scenario["target"]["faces"]["slope"]["corners"] = [[-14, 0, -6], [0, 0, -6], [0, 10, -6], [-14, 10, -6]]
    drawn = errors_at(target_of(parse(Scenario, scenario, "patch_test").target), seed)
    arm = np.random.default_rng([seed, 4]).normal(scale=LEVER_M, size=3)
    coarse = coarse_error(seed, 2.5, 0.0) | dict(zip(("x_m", "y_m", "z_m"), arm.tolist(), strict=True))
    scenario["mbes"] |= drawn["mbes"] | {"coarse_error": coarse}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "session")
        settings = parse(Scenario, scenario, "patch_test")
        write_session(simulate_session(settings, seed), path, settings)
        session = load_session(path, with_cast)
        ins = Stream(raw_parts("ins", session.ins, path))
        soundings = Stream(raw_parts("mbes", session.sonar, path))
        passes = read_passes(ins, soundings, session, narrow(SonarPlacement, session.sonar), None)
        found = patch_test(passes, HeadBefore.of(session, session.sonar), serial)
        truth = json.loads(Path(f"{path}.truth.json").read_text("utf-8"))["mbes"]
    true = np.array(truth["R_body_from_mbes"]), np.array(truth["lever_arm_m"])
    error = mount_error(*true, found.mount.R_body_from_sensor, found.mount.lever_arm_body_m)
    units = np.repeat([np.degrees(1.0), 1000.0], 3)
    row: dict[str, Any] = {"kind": kind, "seed": seed, "settled": found.settled, "pieces": len(found.seen.pieces)}
    for name, e, sigma in zip(NAMES, error * units, np.sqrt(np.diag(found.covariance)) * units, strict=True):
        row |= {f"error_{name}": float(e), f"sigma_{name}": float(sigma)}
    row |= {f"seen_{name}": found.sees(f"{name}_deg") for name in NAMES[:3]} | {"doubtful": found.doubtful}
    return row | {"nse": float(error @ np.linalg.solve(found.covariance, error))}


def page(table: pd.DataFrame) -> str:
    """Return the page in Markdown."""
    heads = (
        "bottom", "mean NSE (99 % band)", f"RMS error: {', '.join(NAMES)} (°, mm)", "median sigma",
        "RMS of error ÷ sigma", "worst of an angle", "seen in", "in doubt",
    )  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for kind, rows in table.groupby("kind", sort=False):
        errors, sigmas = (rows[[f"{what}_{name}" for name in NAMES]].to_numpy(float) for what in ("error", "sigma"))
        seen = rows[[f"seen_{name}" for name in NAMES[:3]]].to_numpy(int).sum(axis=0)
        low, high = nse_band(len(rows))
        z = errors / sigmas
        cells = (
            str(kind), f"{rows['nse'].mean():.2f} ({low:.2f} to {high:.2f})", _sizes(np.sqrt((errors**2).mean(axis=0))),
            _sizes(np.median(sigmas, axis=0)), ", ".join(f"{size:.2f}" for size in np.sqrt((z**2).mean(axis=0))),
            f"{np.abs(z[:, :3]).max():.1f}", ", ".join(f"{count}" for count in seen),
            str(int(rows["doubtful"].sum())),
        )  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return HEAD.format(sessions=int(table.groupby("kind").size().max())) + "\n".join(lines) + "\n" + EXPLAINED


def _sizes(values: np.ndarray) -> str:
    return ", ".join(f"{size:.3f}" if k < 3 else f"{size:.0f}" for k, size in enumerate(values))


def main() -> None:
    """Run the campaign and print its page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=60, help="of each kind; default: 60")
    parser.add_argument("--jobs", type=int, default=2, help="sessions at a time; default: 2")
    parser.add_argument("--resume", action="store_true", help="keep the rows of an interrupted campaign")
    given = parser.parse_args()
    tables = []
    for kind, first in FIRST_SEEDS.items():
        tasks = [(kind, first + k) for k in range(given.sessions)]
        path = FOLDER / f"{kind}.parquet"
        tables.append(collect_rows(path, row_of, tasks, given.jobs, given.resume, TASKS_OF_A_WORKER))
    print(page(pd.concat(tables)), end="")


if __name__ == "__main__":
    main()
