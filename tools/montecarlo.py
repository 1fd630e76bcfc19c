"""Simulate and calibrate many sessions, and test whether the errors agree with the predicted sigmas.

For each campaign the program prints the errors of the six mount parameters, the number of accepted sessions, and the
mean normalised squared error with its 99 % band; the expectation of the latter is 6 if the covariance is right. Seeds
are fixed. In every session the coarse mount is wrong by 2.5° and 0.25 m on every axis at once, and the signs of these
errors go through all 64 combinations. Each session is a row of a file in runs/montecarlo/ (``tools.campaign_files``).
``tools.accuracy`` makes the table of docs/theory/accuracy.md and an HTML page from these files, ``tools.stress`` the
table of the campaigns under noise that the settings do not describe (``tools.stress_campaigns``).

    python -m tools.montecarlo [--only NAME ...] [--share 0.1] [--jobs 2] [--resume]
    python -m tools.montecarlo --seeds 8030 9012
"""

import argparse
import time
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from tools.campaign_files import collect_rows
from tools.campaign_statistics import statistics_of
from tools.campaigns import TASKS_OF_A_WORKER, Campaign, path_of
from tools.session_pairs import pairs_report
from tools.session_rows import NAMES, session_row
from tools.stress_campaigns import ALL, campaign_of, named


def report(campaign: Campaign, table: pd.DataFrame) -> str:
    """Return the summary of a campaign in six lines. Sigmas are total ones if systematic errors are drawn."""
    statistics = statistics_of(table)
    kind, squared = campaign.judged_by
    nse = getattr(statistics, squared)
    low, high = statistics.band
    verdict = "inside" if low < nse < high else "OUTSIDE"
    lines = [
        f"{campaign.name}: {statistics.sessions} sessions, {statistics.accepted} accepted; mean normalised squared "
        f"error {nse:.2f}, {verdict} its 99 % band {low:.2f}-{high:.2f}",
        f"  {'':16}" + "".join(f"{name:>10}" for name in NAMES) + "     (degrees, millimetres)",
    ]
    errors, sigmas = (np.array([table[f"{word}_{name}"] for name in NAMES]) for word in ("error", kind))
    for word, values in (
        ("RMS error", np.sqrt(np.mean(errors**2, axis=1))),
        ("largest error", np.abs(errors).max(axis=1)),
        ("total sigma" if campaign.drawn else "mean sigma", np.sqrt(np.mean(sigmas**2, axis=1))),
    ):
        lines.append(
            f"  {word:16}" + "".join(f"{value:10.4f}" if k < 3 else f"{value:10.3f}" for k, value in enumerate(values))
        )
    within = 100 * np.mean(np.abs(errors) < norm.ppf(0.975) * sigmas, axis=1)
    lines.append(f"  {'% within 95 %':16}" + "".join(f"{share:10.1f}" for share in within))
    return "\n".join(lines)


def session_report(row: dict[str, Any]) -> str:
    """Return a session's verdict, its normalised squared errors, and its errors in sigmas."""
    errors = ", ".join(f"{name} {row[f'error_{name}'] / row[f'sigma_{name}']:+.1f}" for name in NAMES)
    lines = [
        f"{row['campaign']}, seed {row['seed']}: {'accepted' if row['accepted'] else 'rejected'}; normalised squared "
        f"error {row['nse']:.2f}, by the total covariance {row['nse_total']:.2f}",
        f"  errors in random sigmas: {errors}",
        *(f"  {word}: {row[word]}" for word in ("reasons", "warnings") if row[word]),
    ]
    return "\n".join(lines)


def main() -> None:
    """Simulate and calibrate the campaigns, write their rows and print a summary of each; or single sessions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="campaigns to run, by the beginning of their names; default: all"
    )
    parser.add_argument("--share", type=float, default=1.0, help="share of each campaign's sessions; default: 1")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument(
        "--resume", action="store_true", help="continue campaigns that were interrupted; the program must be the same"
    )
    parser.add_argument(
        "--seeds", nargs="+", type=int, metavar="SEED", help="the sessions of these seeds alone; no row is written"
    )
    options = parser.parse_args()
    if options.seeds:
        try:
            tasks = [campaign_of(seed) for seed in options.seeds]
        except LookupError as error:
            parser.error(str(error))
        for task in tasks:
            print(session_report(session_row(task)), flush=True)
        return
    for campaign in named(*options.only) if options.only else ALL:
        started = time.monotonic()
        tasks = [(campaign, number) for number in range(max(2, round(campaign.sessions * options.share)))]
        table = collect_rows(path_of(campaign), session_row, tasks, options.jobs, options.resume, TASKS_OF_A_WORKER)
        words = [report(campaign, table), *([pairs_report(campaign, table)] if campaign.pairs else [])]
        print("\n".join(words), f"\n  ({time.monotonic() - started:.0f} s)\n", flush=True)


if __name__ == "__main__":
    main()
