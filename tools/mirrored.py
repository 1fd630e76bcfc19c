"""Show the biases of the adjustment: calibrate sessions with their noise, and with its mirror image.

Labels, weights and designs depend on noisy points. What the noise does to the mount through them does not change its
sign with the noise; all else does. So the mean error of a session and of its mirror image, in which every error of
every record has the opposite sign, is the bias alone. A few such pairs tell it as well as hundreds of sessions.
Outliers and echoes, which have no mirror image, are left out. For each mount parameter the program prints the mean
bias, its standard error, and the sigma. Rows go to runs/montecarlo/mirrored_….parquet.

    python -m tools.mirrored "twelve passes" [--sessions 10] [--jobs 2] [--resume]
"""

import argparse
import functools
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.simulation.scenario_ins import NO_DRIFT
from stages.in_memory import calibrate_in_memory
from tools.campaign_files import collect_rows
from tools.campaigns import TASKS_OF_A_WORKER, Campaign, path_of
from tools.session_rows import NAMES, error_columns, simulated
from tools.stress_campaigns import named

Columns = Mapping[str, NDArray[Any]]
NO_ECHOES: dict[str, Any] = {
    "laser": {"outlier_share": 0.0, "water_return_share": 0.0},
    "mbes": {"corner_share": 0.0, "outlier_share": 0.0, "surface_share": 0.0},
}
EXACT: dict[str, Any] = {
    "ins": {"white": {"position_m": 0.0, "attitude_deg": 0.0}, "drift": NO_DRIFT.model_dump()},
    "laser": {"range_sigma_m": 0.0, "angle_sigma_deg": 0.0},
    "mbes": {"range_sigma_m": 0.0, "angle_sigma_deg": 0.0},
}


def mirrored(noisy: Columns, exact: Columns) -> tuple[Columns, Columns]:
    """Return the records that both have, and the same with errors of the opposite sign."""
    names = [name for name, column in exact.items() if not np.issubdtype(column.dtype, np.floating)]  # times, numbers
    own, others = (pd.MultiIndex.from_arrays([columns[name] for name in names]) for columns in (noisy, exact))
    at = others.get_indexer(own)
    kept = {name: column[at >= 0] for name, column in noisy.items()}
    image = {name: column if name in names else 2 * exact[name][at[at >= 0]] - column for name, column in kept.items()}
    return kept, image


def row_of(number: int, campaign: Campaign) -> dict[str, Any]:
    """Return the row of a session: its errors, those of its mirror image, and the sigmas."""
    scenario = {key: campaign.scenario.get(key, {}) | NO_ECHOES.get(key, {}) for key in campaign.scenario | NO_ECHOES}
    without = {key: scenario.get(key, {}) | EXACT.get(key, {}) for key in scenario | EXACT}
    made, session, pool = simulated(replace(campaign, scenario=scenario), number)
    true, _, _ = simulated(replace(campaign, scenario=without), number)
    pairs = {sensor: mirrored(getattr(made, sensor), getattr(true, sensor)) for sensor in EXACT}
    row: dict[str, Any] = {"campaign": campaign.name, "seed": campaign.first_seed + number}
    for k, prefix in enumerate(("", "mirrored_")):
        found = calibrate_in_memory(session, pool, {sensor: pair[k] for sensor, pair in pairs.items()})
        block = json.loads(found["report/calibration.json"])["methods"]["adjustment"]
        row |= error_columns(block, made.truth, prefix=prefix)
    return row


def main() -> None:
    """Calibrate the sessions, write their rows and print the biases."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("campaign", help="a campaign of tools.montecarlo, by the beginning of its name")
    parser.add_argument("--sessions", type=int, default=10, help="number of sessions; default: 10")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted campaign of the same program")
    options = parser.parse_args()
    try:
        (campaign,) = named(options.campaign)
    except ValueError:
        parser.error(f"{options.campaign!r}: not the beginning of exactly one campaign's name")
    path = path_of(campaign)
    rows = collect_rows(
        path.with_name(f"mirrored_{path.name}"),
        functools.partial(row_of, campaign=campaign),
        range(options.sessions),
        options.jobs,
        options.resume,
        TASKS_OF_A_WORKER,
    )
    print(f"{campaign.name}: {len(rows)} sessions and their mirror images")
    for k, name in enumerate(NAMES):
        bias = (rows[f"error_{name}"] + rows[f"mirrored_error_{name}"]) / 2
        unit = "°" if k < 3 else " mm"
        print(
            f"{name:>6}: bias {bias.mean():+.4f} ± {bias.std() / np.sqrt(len(rows)):.4f}{unit}, "
            f"sigma {np.sqrt(np.mean(rows[f'sigma_{name}'] ** 2)):.4f}{unit}"
        )


if __name__ == "__main__":
    main()
