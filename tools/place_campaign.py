"""Sessions at places that nobody has drawn: whether the target is found, and the mount is as right as it is said to be.

Each session is simulated, with all errors drawn by their sigmas: each wet face is off by 2 cm and 0.1°, all are by
1.5 cm, as ``kind: found`` has it. ``poolcal run`` finds the target in the laser's points and calibrates. Its rows stand
in runs/places/ (``tools.campaign_files``).

    python -m tools.place_campaign [--only wall return ...] [--sessions 60] [--jobs 2] [--resume] > FILE.md
    python -m tools.place_campaign --rough [...]   # walls as they are (tools.rough_walls): what is accepted, left out
    python -m tools.place_campaign --noise [...]   # with the noise and the drift alone: whether the random sigmas hold
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
from pipeline.simulation.scenario import Scenario
from pipeline.target.design import target_of
from tools.campaign_files import collect_rows
from tools.campaigns import DRIFT, TASKS_OF_A_WORKER
from tools.drawn_errors import errors_at
from tools.place_pages import SEEDS_OF_A_PLACE, summary, summary_of_noise, summary_of_rough
from tools.places import PLACES, frame_of, scenario_of_place
from tools.rough_walls import drawn_into, drawn_names, longest_wall, masks_of_things
from tools.session_rows import error_columns, poolcal

FOLDER = Path("runs/places")
ROUGH_PLACES = ("slip", "lock", "returns", "slope")
FIRST_SEED = 70_000
PLANNED = 10  # sessions of a place for which the plan is asked, too
AS_BUILT = AsBuilt(offset_sigma_m=0.02, angle_sigma_deg=0.1, bow_sigma_m=0.005, growth_sigma_m=0.015)
TARGET = {"kind": "found", "depth_m": 4.0}


@dataclass(frozen=True)
class Task:
    """A session: its place, and its seed; whether the plan's sigmas are wanted.

    rough: the walls are as they are; noise: there are no systematic errors.
    """

    place: str
    seed: int
    planned: bool = False
    rough: bool = False
    noise: bool = False


def row_of(task: Task) -> dict[str, Any]:
    """Simulate and calibrate a session; return its row. A place without a target has the program's words as reason."""
    bare = scenario_of_place(task.place, {"ins": DRIFT})
    model = target_of(parse(Scenario, bare, "place").target)
    errors = {} if task.noise else errors_at(model, task.seed, AS_BUILT)
    scenario = scenario_of_place(task.place, {"ins": DRIFT}, errors)
    row: dict[str, Any] = {"place": task.place, "seed": task.seed}
    if task.rough:
        row |= drawn_into(scenario, task.place, task.seed)
    with tempfile.TemporaryDirectory() as folder:
        file, session, run, config = (Path(folder, name) for name in ("scenario.yaml", "session", "run", "pool.yaml"))
        file.write_text(yaml.safe_dump(scenario), encoding="utf-8")
        purpose = "order_1a" if task.rough else "special_order"
        config.write_text(yaml.safe_dump({"target": TARGET, "verdict": {"purpose": purpose}}), encoding="utf-8")
        poolcal(["simulate", session, "--scenario", file, "--seed", task.seed], (0,))
        command = ["run", session, "--config", config, "--run", run, "--jobs", "1", "--no-report", "--no-recordings"]
        _, said = poolcal(command, (0, 1, 2))
        written = run / "report" / "calibration.json"
        if not written.is_file():
            return row | {"verdict": "no result", "reasons": said.strip().splitlines()[-1]}
        calibration = json.loads(written.read_text("utf-8"))
        truth = json.loads(Path(f"{session}.truth.json").read_text("utf-8"))
        found = json.loads((run / "found.json").read_text("utf-8"))["found"]
        if task.planned:
            known = _as_it_is(found, scenario, row["fault"]) if task.rough else found
            row |= _predicted(run, known, scenario, purpose, calibration["mbes"]["mount"])
        if task.rough:
            row |= _left_out(calibration, found["target"], scenario["target"])
    row |= {"verdict": calibration["verdict"], "reasons": " | ".join(calibration["reasons"])}
    row["told"] = "unseen_face_error" in calibration["warning_codes"]
    row |= {"codes": " ".join(dict.fromkeys(calibration["reason_codes"])), "faces": len(found["target"]["faces"])}
    return row | error_columns(calibration["methods"]["adjustment"], truth)


def _left_out(calibration: dict[str, Any], found: dict[str, Any], drawn: dict[str, Any]) -> dict[str, str]:
    """Return columns with the drawn names of faces whose soundings are left out, at all heights and at some."""
    rows, columns = calibration.get("left_out", []), {}
    for name, whole in (("left_out", True), ("stripes", False)):
        families = [row["family"] for row in rows if (row["low_m"] is None and row["high_m"] is None) == whole]
        columns[name] = " ".join(drawn_names(families, found, drawn))
    return columns


def _predicted(
    run: Path, found: dict[str, Any], scenario: dict[str, Any], purpose: str, mount: dict[str, float] | None
) -> dict[str, Any]:
    """Return the total sigmas that ``poolcal plan`` predicts for a run's passes at the found faces, deg and mm.

    allowed: whether they, and what they make of soundings, are within the limits. mount: that the session gave, because
    walls of one direction show yaw by its sine; None: the coarse one.
    """
    pool, plan, out, place = (run.parent / name for name in ("found.yaml", "plan.yaml", "planned.yaml", "planned"))
    settled = yaml.safe_load((run.parent / "session" / "session.yaml").read_text("utf-8"))
    settled["mbes"]["mount"] = mount or settled["mbes"]["mount"]
    place.mkdir()
    (place / "session.yaml").write_text(yaml.safe_dump(settled), encoding="utf-8")
    pool.write_text(yaml.safe_dump(found | {"verdict": {"purpose": purpose}}), encoding="utf-8")
    settings = parse(Scenario, scenario, "place")
    motion, sailed = settings.motion, pd.read_parquet(run / "ingest" / "passes.parquet")
    here, drawn = frame_of(found["target"]), frame_of(scenario["target"])
    middle = [[-float(np.mean(settings.track.distances_m)), 0.0, 0.0]]  # of the passes
    middle_m = float(here.points_from_ecef(drawn.points_to_ecef(np.array(middle)))[0, 1])
    content = {
        "ins_rate_hz": settings.ins.rate_hz,
        "unrest": {
            "roll_deg": motion.roll.amplitude,
            "pitch_deg": motion.pitch.amplitude,
            "sway_m": motion.sway.amplitude,
            "heave_m": motion.heave.amplitude,
            "period_s": motion.roll.period_s,
        },
        "laser": settings.laser.model_dump(include={"point_rate_hz", "line_rate_hz", "field_deg"}, mode="json"),
        "mbes": settings.mbes.model_dump(include={"ping_rate_hz", "sector_deg"}, mode="json"),
        "passes": [
            {  # seen from the found target, whose origin is on its own largest wall
                "distance_m": one["distance_m"],
                "course": "along" if one["length_m"] > 0 else "back",
                "speed_m_s": abs(one["speed_m_s"]),
                "heading_swing_deg": motion.heading.amplitude,
                "half_length_m": abs(one["length_m"]) / 2,
                "middle_m": middle_m,
            }
            for one in sailed.to_dict("records")
        ],
    }
    plan.write_text(yaml.safe_dump(content), encoding="utf-8")
    status, _ = poolcal(["plan", plan, "--session", place, "--config", pool, "--yaml", out], (0, 1, 2))
    given = yaml.safe_load(out.read_text("utf-8"))["given"] if status < 2 else {}  # 2: no plan with a mount so wrong
    sigmas = given.get("sigma_mount_total") or {}
    keys = {"pitch": "pitch_deg", "roll": "roll_deg", "yaw": "yaw_deg", "x": "x_m", "y": "y_m", "z": "z_m"}
    return {"allowed": status == 0} | {
        f"planned_{name}": sigmas.get(key, np.nan) * (1000.0 if key.endswith("_m") else 1.0)
        for name, key in keys.items()
    }


def _as_it_is(found: dict[str, Any], scenario: dict[str, Any], fault: str) -> dict[str, Any]:
    """Return what was found, with the walls' roughness and masks of the things before them, without the false face."""
    rough = scenario["surroundings"]
    rms_m = float(np.hypot(rough["fouling_sigma_m"], rough["unevenness_m"]))
    stated = {
        "roughness_m": rms_m,
        "dry_roughness_m": rough["unevenness_m"],
        "roughness_length_m": rough["unevenness_length_m"],
    }
    targets = found["target"], scenario["target"]
    drawn = {name: drawn_names([name], *targets)[0] for name in targets[0]["faces"]}
    true = {name: face for name, face in targets[0]["faces"].items() if drawn[name] != fault}
    for name in true:
        if drawn[name] == longest_wall(scenario["name"]):
            masks = masks_of_things(rough["boxes"], scenario["name"], name, *targets)
            true[name] = true[name] | {"masks": [*true[name].get("masks", []), *masks]}
    return found | {"target": found["target"] | {"faces": true}, "as_built": found["as_built"] | stated}


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(PLACES), help="default: all, or those fit for --rough")
    parser.add_argument("--sessions", type=int, default=60, help="of each place; default: 60")
    parser.add_argument("--jobs", type=int, default=2, help="sessions at a time; default: 2")
    parser.add_argument("--rough", action="store_true", help="walls as they are, with a false wet face in every second")
    parser.add_argument("--noise", action="store_true", help="without systematic errors, the random sigmas alone")
    parser.add_argument("--first", type=int, default=0, help="number of the first session; default: 0")
    parser.add_argument("--resume", action="store_true", help="keep the rows of an interrupted campaign")
    given = parser.parse_args()
    if given.first + given.sessions > SEEDS_OF_A_PLACE:
        parser.error(f"seeds are for {SEEDS_OF_A_PLACE} sessions of a place")
    tables = []
    for place in given.only or (ROUGH_PLACES if given.rough else PLACES):
        first = FIRST_SEED + SEEDS_OF_A_PLACE * list(PLACES).index(place) + given.first
        planned = given.sessions if given.rough else 0 if given.noise else PLANNED
        tasks = [
            Task(place, first + k, planned=k < planned, rough=given.rough, noise=given.noise)
            for k in range(given.sessions)
        ]
        path = FOLDER / f"{'rough-' * given.rough}{'noise-' * given.noise}{place}.parquet"
        tables.append(collect_rows(path, row_of, tasks, given.jobs, given.resume, TASKS_OF_A_WORKER))
    page = summary_of_rough if given.rough else summary_of_noise if given.noise else summary
    print(page(pd.concat(tables)), end="")


if __name__ == "__main__":
    main()
