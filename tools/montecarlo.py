"""Simulate and calibrate many sessions, and test whether the errors agree with the predicted sigmas.

For each campaign the program prints the errors of the six mount parameters, the number of accepted sessions, and the
mean normalised squared error with its 99 % band; the expectation of the latter is 6 if the covariance is right. Seeds
are fixed. In every session the coarse mount is wrong by 2.5° and 0.25 m on every axis at once, and the signs of these
errors go through all 64 combinations. Each session is a row of a file in runs/montecarlo/, which is CSV during the
campaign and Parquet at its end. ``tools.accuracy`` makes the README's table and an HTML page from these files.

    python -m tools.montecarlo [--only NAME ...] [--share 0.1] [--jobs 2] [--resume]
"""

import argparse
import time
from multiprocessing import get_context

import numpy as np
import pandas as pd
from scipy.stats import chi2

from tools.campaigns import CAMPAIGNS, FOLDER, TASKS_OF_A_WORKER, Campaign, path_of
from tools.session_pairs import pairs_report
from tools.session_rows import NAMES, session_row


def report(campaign: Campaign, table: pd.DataFrame) -> str:
    """Return the summary of a campaign in five lines."""
    n = len(table)
    low, high = (float(q) / n for q in chi2.ppf([0.005, 0.995], 6 * n))
    mean = table["nse"].mean()
    verdict = "inside" if low <= mean <= high else "OUTSIDE"
    agreement = f"; mean normalised squared error {mean:.2f}, {verdict} its 99 % band {low:.2f}-{high:.2f}"
    if campaign.own_errors:  # which its covariance from noise does not have
        agreement = ""
    lines = [
        f"{campaign.name}: {n} sessions, {int(table['accepted'].sum())} accepted{agreement}",
        f"  {'':16}" + "".join(f"{name:>10}" for name in NAMES) + "     (degrees, millimetres)",
    ]
    for word, values in (
        ("RMS error", [np.sqrt(np.mean(table[f"error_{name}"] ** 2)) for name in NAMES]),
        ("largest error", [table[f"error_{name}"].abs().max() for name in NAMES]),
        ("mean sigma", [np.sqrt(np.mean(table[f"sigma_{name}"] ** 2)) for name in NAMES]),
    ):
        lines.append(
            f"  {word:16}" + "".join(f"{value:10.4f}" if k < 3 else f"{value:10.3f}" for k, value in enumerate(values))
        )
    return "\n".join(lines)


def main() -> None:
    """Simulate and calibrate the campaigns, write their rows and print a summary of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="campaigns to run, by the beginning of their names; default: all"
    )
    parser.add_argument("--share", type=float, default=1.0, help="share of each campaign's sessions; default: 1")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument(
        "--resume", action="store_true", help="continue campaigns that were interrupted; the program must be the same"
    )
    options = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for campaign in CAMPAIGNS:
        if options.only and not any(campaign.name.startswith(name) for name in options.only):
            continue
        started = time.monotonic()
        path = path_of(campaign).with_suffix(".csv")
        done = len(pd.read_csv(path)) if options.resume and path.is_file() else 0
        tasks = [(campaign, number) for number in range(done, max(2, round(campaign.sessions * options.share)))]
        with get_context("spawn").Pool(options.jobs, maxtasksperchild=TASKS_OF_A_WORKER) as pool:
            # each row is written at once, so that an interruption loses none
            for number, row in enumerate(pool.imap(session_row, tasks), start=done):
                pd.DataFrame([row]).to_csv(path, index=False, mode="a" if number else "w", header=not number)
        table = pd.read_csv(path)
        table.to_parquet(path_of(campaign), index=False)
        words = [report(campaign, table), *([pairs_report(campaign, table)] if campaign.pairs else [])]
        print("\n".join(words), f"\n  ({time.monotonic() - started:.0f} s)\n", flush=True)


if __name__ == "__main__":
    main()
