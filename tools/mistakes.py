"""Plant mistakes and real errors in simulated sessions, and tabulate their effect on the result and on the verdict.

Each line of the table is the default scenario, thinned, with one kind of error (``tools.mistake_kinds``,
``tools.mistake_effects``), simulated with fixed seeds and calibrated in memory. It shows how many sessions were
accepted and the adjustment's largest errors in angles and lever arm. For the accepted sessions it also shows the
largest normalised squared error by the total covariance and the largest error in total sigmas; for the rejected ones,
in how many of them what is named first is what was planted.
Above the table stand the same figures of all sessions together. docs/theory/mistakes.md must name every mistake that
the verdict does not notice. Each session is a row of runs/montecarlo/mistakes.parquet. All kinds are simulated with the
first seed, then with the second, and so on.

    python -m tools.mistakes [--jobs 2] [--seeds 25] [--only NAME ...] [--resume]
    python -m tools.mistakes --rows docs/accuracy/mistakes.parquet [--page docs/accuracy/mistakes.md]
"""

import argparse
import copy
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.report.limit_checks import LARGEST
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.sigma_sources import NOISE
from tools.campaign_files import collect_rows
from tools.campaigns import FOLDER, TASKS_OF_A_WORKER, THIN
from tools.mistake_effects import MISTAKES, REFUSED
from tools.session_rows import NAMES, UNITS, errors_of

PAGE_HEAD = """# Mistakes and real errors, and what the verdict makes of them

Each line is the default scenario, its laser and INS thinned to 5000 points and 100 records a second, with one error
that session.yaml does not know. Largest errors: of all sessions, also of the rejected ones, in ° of the angles and mm
of the lever arm. NSE (normalised squared error) and errors in sigmas: the largest of the accepted sessions, by the
total covariance. Named first: the rejected sessions in which the first reason names what was planted; empty where the
program has no name for it.
"""
BASE: dict[str, Any] = THIN | {"ins": {"rate_hz": 100.0}}  # half the records of the default: a sixth less work
SEEDS = 3
LARGEST_NSE, LARGEST_SIGMAS = 45.0, 5.0  # an accepted session beyond either is wrong and looks right


def named_first(result: Mapping[str, Any]) -> frozenset[str]:
    """Return the names of what the verdict of a rejected session names first.

    This is the strongest explanation of the residuals: a parameter, by its name and the parts of its name (the face
    among them), a set of parameters by its name, or a part of the points, by the code of its reason and by its face.
    Without an explanation it is the first reason, by its code, and "noise" where this is a sigma whose largest source
    is noise. (That the adjustment did not converge names nothing.)

    Parameters
    ----------
    result : mapping
        Content of calibration.json.
    """
    codes = {
        "face": ReasonCode.RESIDUALS_BY_FACE,
        "step": ReasonCode.RESIDUALS_STEP,
        "height": ReasonCode.RESIDUALS_BY_HEIGHT,
        "ping": ReasonCode.RESIDUALS_BY_PING,
        "pass": ReasonCode.PASSES_DISAGREE,
        "drift": ReasonCode.INS_DRIFT_BETWEEN_PASSES,
    }
    first = next((code for code in result["reason_codes"] if code != ReasonCode.NOT_CONVERGED), "")
    if not result["hypotheses"] or first not in (*codes.values(), ReasonCode.SUSPECTED_CAUSE):
        of_first = dict(zip(result["reason_codes"][::-1], result["reasons"][::-1], strict=True)).get(first, "")
        return frozenset({first, NOISE} if f"{LARGEST} {NOISE}" in of_first else {first})
    kind, name = result["hypotheses"][0]["kind"], result["hypotheses"][0]["name"]
    if kind == "parameter":
        of_face = {ReasonCode.RESIDUALS_BY_FACE} if name.startswith("face_") else set()
        return frozenset({name, name.removeprefix("face_"), *name.split("_"), *of_face})
    if kind == "set":
        return frozenset({name})
    return frozenset({codes[kind], name})


def session_row(task: tuple[str, int]) -> dict[str, Any]:
    """Return the row of a session, given its mistake and seed: verdict, what it names, errors and sigmas."""
    from pipeline.config.pool import PoolConfig
    from pipeline.config.session import SessionConfig
    from pipeline.config.yaml_models import parse
    from pipeline.errors import PoolcalError
    from pipeline.simulation.scenario import Scenario
    from pipeline.simulation.session import simulate_session
    from stages.in_memory import calibrate_in_memory

    name, seed = task
    scenario: dict[str, Any] = {"name": "mistake", **copy.deepcopy(BASE)}
    kind = MISTAKES[name]
    kind.change(scenario, {}, {})
    made = simulate_session(parse(Scenario, scenario, name), seed)
    session, pool = copy.deepcopy(made.session), copy.deepcopy(made.pool)
    kind.change({}, session, pool)
    raw = {"ins": made.ins, "laser": made.laser, "mbes": made.mbes}
    empty = {f"{kind}_{axis}": np.nan for kind in ("error", "sigma") for axis in NAMES}
    row: dict[str, Any] = {"mistake": name, "seed": seed, "accepted": False, "nse": np.nan, "sigmas": np.nan} | empty
    row |= {"named": ""}
    try:
        artefacts = calibrate_in_memory(parse(SessionConfig, session, "session"), parse(PoolConfig, pool, "pool"), raw)
    except PoolcalError as error:
        return row | {"named": REFUSED, "reasons": f"refused: {error}"}
    result = json.loads(artefacts["report/calibration.json"])
    block = result["methods"]["adjustment"]
    row |= {"accepted": result["verdict"] == "accepted", "reasons": " | ".join(result["reasons"])}
    if not row["accepted"]:
        row["named"] = " ".join(sorted(named_first(result)))
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


def with_right_names(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows, with columns for whether the program has a name for what was planted, and whether it gave it."""
    right = [MISTAKES[name].right for name in rows["mistake"]]
    named = [not names.isdisjoint(found.split()) for names, found in zip(right, rows["named"], strict=True)]
    return rows.assign(has_right=[bool(names) for names in right], named_right=named)


def table_of(rows: pd.DataFrame) -> str:
    """Return a Markdown table with a line for each mistake."""
    lines = ["| what is wrong | accepted | largest error ° | mm | NSE if accepted | in sigmas | named first |"]
    lines.append("|---|---:|---:|---:|---:|---:|---:|")
    for name, group in rows.groupby("mistake", sort=False):
        accepted = group[group["accepted"]]
        errors = group[[f"error_{axis}" for axis in NAMES]].abs().to_numpy()
        rejected = group[~group["accepted"]]
        cells = ["", "", "", "", ""]
        if np.isfinite(errors).any():
            cells[:2] = [f"{np.nanmax(errors[:, :3]):.3f}", f"{np.nanmax(errors[:, 3:]):.1f}"]
        if len(accepted):
            cells[2:4] = [f"{accepted['nse'].max():.0f}", f"{accepted['sigmas'].max():.1f}"]
        if len(rejected) and group["has_right"].all():
            cells[4] = f"{int(rejected['named_right'].sum())} of {len(rejected)}"
        lines.append(f"| {name} | {len(accepted)} of {len(group)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def summary(rows: pd.DataFrame) -> str:
    """Return what all sessions show: accepted ones that look right and are wrong, and how often the name is right."""
    accepted = rows[rows["accepted"]]
    wrong = accepted[(accepted["nse"] > LARGEST_NSE) | (accepted["sigmas"] > LARGEST_SIGMAS)]
    rejected = rows[~rows["accepted"]]
    named = rejected[rejected["has_right"]]
    kinds = ", ".join(sorted(set(wrong["mistake"]))) or "none"
    seen = (
        f"{len(rows)} sessions of {rows['mistake'].nunique()} kinds. Accepted: {len(accepted)}; of these with an NSE "
        f"above {LARGEST_NSE:.0f} or an error above {LARGEST_SIGMAS:.0f} total sigmas: {len(wrong)} ({kinds}).\n"
    )
    if not len(named):
        return f"{seen}Rejected: {len(rejected)}."
    return (
        f"{seen}Rejected: {len(rejected)}. In {len(named)} of these the program has a name for what was planted, and "
        f"names it first in {named['named_right'].mean():.1%}; that is "
        f"{named['named_right'].sum() / len(rejected):.1%} of all rejected."
    )


def main() -> None:
    """Simulate and calibrate the sessions, write their rows and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"sessions of each mistake; default: {SEEDS}")
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="mistakes to run, by the beginning of their names; default: all"
    )
    parser.add_argument("--resume", action="store_true", help="continue an interrupted campaign of the same program")
    parser.add_argument("--rows", type=Path, help="print the table of an existing file of rows")
    parser.add_argument("--page", type=Path, help="file that the table is written to; default: none, it is printed")
    options = parser.parse_args()
    if options.rows:
        rows = pd.read_parquet(options.rows)
    else:
        names = [name for name in MISTAKES if not options.only or any(name.startswith(start) for start in options.only)]
        tasks = [(name, seed) for seed in range(1, options.seeds + 1) for name in names]
        path = FOLDER / "mistakes.parquet"
        rows = collect_rows(path, session_row, tasks, options.jobs, options.resume, TASKS_OF_A_WORKER)
    rows = with_right_names(rows)
    text = f"{summary(rows)}\n\n{table_of(rows)}\n"
    if options.page is None:
        print(text, end="")
    else:
        options.page.write_text(f"{PAGE_HEAD}\n{text}", encoding="utf-8")


if __name__ == "__main__":
    main()
