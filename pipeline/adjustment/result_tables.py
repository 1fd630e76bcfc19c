"""What the adjustment found, as tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.consider import Block
from pipeline.adjustment.iteration import Adjusted
from pipeline.adjustment.pattern_tests import passes_test
from pipeline.adjustment.residual_statistics import Cells
from pipeline.artefacts.catalogue.results import CELLS
from pipeline.artefacts.to_tables import normal_columns
from pipeline.config.pool import Adjust
from pipeline.console import plural
from pipeline.maths.adjustment.parameters import NAMES, SIX
from pipeline.maths.adjustment.solution import Freed, Solution, freed, weakest_direction
from pipeline.maths.adjustment.variance_components import scatter
from pipeline.maths.geometry.passes import pass_of
from pipeline.maths.geometry.rotations import log_so3
from pipeline.mount import Mounted

Array = NDArray[np.float64]
COMMON_TO = {"laser": "ins_white", "mbes": "ping"}  # what the points of an epoch have in common


def tables(
    found: Adjusted,
    cells: Cells,
    patterns: pd.DataFrame,
    considered: Array,
    together: Sequence[Block],
    coarse: Mounted,
    settings: Adjust,
    poses: pd.DataFrame,
    passes: pd.DataFrame,
) -> dict[str, pd.DataFrame]:
    """By name; ``considered``: sigmas of all unknowns where they are held; ``together``: which of them correlate."""
    state, solution = found.state, found.solution
    six = np.concatenate(
        [
            log_so3(state.R_body_from_sensor @ coarse.R_body_from_sensor.T),
            state.lever_arm_m - coarse.lever_arm_body_m,
        ]
    )
    shared = [value for surface in state.surfaces for value in (0.0, 0.0, surface.shift_m)]
    values = state.values_of_other()
    values[:SIX], values[state.shared] = six, shared
    named = np.union1d(np.arange(SIX), solution.free)  # the six, held or not
    nothing = np.zeros(state.size)
    random, total = solution.covariance_of(named, nothing), solution.covariance_of(named, considered, *together)
    values = values[named]
    if solution.deficiency:
        values[:SIX], random, total = np.nan, np.full_like(random, np.nan), np.full_like(total, np.nan)
    estimate = pd.DataFrame(
        {
            "unknown": [state.names[k] for k in named],
            "value": values,
            "sigma": np.sqrt(np.diag(random)),
            "sigma_total": np.sqrt(np.diag(total)),
        }
    )
    return {
        "estimate": estimate,
        "covariance": _covariance_table(random[:SIX, :SIX], total[:SIX, :SIX]),
        "freed": _freed_table(found, considered, estimate),
        "groups": _groups_table(found),
        "summary": _summary_table(found, passes_test(patterns, settings.test_level)),
        "drift": _drift_table(found, poses),
        "cells": _cells_table(found, cells, patterns, poses, passes),
        "surfaces": _surfaces_table(found, cells),
    }


def _summary_table(found: Adjusted, test: Mapping[str, Any]) -> pd.DataFrame:
    solution = found.solution
    left_open = plural(solution.deficiency, "direction")
    reason = f"the data leave {left_open} of the unknowns open" if solution.deficiency else ""
    counts = found.reading.counts.values()
    summary = {
        "converged": found.converged,
        "iterations": found.iterations,
        "observations": sum(one.count for one in counts),
        "redundancy": found.redundancy,
        "sigma0": float(np.sqrt(found.equations.squares / max(found.redundancy, 1.0))),
        "between": found.between.factor,
        "between_dof": found.between.free,
        "condition": solution.condition,
        "rank_deficiency": solution.deficiency,
        "weakest": "" if solution.deficiency else _weakest(solution),
        **{f"test_{name}": test[name] for name in ("statistic", "dof", "limit", "passed")},
        "reason": reason,
    }
    return pd.DataFrame([summary])


def _weakest(solution: Solution) -> str:
    """Of the six, where all are free."""
    return weakest_direction(solution.covariance[:SIX, :SIX]) if np.all(solution.free[:SIX] == np.arange(SIX)) else ""


def _covariance_table(random: Array, total: Array) -> pd.DataFrame:
    sigma = np.sqrt(np.diag(random))
    product = np.outer(sigma, sigma)
    correlation = np.divide(random, product, out=np.where(np.isnan(product), np.nan, np.eye(SIX)), where=product > 0)
    return pd.DataFrame(
        {
            "row": np.repeat(NAMES, SIX),
            "column": np.tile(NAMES, SIX),
            "covariance": random.ravel(),
            "correlation": correlation.ravel(),
            "covariance_total": total.ravel(),
        }
    )


def _freed_table(found: Adjusted, considered: Array, estimate: pd.DataFrame) -> pd.DataFrame:
    """What is held, and what each of the six owes to it; and what is free beside the mount and the surfaces."""
    tests = {one.unknown: one for one in freed(found.equations.normal, found.equations.right, found.solution)}
    owed = found.solution.depends(np.arange(SIX))
    rows = []
    for place, number in enumerate(found.solution.held.tolist()):
        test = tests.get(number, Freed(number, np.nan, np.nan))
        effect = owed[:, place] * considered[number]
        row: dict[str, Any] = {"unknown": found.state.names[number], "considered": considered[number]}
        row |= {"estimated": False, "value": test.value, "sigma": test.sigma}
        rows.append(row | {f"effect_{name}": effect[k] for k, name in enumerate(NAMES)})
    shared = range(found.state.shared.start, found.state.shared.stop)
    by_name = estimate.set_index("unknown", drop=False)
    for number in found.solution.free.tolist():
        if number >= SIX and number not in shared:
            one = by_name.loc[found.state.names[number]]
            row = {"unknown": one["unknown"], "estimated": True, "considered": considered[number]}
            row |= {"value": one["value"], "sigma": one["sigma_total"]}
            rows.append(row | {f"effect_{name}": 0.0 for name in NAMES})
    return pd.DataFrame(rows)


def _surfaces_table(found: Adjusted, cells: Cells) -> pd.DataFrame:
    rows = []
    for k, surface in enumerate(found.state.surfaces):
        row = normal_columns(surface.normal)
        row |= {"family": surface.family, "distance_m": surface.distance_m}
        for sensor, name in (("laser", "laser_points"), ("mbes", "soundings")):
            row[name] = sum(cell.count for (s, number, _), cell in cells.items() if s == sensor and number == k)
        rows.append(row)
    return pd.DataFrame(rows)


def _drift_table(found: Adjusted, poses: pd.DataFrame) -> pd.DataFrame:
    knots, values = found.drift.knots, found.drift.values
    columns: dict[str, Any] = {"t_ns": poses["t_ns"].to_numpy()[knots.record]}
    columns |= {f"{axis}_target_m": values[:, k] for k, axis in enumerate("xyz")}
    turns = np.degrees(values[:, 3:])
    return pd.DataFrame(columns | {f"turn_{axis}_target_deg": turns[:, k] for k, axis in enumerate("xyz")})


def _groups_table(found: Adjusted) -> pd.DataFrame:
    rows: list[dict[str, Any]] = [
        {
            "group": name,
            "count": one.count,
            "variance_factor": found.weighting.factors[name],
            "scale": found.weighting.scales[name],
            "cut": one.cut,
            "reduced": one.reduced,
        }
        for name, one in found.reading.counts.items()
    ]
    for sensor, one in found.shared.items():
        row = {"group": COMMON_TO[sensor], "count": len(found.reading.sums[sensor])}
        rows.append(row | {"variance_factor": one.factor, "scale": np.nan, "cut": 0, "reduced": 0})
    return pd.DataFrame(rows)


def _cells_table(
    found: Adjusted, cells: Cells, patterns: pd.DataFrame, poses: pd.DataFrame, passes: pd.DataFrame
) -> pd.DataFrame:
    """Every cell, with the scatter of its epochs about planes of their own, and how far it lies off other passes."""
    of_pass = patterns[patterns["by"] == "pass"].set_index(["sensor", "family", "low"])["normalised"].to_dict()
    t_ns, starts, ends = poses["t_ns"].to_numpy(), passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()
    rows = []
    for (sensor, surface, number), cell in sorted(cells.items()):
        sums = found.reading.sums[sensor]
        beside = sums.record, np.minimum(sums.record + 1, len(t_ns) - 1)  # one of them may lie outside the pass
        place = np.maximum(*(pass_of(t_ns[record], starts, ends) for record in beside))
        within = scatter(sums, (place == number) & (sums.surface == surface))
        rows.append(
            {
                "sensor": sensor,
                "family": found.state.surfaces[surface].family,
                "pass": number,
                "count": cell.count,
                "mean_m": cell.mean_m,
                "rms_m": cell.rms_m,
                "sigma_mean_m": cell.sigma_mean_m,
                "normalised": of_pass.get((sensor, found.state.surfaces[surface].family, float(number)), np.nan),
                "largest": cell.largest,
                "redundancy": within.free,
                "variance_factor": within.factor,
            }
        )
    return pd.DataFrame(rows, columns=[column.name for column in CELLS.columns])
