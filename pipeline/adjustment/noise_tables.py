"""What the adjustment found of the noise, as tables: variance factors, and a check of the sigmas."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.accumulation import GroupStatistics
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.artefacts.catalogue.results import GROUPS
from pipeline.maths.adjustment.robust_weights import robust_scale
from pipeline.maths.adjustment.score_check import score_check
from pipeline.maths.adjustment.weighting import PRIOR_DOF, Scatter, scatter

COMMON_ERROR = {"laser": "ins_white", "mbes": "ping"}  # name of the error that an interval's points have in common
Member = tuple[GroupStatistics, Scatter]


def groups_table(adjustment: MountAdjustment) -> pd.DataFrame:
    """Return table ``groups``: rows of several families together, of common errors, and of each sensor and family.

    Programs read the first rows by their names.
    """
    surfaces, weighting, sums = adjustment.state.surfaces, adjustment.weighting, adjustment.accumulation.sums
    together: dict[tuple[str, str], list[Member]] = {}
    shares = weighting.edge_shares
    by_family = []
    for (sensor, number), group in sorted(adjustment.accumulation.groups.items()):
        within = scatter(sums[sensor], sums[sensor].surface == number, weighting.robust_effects.kept, shares[sensor])
        factor = float(weighting.factors[sensor][number])
        member = group, Scatter(factor * within.dof, within.dof)
        family = surfaces[number].family
        row = _row(f"{sensor}:{family}", sensor, [member]) | {"family": family, "variance_factor": factor}
        if sensor in adjustment.rough:
            row["patch_m"] = adjustment.rough[sensor].patch_m[number]
        if sensor in adjustment.pings:
            effects = adjustment.pings[sensor].effects
            row |= {"mean_effect": effects.of_mean[number], "slope_effect": effects.of_slope[number]}
        by_family.append(row)
        together.setdefault((sensor, _group_of(sensor, surfaces[number].level)), []).append(member)
    common = [
        {"group": COMMON_ERROR.get(sensor, f"{sensor}_ping"), "sensor": sensor, "family": ""}
        | {"count": len(sums[sensor]), "variance_factor": found.factor, "scale": np.nan, "cut": 0, "reduced": 0}
        | {"sigma": found.sigma}
        for sensor, found in adjustment.epoch_factors.items()
    ]
    rows = [_row(name, sensor, members) for (sensor, name), members in together.items()]
    rows.sort(key=lambda row: (row["sensor"], row["group"] == _group_of(row["sensor"], level=True)))
    return pd.DataFrame([*rows, *common, *by_family], columns=[column.name for column in GROUPS.columns])


def _group_of(sensor: str, level: bool) -> str:
    """Return the name of a sensor's rows of several families together: those of horizontal faces, or of the others."""
    if sensor == "laser":
        return "laser"
    return f"{sensor}_horizontal" if level else f"{sensor}_vertical"


def _row(name: str, sensor: str, members: Sequence[Member]) -> dict[str, Any]:
    groups = [group for group, _ in members]
    within = Scatter(sum(part.squares for _, part in members), sum(part.dof for _, part in members))
    total = sum(groups[1:], start=groups[0])
    return {
        "group": name,
        "count": total.count,
        "variance_factor": within.factor,
        "scale": robust_scale(total.histogram),
        "cut": total.cut,
        "reduced": total.reduced,
        "sensor": sensor,
        "family": "",
        "sigma": within.factor * np.sqrt(2 / (PRIOR_DOF + within.dof)),
    }



def sigma_check(adjustment: MountAdjustment) -> pd.DataFrame:
    """Return columns of table ``estimate``, by unknown: the check of the sigmas by the scatter of slots of time."""
    state, solution, columns = adjustment.state, adjustment.solution, ["slots_ratio", "slots_dof"]
    if solution.deficiency:
        return pd.DataFrame(columns=columns, dtype=np.float64)
    last = adjustment.last
    check = score_check(last.linearisation, last.drift, adjustment.drift_figures.noise, last.prior, solution.estimated)
    names = [state.names[number] for number in solution.estimated if number in state.mounts]
    return pd.DataFrame(np.column_stack([check.ratio, check.dof]), index=names, columns=columns)
