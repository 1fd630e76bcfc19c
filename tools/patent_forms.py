"""Errors of the patent's three forms and of the adjustment on simulated sessions, as the table of docs/patent.md.

Each session is simulated and calibrated in memory: the default one, one with drift of the INS, both with one pass
alone, and sessions without noise: with the coarse mount of the default one, with the lever arm right before the
calibration, and with the target turned away from north. The table replaces the one between the marks of the page, or is
printed.

    python -m tools.patent_forms [docs/patent.md]
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.simulation.scenario import SCENARIOS_FOLDER, Scenario
from pipeline.simulation.session import simulate_session
from stages.in_memory import calibrate_in_memory
from tools.session_rows import NAMES, UNITS, errors_of

SEED = 1  # poolcal simulate's own
MARKS = "<!-- patent_forms -->\n", "<!-- /patent_forms -->\n"


@dataclass(frozen=True)
class Case:
    """A simulated session.

    Attributes
    ----------
    words
        What it is, for the table.
    scenario
        Name of the scenario in configs/scenarios.
    azimuth_deg
        Azimuth of the target's wall; None: the scenario's.
    true_lever_arm
        Whether the coarse lever arm is the true one.
    distances_m
        Distances of the passes from the wall; None: the scenario's, four passes from 4 to 8 m.
    """

    words: str
    scenario: str
    azimuth_deg: float | None = None
    true_lever_arm: bool = False
    distances_m: tuple[float, ...] | None = None


CASES = (
    Case("default session", "default"),
    Case("default session with drift of the INS", "drift"),
    Case("one pass alone, as in the patent", "default", distances_m=(6.0,)),
    Case("one pass alone, with drift of the INS", "drift", distances_m=(6.0,)),
    Case("without noise", "noise_free"),
    Case("without noise, lever arm right before", "noise_free", true_lever_arm=True),
    Case("without noise, wall at 90°", "noise_free", azimuth_deg=90.0),
    Case("without noise, wall at 163°", "noise_free", azimuth_deg=163.0),
)


def methods_of(case: Case) -> tuple[dict[str, Any], dict[str, Any]]:
    """Simulate and calibrate a session; return the methods' blocks of calibration.json, and the truth."""
    content = read_yaml(SCENARIOS_FOLDER / f"{case.scenario}.yaml")
    if case.azimuth_deg is not None:
        target = read_yaml(SCENARIOS_FOLDER / "default.yaml")["target"]
        content["target"] = target | {"azimuth_deg": case.azimuth_deg}
    if case.distances_m is not None:
        content["track"] = content.get("track", {}) | {"distances_m": list(case.distances_m)}
    made = simulate_session(parse(Scenario, content, case.scenario), SEED)
    if case.true_lever_arm:
        true = made.truth["mbes"]["mount"]
        made.session["mbes"]["mount"].update({key: true[key] for key in ("x_m", "y_m", "z_m")})
    artefacts = calibrate_in_memory(
        parse(SessionConfig, made.session, "session"),
        parse(PoolConfig, made.pool, "pool"),
        {"ins": made.ins, "laser": made.laser, "mbes": made.mbes},
    )
    return json.loads(artefacts["report/calibration.json"])["methods"], made.truth


def rows(case: Case) -> Iterator[list[str]]:
    """Yield the table's rows of a case: its words, then each method with its errors."""
    methods, truth = methods_of(case)
    yield [f"**{case.words}**", *[""] * (len(NAMES) + 1)]
    for method, block in methods.items():
        if block["mount"] is None:
            yield [method, *["–"] * len(NAMES), block["no_result"]]
            continue
        errors = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), truth) / UNITS
        numbers = [f"{round(error, 3) + 0.0:+.3f}" for error in errors[:3]]
        numbers += [f"{round(error, 1) + 0.0:+.1f}" for error in errors[3:]]
        steps = f"{block['iterations']} steps"
        yield [method, *numbers, steps if block["converged"] else f"not converged in {steps}"]


def table() -> str:
    """Return the table of all cases, in Markdown."""
    heads = [f"{name} {'°' if place < 3 else 'mm'}" for place, name in enumerate(NAMES)]
    lines = [["", *heads, "iteration"], ["---", *["---:"] * len(NAMES), "---"]]
    lines += [row for case in CASES for row in rows(case)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def main() -> None:
    """Print the table, or write it into a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=Path, nargs="?", metavar="PAGE", help="page whose table is replaced")
    page: Path | None = parser.parse_args().page
    text = table()
    if page is None:
        print(text, end="")
        return
    before, rest = page.read_text(encoding="utf-8").split(MARKS[0])
    page.write_text(before + MARKS[0] + text + MARKS[1] + rest.split(MARKS[1])[1], encoding="utf-8")


if __name__ == "__main__":
    main()
