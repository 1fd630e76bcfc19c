"""Measure the false alarms and the power of the residual tests on simulated sessions.

Sessions of several kinds without any fault show how often the tests reject a good session. Sessions with one planted
fault show whether the tests detect it and whether the reason names it. All sessions run in memory, up to the verdict.
Each is a row of a Parquet file with the largest normalised mean residual of every variable, with the program's
tolerance (columns ``u_…``) and without (``bare_…``). A test without tolerance has its nominal level, which some hundred
sessions can measure at 5 %; 0.1 % would need thousands of sessions.

    python -m tools.residual_tests [--good 300] [--seeds 20] [--jobs 1] [--resume] [--only NAME ...]
"""

import argparse
import copy
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import binom

from tools.campaign_files import in_order, processes
from tools.campaigns import DRIFT, FOLDER, TASKS_OF_A_WORKER, THIN, WHITE

Array = NDArray[np.float64]
Raw = dict[str, NDArray[Any]]
PATH = FOLDER / "residual_tests.parquet"
BY = ("face", "angle", "step", "height", "ping_2", "ping_3", "ping_4", "distance", "time", "pass", "drift")
TILT_DEG = 0.254  # between the sectors of a real head
APART_NS = 10 * 10**9  # a longer gap separates two passes
LEVELS = (0.001, 0.05)
SLANTED = ("P1-0", "P1-1", "P1-2", "P3-0", "P3-1", "P3-2")
TOPS = ("P1-0-top", "P1-1-top", "P3-0-top", "P3-1-top")
ANGLES_DEG = (10.0, 20.0, 30.0)
DOCK = Path("configs/scenarios/dock.yaml")
KINDS: dict[str, dict[str, Any]] = {
    "INS drift": {"ins": DRIFT},
    "INS white noise": {},
    "sensors alone": {"ins": WHITE["ins"]},
    "dock": {},
}


@dataclass
class World:
    """The parts of a simulated session that a fault may change.

    Attributes
    ----------
    number
        Number of the session; faults vary with it.
    mbes
        Soundings as recorded.
    pool
        Content of pool.yaml.
    truth
        Content of truth.json.
    again
        Simulates the soundings of the same session again, with the sonar turned by a rotation vector (3,) in its own
        frame, rad.
    """

    number: int
    mbes: Raw
    pool: dict[str, Any]
    truth: dict[str, Any]
    again: Callable[[Array], Raw]

    @property
    def angle_deg(self) -> Array:
        """Receive angles (n,)."""
        return np.asarray(np.degrees(self.mbes["angle_rad"]))

    @property
    def passes(self) -> NDArray[np.int64]:
        """Number of each sounding's pass (n,)."""
        return np.cumsum(np.diff(self.mbes["t_ns"], prepend=self.mbes["t_ns"][0]) > APART_NS)

    def longer(self, rows: NDArray[np.bool_], by_m: float) -> None:
        """Lengthen the ranges of some soundings (n,)."""
        self.mbes["two_way_time_s"] = self.mbes["two_way_time_s"] + rows * 2 * by_m / self.mbes["sound_speed_m_s"]

    def mix(self, other: Raw, taken: Callable[[Raw], NDArray[np.bool_]]) -> None:
        """Replace the soundings that ``taken`` selects by those of ``other``."""
        own, others = ~taken(self.mbes), taken(other)
        both = {name: np.concatenate([self.mbes[name][own], other[name][others]]) for name in other}
        order = np.lexsort((both["beam"], both["ping"]))
        self.mbes = {name: values[order] for name, values in both.items()}


def _face(names: tuple[str, ...]) -> Callable[[World], str]:
    def plant(world: World) -> str:
        """Plant a face that stands 20 mm farther out than the config says."""
        name = names[world.number % len(names)]
        world.pool["as_built"] = {"faces": {name: -0.02}}
        return f"face {name} "

    return plant


def _step(world: World) -> str:
    at = ANGLES_DEG[world.number % len(ANGLES_DEG)]
    world.longer(world.angle_deg > at, 0.01)
    return f"receive angle of {at:.0f}°"


def _pass_ranges(world: World) -> str:
    number = world.number % 4
    world.longer(world.passes == number, 0.005)
    return f"in pass {number}"


def _pass_shifted(world: World) -> str:
    """Move the sonar 8 mm to starboard in one pass."""
    number = world.number % 4
    rows = world.passes == number
    shift = np.array(world.truth["mbes"]["R_body_from_mbes"]).T @ [0.008, 0.0, 0.0]
    range_m = world.mbes["two_way_time_s"] * world.mbes["sound_speed_m_s"] / 2
    angle = world.mbes["angle_rad"]
    x, z = range_m * np.sin(angle) - shift[0], -range_m * np.cos(angle) - shift[2]  # of a sonar nearer to the wall
    world.mbes["two_way_time_s"] = np.where(rows, np.hypot(x, z) / range_m, 1.0) * world.mbes["two_way_time_s"]
    world.mbes["angle_rad"] = np.where(rows, np.arctan2(x, -z), angle)
    return f"in pass {number}"


def _sectors(border_deg: float) -> Callable[[World], str]:
    def plant(world: World) -> str:
        """Tilt the middle of the fan forward against its flanks, without a record in the file."""
        tilted = world.again(np.array([np.radians(TILT_DEG), 0.0, 0.0]))
        world.mix(tilted, lambda raw: np.abs(np.degrees(raw["angle_rad"])) <= border_deg)
        return "steps by"

    return plant


def _by_turns(world: World) -> str:
    """Tilt every second ping forward, as two alternating frequencies would, without a record in the file."""
    world.mix(world.again(np.array([np.radians(TILT_DEG), 0.0, 0.0])), lambda raw: raw["ping"] % 2 == 1)
    return "in one ping of 2"


# each function changes the session and returns words that the reason must contain
FAULTS: dict[str, Callable[[World], str]] = {
    "a slanted face 20 mm off": _face(SLANTED),
    "a top 20 mm too high": _face(TOPS),
    "ranges step by 10 mm at an angle": _step,
    "one pass: sonar 8 mm farther": _pass_shifted,
    "one pass: ranges 5 mm longer": _pass_ranges,
    "sectors: 0.254° within 15°": _sectors(15.0),
    "sectors: 0.254° within 30°": _sectors(30.0),
    "sectors: 0.254° within 40°": _sectors(40.0),
    "tilts: 0.254° every other ping": _by_turns,
}
Task = tuple[str, str, int]  # fault or "", kind, number


def scenario_of(kind: str, number: int) -> dict[str, Any]:
    """Return the scenario of a session, with thinned laser points and its combination of coarse errors."""
    scenario: dict[str, Any] = yaml.safe_load(DOCK.read_text()) if kind == "dock" else {"name": kind, **KINDS[kind]}
    keys = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")
    signs = [1.0 if number >> bit & 1 else -1.0 for bit in range(6)]
    coarse = {key: sign * size for key, sign, size in zip(keys, signs, [1.0] * 3 + [0.1] * 3, strict=True)}
    return scenario | THIN | {"mbes": {"coarse_error": coarse}}


def session_row(task: Task) -> dict[str, Any]:
    """Return the row of a session: verdict, reasons, and the largest normalised mean residual of each variable."""
    from pipeline.config.pool import PoolConfig
    from pipeline.config.session import SessionConfig
    from pipeline.config.yaml_models import parse
    from pipeline.maths.adjustment.mean_tests import normal_deviates
    from pipeline.simulation.scenario import Scenario
    from pipeline.simulation.session import simulate_session
    from stages.in_memory import calibrate_in_memory

    fault, kind, number = task
    seed = seed_of(task)
    scenario = scenario_of(kind, number)
    made = simulate_session(parse(Scenario, scenario, kind), seed)

    def again(turn_rad: Array) -> Raw:
        turned = copy.deepcopy(scenario)
        R_body_from_mbes = np.array(made.truth["mbes"]["R_body_from_mbes"]) @ Rotation.from_rotvec(turn_rad).as_matrix()
        yaw, pitch, roll = Rotation.from_matrix(R_body_from_mbes).as_euler("ZXY", degrees=True)
        mount = {name: made.truth["mbes"]["mount"][name] for name in ("x_m", "y_m", "z_m")}
        turned["mbes"]["mount"] = mount | {"roll_deg": roll, "pitch_deg": pitch, "yaw_deg": yaw}
        return dict(simulate_session(parse(Scenario, turned, kind), seed).mbes)

    world = World(number, dict(made.mbes), copy.deepcopy(made.pool), made.truth, again)
    expected = FAULTS[fault](world) if fault else ""
    artefacts = calibrate_in_memory(
        parse(SessionConfig, made.session, "session"),
        parse(PoolConfig, world.pool, "pool"),
        {"ins": made.ins, "laser": made.laser, "mbes": world.mbes},
    )
    result, patterns = json.loads(artefacts["report/calibration.json"]), artefacts["adjust/patterns"]
    matching = [reason for reason in result["reasons"] if reason.startswith(("residuals go with", "the passes do not"))]
    row: dict[str, Any] = {"fault": fault, "kind": kind, "seed": seed, "accepted": result["verdict"] == "accepted"}
    row |= {"reasons": " | ".join(result["reasons"]), "tests": len(patterns), "found": bool(matching)}
    row |= {"named": bool(matching) and expected in result["reasons"][0]}
    mean_m, sigma_m, dof = (patterns[name].to_numpy(np.float64) for name in ("mean_m", "sigma_mean_m", "dof"))
    patterns = patterns.assign(bare=normal_deviates(mean_m, sigma_m, dof, tolerated=0.0))
    for by in BY:
        rows = patterns[patterns["by"] == by]
        row |= {f"number_{by}": len(rows), f"u_{by}": rows["normalised"].abs().max()}
        row |= {f"bare_{by}": rows["bare"].abs().max()}
    return row


def seed_of(task: Task) -> int:
    """Return the seed of a session."""
    fault, kind, number = task
    return 60000 + 1000 * list(KINDS).index(kind) + number + (10000 if fault else 0)


def read(path: Path) -> pd.DataFrame:
    """Return the rows that are already written."""
    numbers = {f"{start}{by}": "" for start in ("u_", "bare_") for by in BY}  # empty where a variable was not tested
    return pd.read_csv(path, keep_default_na=False, na_values=numbers)


def summary(rows: pd.DataFrame) -> str:
    """Return two Markdown tables: false alarms at two levels, without and with the tolerance; then each fault."""
    from pipeline.maths.adjustment.mean_tests import joint_limit

    heads = [f"{100 * level:g} %, {tolerance}" for tolerance in ("tolerance 0", "as it is") for level in LEVELS]
    lines = [f"| good sessions | number | {' | '.join(heads)} | accepted |", "|---|---:|---:|---:|---:|---:|---:|"]
    good = rows[rows["fault"] == ""]
    for kind, group in [*good.groupby("kind", sort=False), ("all", good)]:
        cells = []
        for start in ("bare_", "u_"):
            largest = group[[f"{start}{by}" for by in BY]].max(axis=1)
            for level in LEVELS:
                limits = np.array([joint_limit(number, level) for number in group["tests"]])
                most = int(binom.ppf(0.995, len(group), level))
                cells.append(f"{int((largest > limits).sum())} (≤ {most})")
        lines.append(f"| {kind} | {len(group)} | " + " | ".join(cells) + f" | {int(group['accepted'].sum())} |")
    lines += ["", "| fault | sessions | rejected by residuals | first by its name |", "|---|---:|---:|---:|"]
    for fault, group in rows[rows["fault"] != ""].groupby("fault", sort=False):
        lines.append(f"| {fault} | {len(group)} | {int(group['found'].sum())} | {int(group['named'].sum())} |")
    return "\n".join(lines)


def tasks_of(good: int, seeds: int) -> list[Task]:
    """Return the sessions of all kinds in turn, so that an interrupted campaign has sessions of each kind.

    Sessions with a fault are of the first three kinds.
    """
    kinds = list(KINDS)
    of_good: list[Task] = [("", kinds[k % len(kinds)], k // len(kinds)) for k in range(good)]
    of_faults: list[Task] = [(fault, kinds[k % 3], k) for k in range(seeds) for fault in FAULTS]
    return of_faults + of_good


def main() -> None:
    """Simulate and calibrate the sessions, write their rows and print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--good", type=int, default=300, help="number of sessions without a fault; default: 300")
    parser.add_argument("--seeds", type=int, default=20, help="number of sessions for each fault; default: 20")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument(
        "--resume", action="store_true", help="continue an interrupted campaign; the program must be the same"
    )
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="faults or kinds, by the beginning of their names; default: all"
    )
    options = parser.parse_args()
    PATH.parent.mkdir(parents=True, exist_ok=True)
    path = PATH.with_suffix(".csv")
    tasks = [
        task
        for task in tasks_of(options.good, options.seeds)
        if not options.only or (task[0] or task[1]).startswith(tuple(options.only))
    ]
    done = read(path) if options.resume and path.is_file() else pd.DataFrame(columns=["fault", "seed"])
    written = set(zip(done["fault"], done["seed"], strict=True))
    left = [task for task in tasks if (task[0], seed_of(task)) not in written]
    with processes(options.jobs, TASKS_OF_A_WORKER) as pool:
        # each row is written at once, so that an interruption loses none
        for number, row in enumerate(in_order(pool, session_row, left, options.jobs), start=len(done)):
            pd.DataFrame([row]).to_csv(path, index=False, mode="a" if number else "w", header=not number)
    rows = read(path)
    rows.to_parquet(PATH, index=False)
    print(summary(rows))


if __name__ == "__main__":
    main()
