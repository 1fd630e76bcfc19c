"""Calibrate the laser of one boat twice, in calm and in rough weather, and test whether the results agree.

Each number stands for two sessions of one boat at one target, with the same wrong coarse mount of the laser and INS
drift. In the second the boat moves four times as much, so that other mount parameters may be good enough there than in
the first. Both are calibrated with the usual limits.

Of each pair whose calibrations are both accepted, the parameters that are good enough in both are compared, jointly:
d = second minus first, C the sum of both total covariances; the pair agrees if dᵀ C⁻¹ d is below the 95 % quantile of
chi-squared. So are all six. The error of the coarse mount is the same in both, so that C is larger than need be for
values that rest on it. The rows go to runs/montecarlo/laser_pairs.parquet.

    python -m tools.laser_pairs [--pairs 200] [--jobs 2] [--resume]
"""

import argparse
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import binom, chi2, norm

from pipeline.config.yaml_models import parse
from pipeline.maths.comparison import mount_error
from pipeline.simulation.scenario import Motion, Scenario
from pipeline.simulation.session import simulate_session
from tools.campaign_files import collect_rows
from tools.campaigns import FOLDER
from tools.laser import FIT, TASKS_OF_A_WORKER, calibrate, scenario_of
from tools.session_rows import NAMES, UNITS

Array = NDArray[np.float64]
CALM, ROUGH = 0.5, 2.0  # of the usual amplitudes
FIRST_SEEDS = {CALM: 60_000, ROUGH: 70_000}
WITHIN = 0.95  # probability
LEAST_SHARE = 0.93  # of the pairs, which are to agree


def session_result(number: int, weather: float) -> dict[str, Any]:
    """Return the content of calibration.json of a number's session in one of the weathers."""
    motion = Motion().model_dump()
    for wave in motion.values():
        if isinstance(wave, dict):
            wave["amplitude"] *= weather
    scenario = scenario_of(number) | {"motion": motion, "mbes": {"ping_rate_hz": 0.5}}  # the sonar is not used
    made = simulate_session(parse(Scenario, scenario, "laser pair"), FIRST_SEEDS[weather] + number)
    alone = {name: value for name, value in made.session.items() if name != "mbes"}
    return calibrate(alone, made.pool | {"laser_fit": FIT}, made)


def agreement(first: Mapping[str, Any], second: Mapping[str, Any], compared: list[str]) -> tuple[Array, float]:
    """Return how far two results differ.

    Parameters
    ----------
    first, second
        Blocks ``laser`` of calibration.json.
    compared
        Names of the parameters to compare.

    Returns
    -------
    z : (len(compared),) array
        Differences in sigmas of the difference, by the sum of the total covariances.
    probability : float
        That of a larger joint statistic, if only these errors make the difference.
    """
    mounts = [(np.array(block["R_body_from_laser"]), np.array(block["lever_arm_m"])) for block in (first, second)]
    d = mount_error(*mounts[1], *mounts[0])
    C = np.array(first["covariance_total"]) + np.array(second["covariance_total"])
    kept = [NAMES.index(name) for name in compared]
    d, C = d[kept], C[np.ix_(kept, kept)]
    sigma = np.sqrt(np.diag(C))
    z = d / sigma
    return z, float(chi2.sf(z @ np.linalg.solve(C / np.outer(sigma, sigma), z), len(kept)))


def pair_row(number: int) -> dict[str, Any]:
    """Return the row of a pair: verdicts, the parameters that are not good enough, and differences in sigmas."""
    calm, rough = (session_result(number, weather) for weather in (CALM, ROUGH))
    row: dict[str, Any] = {"number": number, "p_both": np.nan, "p_all": np.nan}
    for word, result in (("calm", calm), ("rough", rough)):
        row |= {f"accepted_{word}": result["verdict"] == "accepted", f"held_{word}": " ".join(result["held"])}
        row[f"reasons_{word}"] = "; ".join(result["reasons"])
        sigmas = result["laser"]["covariance_total"]
        total = np.full(6, np.nan) if sigmas is None else np.sqrt(np.diag(sigmas)) / UNITS
        row |= {f"total_{word}_{name}": float(value) for name, value in zip(NAMES, total, strict=True)}
    row |= {f"z_{name}": np.nan for name in NAMES}
    if not (row["accepted_calm"] and row["accepted_rough"]):
        return row
    both = [name for name in NAMES if name not in {*calm["held"], *rough["held"]}]
    if both:
        row["p_both"] = agreement(calm["laser"], rough["laser"], both)[1]
    z, row["p_all"] = agreement(calm["laser"], rough["laser"], list(NAMES))
    return row | {f"z_{name}": float(value) for name, value in zip(NAMES, z, strict=True)}


def share_within(inside: pd.Series) -> str:
    """Return in words how many of the compared agree, against the share that is to, and what chance leaves."""
    count, n = int(inside.sum()), len(inside)
    if not n:
        return "none compared"
    low, high = binom.ppf([0.005, 0.995], n, WITHIN)
    word = "enough" if count >= LEAST_SHARE * n else "TOO FEW"
    expected = f"{100 * LEAST_SHARE:.0f} %; chance: {low:.0f}–{high:.0f}"
    return f"{count} of {n} agree, {100 * count / n:.1f} %, {word} ({expected})"


def report(table: pd.DataFrame) -> str:
    """Return the summary: pairs compared, joint agreement, and each parameter."""
    accepted = table["accepted_calm"] & table["accepted_rough"]
    lines = [f"{len(table)} pairs, both accepted in {int(accepted.sum())}"]
    for word in ("calm", "rough"):
        kinds = [f"{names or 'none'} in {count}" for names, count in table[f"held_{word}"].value_counts().items()]
        lines.append(f"  not good enough in {word} weather: {'; '.join(kinds)}")
    for column, words in (("p_both", "good enough in both"), ("p_all", "all six")):
        lines.append(f"  {words}, jointly: {share_within(table[column].dropna() >= 1 - WITHIN)}")
    for name in NAMES:
        z = table[f"z_{name}"].dropna()
        if len(z):
            rms = np.sqrt(np.mean(z**2))
            lines.append(f"  {name}: RMS {rms:.2f} sigmas; {share_within(z.abs() <= norm.ppf((1 + WITHIN) / 2))}")
    return "\n".join(lines)


def main() -> None:
    """Simulate and calibrate the pairs, write their rows and print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=200, help="number of pairs, two sessions each; default: 200")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted campaign of the same program")
    options = parser.parse_args()
    path, numbers = FOLDER / "laser_pairs.parquet", range(options.pairs)
    print(report(collect_rows(path, pair_row, numbers, options.jobs, options.resume, TASKS_OF_A_WORKER)))


if __name__ == "__main__":
    main()
