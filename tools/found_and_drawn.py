"""Values on a found target against those on a drawn one: a dock, a caisson, the patent's target, two returns.

Each session is simulated with all errors drawn by their sigmas (``tools.drawn_errors``), and calibrated twice: on the
target that ``kind: found`` finds in the laser's points, and on the drawn one, with the same ``as_built``. Drawn faces
that no found plane meets are ``seen: dry``, or left out below the water: soundings on them give what no finding can.
Found planes that are not drawn, such as a wall behind the target, are struck.

    python -m tools.found_and_drawn [--only dock ...] [--sessions 20] [--jobs 2] [--resume] > FILE.md
"""

import argparse
import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from pipeline.config.pool import AsBuilt
from pipeline.config.yaml_models import parse
from pipeline.maths.comparison import mount_error
from pipeline.maths.target.model import TargetModel
from pipeline.simulation.scenario import Scenario
from pipeline.target.design import target_of
from tools.campaign_files import collect_rows
from tools.campaigns import DRIFT, TASKS_OF_A_WORKER
from tools.drawn_errors import errors_at
from tools.places import frame_of, scenario_of_place
from tools.session_rows import NAMES, UNITS, error_columns, poolcal

FOLDER = Path("runs/found-and-drawn")
SCENARIOS = Path(__file__).parents[1] / "configs" / "scenarios"
AS_BUILT = AsBuilt(offset_sigma_m=0.02, angle_sigma_deg=0.1, bow_sigma_m=0.005, growth_sigma_m=0.015)
FOUND: dict[str, Any] = {"kind": "found", "depth_m": 4.0}
KINDS = {"dock": "dock.yaml", "caisson": "caisson.yaml", "patent": "drift.yaml", "returns": ""}  # "": of tools.places
FIRST_SEED = 90_000
SAME_DEG, SAME_M = 1.0, 0.05  # a drawn face within these of a found plane lies in it
HEAD = """# Found planes against drawn ones

Made by `python -m tools.found_and_drawn --only TARGET --sessions NUMBER`. In each session `kind: found` finds the
target in the laser's points; then the session is calibrated again on the drawn target, with the same `as_built`. All
errors are drawn by their sigmas, as in [places](places.md). In the first columns the values on the found target less
those on the drawn one, RMS in total sigmas of the former.

| target | sessions | {names} | all | largest | σ found ÷ drawn, largest | mean NSE found, drawn | a face left out |
|---|---{rules}|---|---|---|---|---|
"""
FOOT = """
Of the drawn target the sonar sees the faces that are found: the wall and both returns of the dock, not its ledges; both
sides of the caisson's corner, not the footing; of the patent's target the fronts of the blocks, and the wall between
them. Found planes that are not drawn, such as the wall behind the patent's target, are struck. Last column: sessions
in which the soundings on a found face were left out, because others contradicted them, and their largest difference. A
drawn face is never left out: these sessions are not in the other columns. After ±: standard deviation of the figure,
by the spread of the sessions.
"""


@dataclass(frozen=True)
class Task:
    """A session: the kind of its target, and its seed."""

    kind: str
    seed: int


def row_of(task: Task) -> dict[str, Any]:
    """Simulate a session and calibrate it on the found target and on the drawn one; return its row."""
    if file := KINDS[task.kind]:
        bare = yaml.safe_load((SCENARIOS / file).read_text("utf-8"))
    else:
        bare = scenario_of_place(task.kind, {"ins": DRIFT})
    model = target_of(parse(Scenario, bare, task.kind).target)
    errors = errors_at(model, task.seed, AS_BUILT)
    scenario = bare | {key: bare.get(key, {}) | block for key, block in errors.items()}
    row: dict[str, Any] = {"place": task.kind, "seed": task.seed}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scenario.yaml").write_text(yaml.safe_dump(scenario), encoding="utf-8")
        session = folder / "session"
        poolcal(["simulate", session, "--scenario", folder / "scenario.yaml", "--seed", task.seed], (0,))
        poolcal(["target", session, "--depth", FOUND["depth_m"], "--out", folder / "place.yaml"], (0,))
        target = yaml.safe_load((folder / "place.yaml").read_text("utf-8"))["target"]
        settings = yaml.safe_load((session / "pool.yaml").read_text("utf-8"))["target"]
        drawn, others = _same_faces(model, settings, target)
        found = _calibrated(folder, "found", {"target": FOUND | {"strike": others}})
        other = _calibrated(folder, "drawn", {"target": drawn, "as_built": AS_BUILT.model_dump(mode="json")})
        by_finding, by_drawing = (one["methods"]["adjustment"] for one in (found, other))
        truth = json.loads(Path(f"{session}.truth.json").read_text("utf-8"))
    row |= {"faces": len(target["faces"]) - len(others), "drawn_faces": len(drawn["faces"])}
    row["left"] = sum(one["low_m"] is one["high_m"] is None for one in found.get("left_out", []))
    row |= error_columns(by_finding, truth) | error_columns(by_drawing, truth, prefix="drawn_")
    mounts = [(np.array(one["R_body_from_mbes"]), np.array(one["lever_arm_m"])) for one in (by_drawing, by_finding)]
    apart = dict(zip(NAMES, mount_error(*mounts[1], *mounts[0]) / UNITS, strict=True))
    return row | {f"apart_{name}": float(value) / row[f"total_{name}"] for name, value in apart.items()}


def _calibrated(folder: Path, run: str, config: dict[str, Any]) -> dict[str, Any]:
    """Calibrate the session in ``folder`` with a config; return calibration.json."""
    (folder / f"{run}.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    place = ["--config", folder / f"{run}.yaml", "--run", folder / run]
    poolcal(["run", folder / "session", *place, "--jobs", "1", "--no-report", "--no-recordings"], (0, 1))
    calibration: dict[str, Any] = json.loads((folder / run / "report" / "calibration.json").read_text("utf-8"))
    return calibration


def _same_faces(
    model: TargetModel, settings: dict[str, Any], found: dict[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """Return the drawn target, of which the sonar sees the faces in found planes; those in one plane are related.

    And the names of found planes in which no drawn face lies, such as that of a wall behind the target.
    """
    theirs, own = frame_of(found), frame_of(settings)
    seen: dict[str, str] = {}
    relations, others = [], []
    for name, face in found["faces"].items():
        outline = own.points_from_ecef(theirs.points_to_ecef(np.array(face["corners"])))
        middle = outline.mean(axis=0)
        normal = np.linalg.svd(outline - middle)[2][2]
        same = [
            one
            for one in model.faces
            if abs(one.normal @ normal) > np.cos(np.radians(SAME_DEG))
            and np.abs((one.vertices_m - middle) @ normal).max() < SAME_M
        ]
        if not same:
            others.append(name)
        seen |= {one.name: one.seen for one in same}
        if len(same) > 1:
            relations.append({"same_plane": [one.name for one in same]})
    for family in model.families:
        ours = [model.faces[number] for number in family.faces]
        dry = [one.name for one in ours if one.name not in seen and one.vertices_m[:, 2].max() > model.water_level_m]
        seen |= dict.fromkeys(dry, "dry")
        if len(dry) > 1:
            relations.append({"height" if family.level else "distance": dry})
    kept = {key: settings[key] for key in ("origin", "azimuth_deg", "water_level_m") if key in settings}
    corners = {one.name: one.vertices_m.tolist() for one in model.faces}
    faces = {name: {"corners": corners[name], "seen": sensors} for name, sensors in seen.items()}
    return kept | {"kind": "faces", "faces": faces, "relations": relations}, others


def page(table: pd.DataFrame) -> str:
    """Return the page in Markdown."""
    lines = []
    for kind, every in table.groupby("place", sort=False):
        rows = every[every["left"] == 0]
        apart = rows[[f"apart_{name}" for name in NAMES]].to_numpy(float)
        of_name = np.sqrt((apart**2).mean(axis=0))
        found, drawn = (rows[[f"{end}total_{name}" for name in NAMES]].to_numpy(float) for end in ("", "drawn_"))
        ratios = np.median(found / drawn, axis=0)
        worst, out = int(np.argmax(ratios)), every[every["left"] > 0]
        largest = np.abs(out[[f"apart_{name}" for name in NAMES]].to_numpy(float)).max(initial=0.0)
        left = f"{len(out)}: {largest:.1f}" if len(out) else "0"
        squares = (apart**2).mean(axis=1)
        all_ = float(np.sqrt(squares.mean()))
        sigma = float(squares.std(ddof=1)) / (2 * all_ * np.sqrt(len(squares)))
        lines.append(
            f"| {kind} | {len(every)} | {' | '.join(f'{size:.2f}' for size in of_name)} | {all_:.2f} ± {sigma:.2f} | "
            f"{np.abs(apart).max():.1f} | {ratios[worst]:.2f} ({NAMES[worst]}) | "
            f"{rows['nse_total'].mean():.1f}, {rows['drawn_nse_total'].mean():.1f} | {left} |\n"
        )
    return HEAD.format(names=" | ".join(NAMES), rules="|---" * len(NAMES)) + "".join(lines) + FOOT


def main() -> None:
    """Run the campaign and print its page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(KINDS), default=list(KINDS), help="default: all")
    parser.add_argument("--sessions", type=int, default=20, help="of each target; default: 20")
    parser.add_argument("--jobs", type=int, default=2, help="sessions at a time; default: 2")
    parser.add_argument("--resume", action="store_true", help="keep the rows of an interrupted campaign")
    given = parser.parse_args()
    tables = []
    for kind in given.only:
        first = FIRST_SEED + 1000 * list(KINDS).index(kind)
        tasks = [Task(kind, first + number) for number in range(given.sessions)]
        path = FOLDER / f"{kind}.parquet"
        tables.append(collect_rows(path, row_of, tasks, given.jobs, given.resume, TASKS_OF_A_WORKER))
    print(page(pd.concat(tables)), end="")


if __name__ == "__main__":
    main()
