"""The results of the adjustment as tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.face_errors import FinalSolution, final_solution
from pipeline.adjustment.ins_drift import drift_figures_table
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.noise_tables import groups_table, sigma_check
from pipeline.adjustment.parameter_strengths import SetTest, parameter_tests, set_tests, strengths_by_session
from pipeline.adjustment.pattern_tests import passes_test
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.residual_statistics import ResidualStatistics
from pipeline.artefacts.catalogue.results import CELLS, HEAD_EFFECTS, SETS
from pipeline.artefacts.to_tables import normal_columns
from pipeline.console import plural
from pipeline.maths.adjustment.parameter_tests import ParameterTest
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.solution import Solution, weakest_direction
from pipeline.maths.adjustment.weighting import scatter
from pipeline.maths.geometry.passes import pass_of
from pipeline.maths.mount_parameters import MOUNT_NAMES, N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def result_tables(
    problem: CalibrationProblem,
    adjustment: MountAdjustment,
    statistics: ResidualStatistics,
    passes: pd.DataFrame,
    test_level: float,
) -> dict[str, pd.DataFrame]:
    """Return by name the tables of parameters, covariance, tests, groups, summary, drift, means and surfaces.

    Parameters
    ----------
    problem : CalibrationProblem
        The calibration, with the coarse state and the errors of the fixed parameters.
    adjustment : MountAdjustment
        The adjusted values.
    statistics : ResidualStatistics
        Means of the residuals.
    passes : DataFrame
        Table passes.
    test_level : float
        Level of the test of the passes.
    """
    t_ns = problem.model.body.trajectory.t_ns
    final = final_solution(problem, adjustment, statistics.sums_by_face)
    estimate, random, total = _estimate(problem, final)
    tests = parameter_tests(problem, final)
    by_session = strengths_by_session(problem, adjustment, statistics.sums_by_face, final)
    return {
        "estimate": estimate.join(sigma_check(adjustment), on="unknown"),
        "covariance": _covariance_table(final, adjustment.state.mounts, random, total),
        "freed": _single_parameter_table(problem, final, estimate, tests, by_session, np.arange(N_MOUNT)),
        **_head_effects(problem, final, estimate, tests),
        "sets": _set_table(set_tests(final, tests), by_session),
        "groups": groups_table(adjustment),
        "summary": _summary_table(adjustment, passes_test(statistics.patterns, test_level)),
        "drift": _drift_table(adjustment, t_ns),
        "drift_figures": drift_figures_table(problem.prior.noise, adjustment.drift_figures),
        "cells": _pass_means_table(adjustment, statistics, t_ns, passes),
        "surfaces": _surfaces_table(adjustment, statistics),
    }


def _estimate(problem: CalibrationProblem, final: FinalSolution) -> tuple[pd.DataFrame, Array, Array]:
    """Return the table of mount and estimated parameters, and their random and total covariance.

    If the data leave a direction open, the mounts' values and both covariances are NaN.
    """
    solution = final.solution
    numbers = solution.estimated
    random = solution.noise_covariance(numbers)
    total = solution.total_covariance(problem.consider, numbers)
    values = final.deviation[numbers]
    if solution.deficiency:
        values[np.isin(numbers, problem.model.coarse.mounts)] = np.nan
        random, total = np.full_like(random, np.nan), np.full_like(total, np.nan)
    table = pd.DataFrame(
        {
            "unknown": [final.names[k] for k in numbers],
            "value": values,
            "sigma": np.sqrt(np.maximum(np.diag(random), 0.0)),  # of a parameter that the points do not show: rounding
            "sigma_total": np.sqrt(np.diag(total)),
        }
    )
    return table, random, total


def _summary_table(adjustment: MountAdjustment, test: Mapping[str, Any]) -> pd.DataFrame:
    solution, between = adjustment.solution, adjustment.between
    summary = {
        "converged": adjustment.converged,
        "iterations": adjustment.iterations,
        "observations": sum(group.count for group in adjustment.accumulation.groups.values()),
        "redundancy": adjustment.redundancy,
        "sigma0": float(np.sqrt(adjustment.equations.squares / max(adjustment.redundancy, 1.0))),
        "between": between.factor,
        "between_dof": between.dof,
        "condition": solution.condition,
        "rank_deficiency": solution.deficiency,
        "weakest": "" if solution.deficiency else _weakest(adjustment.state, solution),
        **_rival(adjustment),
        **{f"test_{name}": test[name] for name in ("statistic", "dof", "limit", "passed")},
        "reason": _no_result(solution.deficiency) if solution.deficiency else "",
    }
    return pd.DataFrame([summary])


def _rival(adjustment: MountAdjustment) -> dict[str, float]:
    """Return the columns of another minimum, NaN if there is none."""
    rival = adjustment.rival
    strength, apart = (np.nan, np.full(N_MOUNT, np.nan)) if rival is None else (rival.strength, rival.apart)
    return {
        "rival_strength": strength,
        "rival_yaw_deg": float(np.degrees(apart[2])),
        "rival_lever_arm_y_m": float(apart[4]),
    }


def _no_result(deficiency: int) -> str:
    return f"the data leave {plural(deficiency, 'direction')} of the unknowns open"


def _weakest(state: State, solution: Solution) -> str:
    """Return in words which mount parameters are hardest to tell apart; with several heads, of each head."""
    words = []
    for head in state.heads:
        places = np.searchsorted(solution.estimated, state.mount_columns(head))
        of_head = weakest_direction(solution.covariance[np.ix_(places, places)])
        words.append(of_head if head == state.calibrated else f"{head}: {of_head}")
    return "; ".join(words)


def _covariance_table(final: FinalSolution, mounts: Integers, random: Array, total: Array) -> pd.DataFrame:
    """Return the table of the covariance of all mounts, from the covariances of the estimated parameters."""
    places, names = np.searchsorted(final.solution.estimated, mounts), [final.names[k] for k in mounts]
    random, total = random[np.ix_(places, places)], total[np.ix_(places, places)]
    sigma = np.sqrt(np.diag(random))
    product = np.outer(sigma, sigma)
    unknown = np.where(np.isnan(product), np.nan, np.eye(len(mounts)))
    correlation = np.divide(random, product, out=unknown, where=product > 0)
    return pd.DataFrame(
        {
            "row": np.repeat(names, len(names)),
            "column": np.tile(names, len(names)),
            "covariance": random.ravel(),
            "correlation": correlation.ravel(),
            "covariance_total": total.ravel(),
        }
    )


def _single_parameter_table(
    problem: CalibrationProblem,
    final: FinalSolution,
    estimate: pd.DataFrame,
    tests: Sequence[ParameterTest],
    by_session: Mapping[str, float],
    mount: Integers,
) -> pd.DataFrame:
    """Return table ``freed``: the test of each additional parameter, and the effect of its error on a mount.

    The parameters are fixed, or estimated with a value known beforehand (those of a laser's coarse mount among them),
    or named in adjust.free. Where values known beforehand correlate, the effects are of independent errors instead,
    whose squares have the same sum. ``mount`` (6,): places of the mount's parameters.
    """
    solution, consider = final.solution, problem.consider
    known = problem.prior.known_parameters
    by_number = {test.parameter: test for test in tests}
    effects = np.zeros((N_MOUNT, len(final.names)))
    effects[:, solution.fixed] = solution.sensitivity_of(mount) * consider.sigmas[solution.fixed]
    effects[:, known] = solution.prior_effects(mount, known)
    by_name, rows = estimate.set_index("unknown"), []
    coarse, surfaces = problem.model.coarse, problem.model.coarse.surface_slice
    of_state = [*coarse.mounts, *range(surfaces.start, surfaces.stop)]
    freed = np.setdiff1d(solution.estimated, [*of_state, *known]).tolist()
    for number in [*sorted([*solution.fixed.tolist(), *known.tolist()]), *freed]:
        name, considered = final.names[number], consider.sigmas[number]
        test = by_number.get(number, ParameterTest(number, np.nan, np.nan, np.nan, np.nan))
        if number in freed:
            value, sigma = by_name.loc[name, ["value", "sigma_total"]]
            test = ParameterTest(number, value, sigma, float(np.hypot(sigma, considered)), np.nan)
        row: dict[str, Any] = {"unknown": name, "estimated": number in freed}
        row |= {"known": number in known, "considered": considered}
        row |= {"value": test.value, "sigma": test.sigma, "expected": test.expected}
        row |= {"strength": test.strength, "by_session": by_session.get(name, np.nan)}
        rows.append(row | {f"effect_{axis}": effects[k, number] for k, axis in enumerate(MOUNT_NAMES)})
    return pd.DataFrame([*rows, *_surface_rows(final.solution, surfaces, mount)])


def _head_effects(
    problem: CalibrationProblem, final: FinalSolution, estimate: pd.DataFrame, tests: Sequence[ParameterTest]
) -> dict[str, pd.DataFrame]:
    """Return by name table ``head_effects``: what errors do to the mounts of further heads; nothing of one head."""
    coarse = problem.model.coarse
    tables = [
        _single_parameter_table(problem, final, estimate, tests, {}, coarse.mount_columns(head)).assign(head=head)
        for head in coarse.heads[1:]
    ]
    names = [column.name for column in HEAD_EFFECTS.columns]
    return {"head_effects": pd.concat(tables, ignore_index=True)[names]} if tables else {}


def _surface_rows(solution: Solution, surfaces: slice, mount: Integers) -> list[dict[str, Any]]:
    """Return rows of table ``freed`` with the effects of errors in what is known of the surfaces beforehand."""
    group = np.arange(surfaces.start, surfaces.stop)
    if solution.deficiency or not np.all(np.isin([*mount, *group], solution.estimated)):
        return []
    effects = solution.group_effects(mount, group)
    if not np.any(effects):
        return []
    none = {"estimated": False, "known": False, "considered": 1.0}
    none |= dict.fromkeys(("value", "sigma", "expected", "strength", "by_session"), np.nan)
    return [
        {"unknown": f"surfaces_{name}"} | none | {f"effect_{axis}": of[k] for k, axis in enumerate(MOUNT_NAMES)}
        for name, of in zip(MOUNT_NAMES, effects.T, strict=True)
    ]


def _set_table(tests: Sequence[SetTest], by_session: Mapping[str, float]) -> pd.DataFrame:
    """Return table ``sets``: the joint test of each set of parameters."""
    rows = [
        {
            "set": one.name,
            "parameters": " ".join(one.parameters),
            "fall": one.test.fall,
            "dof": one.test.dof,
            "strength": one.test.strength,
            "by_session": by_session.get(one.name, np.nan),
        }
        for one in tests
    ]
    return pd.DataFrame(rows, columns=[column.name for column in SETS.columns])


def _surfaces_table(adjustment: MountAdjustment, statistics: ResidualStatistics) -> pd.DataFrame:
    rows = []
    for k, surface in enumerate(adjustment.state.surfaces):
        row = normal_columns(surface.normal)
        row |= {"family": surface.family, "distance_m": surface.distance_m}
        row["laser_points"] = statistics.count("laser", k)
        row["soundings"] = sum(statistics.count(head, k) for head in ("mbes", *adjustment.state.heads[1:]))
        rows.append(row)
    return pd.DataFrame(rows)


def _drift_table(adjustment: MountAdjustment, t_ns: NDArray[np.int64]) -> pd.DataFrame:
    """Return the drift at its knots; ``t_ns`` (n,): times of the INS records."""
    knots, values = adjustment.drift.knots, adjustment.drift.values
    columns: dict[str, Any] = {"t_ns": t_ns[knots.record]}
    columns |= {f"{axis}_target_m": values[:, k] for k, axis in enumerate("xyz")}
    turns = np.degrees(values[:, 3:])
    return pd.DataFrame(columns | {f"turn_{axis}_target_deg": turns[:, k] for k, axis in enumerate("xyz")})


def _pass_means_table(
    adjustment: MountAdjustment, statistics: ResidualStatistics, t_ns: NDArray[np.int64], passes: pd.DataFrame
) -> pd.DataFrame:
    """Return table ``cells``: the mean residual of each sensor, surface and pass.

    A row also has the variance factor of the scatter of its intervals about their own planes, and the normal deviate of
    the difference from the other passes.
    """
    patterns = statistics.patterns
    normalised = patterns[patterns["by"] == "pass"].set_index(["sensor", "family", "low"])["normalised"].to_dict()
    starts, ends = passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()
    weighting, rows = adjustment.weighting, []
    for (sensor, surface, number), mean in sorted(statistics.pass_means.items()):
        sums = adjustment.accumulation.sums[sensor]
        family = adjustment.state.surfaces[surface].family
        beside = sums.record, np.minimum(sums.record + 1, len(t_ns) - 1)  # one of the two may lie outside the pass
        pass_of_interval = np.maximum(*(pass_of(t_ns[record], starts, ends) for record in beside))
        rows_here = (pass_of_interval == number) & (sums.surface == surface)
        within = scatter(sums, rows_here, weighting.robust_effects.kept, weighting.edge_shares[sensor])
        rows.append(
            {
                "sensor": sensor,
                "family": family,
                "pass": number,
                "count": mean.count,
                "mean_m": mean.mean_m,
                "rms_m": mean.rms_m,
                "sigma_mean_m": mean.sigma_mean_m,
                "normalised": normalised.get((sensor, family, float(number)), np.nan),
                "largest": mean.largest,
                "redundancy": within.dof,
                "variance_factor": within.factor,
            }
        )
    return pd.DataFrame(rows, columns=[column.name for column in CELLS.columns])
