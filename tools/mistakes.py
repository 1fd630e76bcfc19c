"""What a mistake does to the result, and whether the verdict sees it.

Each line is the default scenario with one thing wrong, simulated with three fixed seeds and calibrated in memory. The
table tells how many of the three were accepted, the largest errors of the adjustment in its angles and its lever arm,
and the largest error in its own sigmas: where the verdict is blind, the README must say so.

    python -m tools.mistakes [--jobs 2]
"""

import argparse
import copy
import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

from tools.montecarlo import DRIFT, THIN, errors_of

SEEDS = (1, 2, 3)
Change = Callable[[dict[str, Any], dict[str, Any], dict[str, Any]], None]  # of scenario, session and pool


def _scenario(**blocks: Any) -> Change:
    """The simulated world is otherwise; the crew does not know."""

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        for name, values in blocks.items():
            scenario[name] = scenario.get(name, {}) | values

    return change


def _laser(**values: float) -> Change:
    """session.yaml's laser mount is wrong by so much."""

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        mount = session.get("laser", {}).get("mount", {})
        for name, value in values.items():
            if name in mount:
                mount[name] += value

    return change


def _swapped(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
    mount = session.get("laser", {}).get("mount", {})
    if mount:
        mount["x_m"], mount["y_m"] = mount["y_m"], mount["x_m"]


def _target(**values: float) -> Change:
    """The pool's config has a letter wrong by so much."""

    def change(scenario: dict[str, Any], session: dict[str, Any], pool: dict[str, Any]) -> None:
        for name, value in values.items():
            if "target" in pool:
                pool["target"][name] += value

    return change


MISTAKES: dict[str, Change] = {
    "nothing wrong": _scenario(),
    "two passes, both at 6 m": _scenario(track={"distances_m": [6.0, 6.0]}),
    "two passes, at 4 and 8 m": _scenario(track={"distances_m": [4.0, 8.0]}),
    "INS drifts (Limits)": _scenario(ins=DRIFT),
    "INS drifts, one pass alone": _scenario(ins=DRIFT, track={"distances_m": [5.0]}),
    "sonar's clock 10 ms off": _scenario(mbes={"latency_s": 0.01}),
    "sonar's clock 50 ms off": _scenario(mbes={"latency_s": 0.05}),
    "laser's clock 50 ms off": _scenario(laser={"latency_s": 0.05}),
    "sound speed 0.33 % wrong": _scenario(mbes={"sound_speed_recorded_m_s": 1505.0}),
    "sound speed 1 % wrong": _scenario(mbes={"sound_speed_recorded_m_s": 1515.0}),
    "laser.mount: roll 0.1° wrong": _laser(roll_deg=0.1),
    "laser.mount: pitch 0.44° wrong (sign)": _laser(pitch_deg=0.44),
    "laser.mount: yaw 0.2° wrong": _laser(yaw_deg=0.2),
    "laser.mount: x and y interchanged": _swapped,
    "laser.mount: z 0.1 m wrong": _laser(z_m=0.1),
    "target.b 5 cm too large": _target(b=0.05),
    "target.c 20 cm too large": _target(c=0.2),
    "target.e 2 cm too large": _target(e=0.02),
}


def one(task: tuple[str, int]) -> tuple[bool, float, float, float] | None:
    """Accepted, largest error in degrees, in millimetres, in sigmas; None: refused, or no result."""
    from pipeline.config import PoolConfig, SessionConfig
    from pipeline.errors import PoolcalError
    from pipeline.parsing import parse
    from pipeline.simulation.scenario import Scenario
    from pipeline.simulation.session import simulate
    from stages.campaign import calibrate_in_memory

    name, seed = task
    scenario: dict[str, Any] = {"name": "mistake", **copy.deepcopy(THIN)}
    MISTAKES[name](scenario, {}, {})
    made = simulate(parse(Scenario, scenario, name), seed)
    session, pool = copy.deepcopy(made.session), copy.deepcopy(made.pool)
    MISTAKES[name]({}, session, pool)
    raw = {"ins": made.ins, "laser": made.laser, "mbes": made.mbes}
    try:
        found = calibrate_in_memory(parse(SessionConfig, session, "session"), parse(PoolConfig, pool, "pool"), raw)
    except PoolcalError:
        return None
    result = json.loads(found["report/calibration.json"])
    block = result["methods"]["adjustment"]
    if block["covariance"] is None:
        return None
    error = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), made.truth)
    sigmas = np.abs(error) / np.sqrt(np.diag(block["covariance"]))
    accepted = result["verdict"] == "accepted"
    return accepted, float(np.degrees(np.abs(error[:3]).max())), 1000 * float(np.abs(error[3:]).max()), sigmas.max()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    tasks = [(name, seed) for name in MISTAKES for seed in SEEDS]
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        answers = dict(zip(tasks, pool.map(one, tasks), strict=True))
    print("| what is wrong | accepted | largest error ° | mm | in sigmas |\n|---|---:|---:|---:|---:|")
    for name in MISTAKES:
        found = [answer for seed in SEEDS if (answer := answers[(name, seed)]) is not None]
        cells = ["refused", "", ""]
        if found:
            degrees, mm, sigmas = (max(answer[k] for answer in found) for k in (1, 2, 3))
            cells = [f"{degrees:.3f}", f"{mm:.1f}", f"{sigmas:.0f}"]
        print(f"| {name} | {sum(answer[0] for answer in found)} of {len(SEEDS)} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
