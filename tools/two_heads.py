"""Campaign of a sonar with two heads: are errors as large, and as much alike, as the common covariance says.

Of each kind of session the program prints mean normalised squared errors with their 99 % bands: of each head (6
degrees of freedom), of both together (12), and of their difference (6), whose variance hangs on the covariance across
the heads. The last lines compare this cross-covariance itself. With the Cholesky factors L of the two heads' own
covariances, the products L₁⁻¹ e₁ (L₂⁻¹ e₂)ᵀ of the errors have the expectation K = L₁⁻¹ C₁₂ L₂⁻ᵀ. With the mean M of K
over the sessions its *share* is the mean of ⟨product, M⟩ / ⟨M, M⟩, 1 if C₁₂ is true, 0 if the heads were independent.
(With K in place of M it would be less than 1 all the same: K = M + d scatters, for each session estimates its own
figures of the drift, and ⟨K, K⟩ has the mean ⟨M, M⟩ + E ⟨d, d⟩. The part of ⟨M, M⟩ in it is given beside.) The largest
of the 36 deviations of the mean products from K is given in standard errors. Random covariances are judged: no
systematic error is drawn.

    python -m tools.two_heads [--sessions 200] [--first 0] [--only KIND] [--jobs 2] [--resume]
"""

import argparse
import json
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.maths.comparison import mount_error
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import simulate_session
from stages.in_memory import calibrate_in_memory
from tools.campaign_files import collect_rows
from tools.campaigns import DRIFT, FOLDER, TASKS_OF_A_WORKER, coarse_error

Array = NDArray[np.float64]
LEVEL = 0.99
STARBOARD = {"roll_deg": -48.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
BESIDE = {"roll_deg": -38.0, "pitch_deg": -0.9, "yaw_deg": 1.6, "x_m": -0.30, "y_m": -0.25, "z_m": -2.05}
PORT = {"roll_deg": 46.5, "pitch_deg": -0.9, "yaw_deg": 1.6, "x_m": -0.32, "y_m": 0.18, "z_m": -2.03}
KINDS: dict[str, dict[str, Any]] = {  # first seed, mount of the second head, further blocks of the scenario
    "both to starboard": {"seed": 21000, "mount": BESIDE, "laser": {"point_rate_hz": 5000.0}},
    "one to each side": {
        "seed": 22000,
        "mount": PORT,
        "laser": {"point_rate_hz": 10000.0, "field_deg": [-130.0, 130.0]},
        "track": {"distances_m": [4.0, 4.0, 8.0, 8.0, 5.5, 5.5], "courses": ["along", "back"]},
    },
}


def scenario_of(kind: str, number: int) -> dict[str, Any]:
    """Return the scenario of a session; the coarse mounts of its heads are wrong with different signs."""
    heads = [
        {"mount": mount, "ping_rate_hz": 10.0, "coarse_error": coarse_error(seed, 2.5, 0.25)}
        for mount, seed in ((STARBOARD, number), (KINDS[kind]["mount"], number * 27 + 5))
    ]
    blocks = {name: block for name, block in KINDS[kind].items() if isinstance(block, dict) and name != "mount"}
    return {"name": kind, "ins": DRIFT, **blocks, "mbes": heads}


def session_row(task: tuple[str, int]) -> dict[str, Any]:
    """Return the row of a session: verdict, errors (12,), random covariance (12, 12), rad and m."""
    kind, number = task
    made = simulate_session(parse(Scenario, scenario_of(kind, number), kind), KINDS[kind]["seed"] + number)
    session, pool = parse(SessionConfig, made.session, "session"), parse(PoolConfig, made.pool, "pool")
    result = json.loads(calibrate_in_memory(session, pool, made.raw)["report/calibration.json"])
    row = {"kind": kind, "seed": KINDS[kind]["seed"] + number, "accepted": result["verdict"] == "accepted"}
    row["reasons"] = "; ".join(result["reasons"])
    errors: list[float] = []
    for head, truth in zip(result["heads"], made.truth["heads"], strict=True):
        if head["mount"] is not None:
            true = np.array(truth["R_body_from_mbes"]), np.array(truth["lever_arm_m"])
            errors += mount_error(*true, np.array(head["R_body_from_mbes"]), np.array(head["lever_arm_m"])).tolist()
    covariance = result["heads_covariance"]["covariance"]
    return row | {"errors": json.dumps(errors), "covariance": json.dumps(covariance)}


def report(kind: str, table: pd.DataFrame) -> str:
    """Return the summary of a kind of session, in seven lines."""
    solved = table[table["covariance"] != "null"]
    pairs = [
        (np.array(json.loads(errors)), np.array(json.loads(covariance)))
        for errors, covariance in zip(solved["errors"], solved["covariance"], strict=True)
    ]
    accepted = int(table["accepted"].sum())
    lines = [f"{kind}: {len(table)} sessions, {accepted} accepted, {len(table) - len(pairs)} without a result"]
    first, second = np.eye(12)[:6], np.eye(12)[6:]
    for name, chosen in (
        ("first head", first),
        ("second head", second),
        ("both together", np.eye(12)),
        ("their difference", first - second),
    ):
        lines.append(f"  NSE of {name:17} {_nse(pairs, chosen)}")
    return "\n".join([*lines, *_cross(pairs)])


def _nse(pairs: list[tuple[Array, Array]], chosen: Array) -> str:
    """Return the mean normalised squared error of chosen combinations (k, 12) of the parameters, and its band."""
    found = [float(chosen @ e @ np.linalg.solve(chosen @ C @ chosen.T, chosen @ e)) for e, C in pairs]
    dof = len(chosen)
    low, high = chi2.ppf([(1 - LEVEL) / 2, (1 + LEVEL) / 2], dof * len(found)) / len(found)
    mean = float(np.mean(found))
    where = "inside" if low < mean < high else "OUTSIDE"
    return f"{mean:6.2f} of {dof:2}, {where} {low:.2f}-{high:.2f}"


def _cross(pairs: list[tuple[Array, Array]]) -> list[str]:
    """Return lines on the covariance across the heads: the share of the stated one that is found, the worst entry."""
    products, stated = [], []
    for e, C in pairs:
        L_1, L_2 = np.linalg.cholesky(C[:6, :6]), np.linalg.cholesky(C[6:, 6:])
        products.append(np.outer(np.linalg.solve(L_1, e[:6]), np.linalg.solve(L_2, e[6:])))
        stated.append(np.linalg.solve(L_1, np.linalg.solve(L_2, C[:6, 6:].T).T))
    K, off = np.array(stated), np.array(products) - np.array(stated)
    M, count = K.mean(axis=0), len(pairs)
    shares = np.sum(np.array(products) * M, axis=(1, 2)) / np.sum(M**2)
    alike = np.sum(M**2) / np.mean(np.sum(K**2, axis=(1, 2)))
    deviates = off.mean(axis=0) / (off.std(axis=0, ddof=1) / np.sqrt(count))
    limit = float(norm.isf((1 - LEVEL ** (1 / deviates.size)) / 2))
    return [
        f"  cross-covariance: stated correlations (whitened) up to {np.abs(M).max():.2f}; of their squares {alike:.2f} "
        f"alike in all sessions; share found {shares.mean():.2f} ± {shares.std(ddof=1) / np.sqrt(count):.2f} "
        "(1 expected)",
        f"  worst of 36 entries: {np.abs(deviates).max():.1f} standard errors (limit {limit:.1f})",
    ]


def main() -> None:
    """Simulate and calibrate the sessions, write their rows, and print a summary of each kind."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=200, help="number of sessions of each kind; default: 200")
    parser.add_argument("--first", type=int, default=0, help="number of the first session; default: 0")
    parser.add_argument("--only", choices=list(KINDS), help="one kind of session; default: all")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--resume", action="store_true", help="continue a campaign that was interrupted")
    options = parser.parse_args()
    for kind in [options.only] if options.only else KINDS:
        tasks = [(kind, options.first + number) for number in range(options.sessions)]
        path = FOLDER / f"two_heads_{kind.replace(' ', '_')}.parquet"
        table = collect_rows(path, session_row, tasks, options.jobs, options.resume, TASKS_OF_A_WORKER)
        print(report(kind, table), flush=True)


if __name__ == "__main__":
    main()
