"""The rigorous solution: both sensors observe shared surfaces; six unknowns and the surfaces, with their covariance."""

import functools
import operator
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import artefacts, config
from pipeline.maths.adjustment import (
    COMMON,
    GROUPS,
    NAMES,
    LaserMoments,
    State,
    Sums,
    accumulate,
    laser_moments,
)
from pipeline.maths.consistency import (
    Scores,
    cells_of,
    clustered_covariance,
    consistency_limit,
    merge_scores,
    scores_of,
)
from pipeline.corrected import corrected, noise_of
from pipeline.maths.robust import scale_of
from pipeline.maths.rotations import log_so3
from pipeline.maths.solution import Solution, redundancies, solve, variance_factors, weakest_direction
from pipeline.mounts import mount_of
from pipeline.residuals import bins_table, map_table, residuals_table, step_for
from pipeline.scene import Scene, scene_of
from pipeline.streams import Batch, Stream
from pipeline.times import NS

Array = NDArray[np.float64]
STEP_RAD, STEP_M = 1e-10, 1e-9  # a smaller step is none, whatever the sigma
STEP_SIGMAS = 1e-3  # nor is one smaller than this share of its sigma
ROUGH_STEP = 1e-3  # weights become robust when the step is smaller (rad, m)
SHOWN = 100_000  # points of a sensor in the table residuals, at most
RESCALINGS = 2  # how often the groups' robust scales are then taken anew


@dataclass(frozen=True)
class Config:
    adjust: config.Adjust
    ins: config.Ins
    laser: config.Laser
    mbes: config.Mbes


@dataclass(frozen=True)
class Inputs:
    faces: Annotated[pd.DataFrame, artefacts.FACES]
    poses: Annotated[pd.DataFrame, artefacts.POSES]
    target_pose: Annotated[pd.DataFrame, artefacts.TARGET_POSE]
    planes: Annotated[pd.DataFrame, artefacts.PLANES]
    laser_labelled: Annotated[Stream, artefacts.LASER_LABELLED]
    soundings_labelled: Annotated[Stream, artefacts.SOUNDINGS_LABELLED]


@dataclass(frozen=True)
class Outputs:
    estimate: Annotated[pd.DataFrame, artefacts.ESTIMATE]
    covariance: Annotated[pd.DataFrame, artefacts.COVARIANCE]
    surfaces: Annotated[pd.DataFrame, artefacts.SURFACES]
    groups: Annotated[pd.DataFrame, artefacts.GROUPS]
    cells: Annotated[pd.DataFrame, artefacts.CELLS]
    summary: Annotated[pd.DataFrame, artefacts.ADJUST_SUMMARY]
    residuals: Annotated[pd.DataFrame, artefacts.RESIDUALS]
    residual_bins: Annotated[pd.DataFrame, artefacts.RESIDUAL_BINS]
    residual_map: Annotated[pd.DataFrame, artefacts.RESIDUAL_MAP]


def _laser_moments(batch: Batch, scene: Scene, state: State) -> LaserMoments:
    rows, points = scene.laser_rows(batch, state)
    return laser_moments(state, rows, points)


def _sounding_sums(batch: Batch, scene: Scene, state: State) -> Sums:
    return accumulate(state, scene.sounding_rows(batch, state))


def _scores(batch: Batch, scene: Scene, state: State, sensor: str, step: int) -> tuple[Scores, Batch]:
    rows = scene.rows(sensor, batch, state)
    moment = batch["t_ns"] // round(scene.adjust.moment_s * NS)
    scores = scores_of(state, rows, sensor, batch["pass"].astype(np.int64), moment)
    return scores, scene.sample(sensor, batch, state, rows, step)


def run(inputs: Inputs, config: Config) -> Outputs:
    settings = config.adjust
    given = (inputs.faces, inputs.poses, inputs.target_pose, inputs.planes)
    scene = scene_of(*given, settings, config.laser, config.mbes)
    state = scene.coarse
    laser = _sum(inputs.laser_labelled.fold(_laser_moments, scene, state))
    converged, iterations, rescaled = False, 0, 0
    while True:
        sums = laser.sums(state) + _sum(inputs.soundings_labelled.fold(_sounding_sums, scene, state))
        solution = solve(sums)
        if converged or solution.deficiency or iterations == settings.max_iterations:
            break
        factors = variance_factors(sums, solution.inverse, state.factors)
        settled = all(abs(factors[name] / state.factors[name] - 1) < 1e-3 for name in GROUPS)
        converged = rescaled == RESCALINGS and settled and _negligible(solution)
        state = replace(state.moved(solution.step), factors=factors if rescaled else state.factors)
        iterations += 1
        if rescaled < RESCALINGS and np.max(np.abs(solution.step[:COMMON])) < ROUGH_STEP:
            rescaled += 1  # then the scales stay: weights that follow them for ever need not come to rest
            scales = {name: scale_of(group.histogram) for name, group in sums.groups.items()}
            state = replace(state, robust=(settings.robust_k0, settings.robust_k1), scales={**state.scales, **scales})
            laser = _sum(inputs.laser_labelled.fold(_laser_moments, scene, state))
    if os.environ.get("WITH_POSES"):
        streams = {"laser": inputs.laser_labelled, "mbes": inputs.soundings_labelled}
        state, drift, equations, step = corrected(streams, scene, state, noise_of(config.ins), settings, 5.0)
        print("step" if False else "", end="") if True else print("step", np.abs(step[:6]).max(), state.factors, file=sys.stderr)
        covariance = np.linalg.inv(equations.normal)
        solution = replace(solution, inverse=covariance)
    seen = {"laser": sums.groups["laser"].count}
    seen["mbes"] = sum(group.count for group in sums.groups.values()) - seen["laser"]
    taken: list[Batch] = []
    scores = merge_scores(
        _without(
            chain.from_iterable(
                stream.fold(_scores, scene, state, sensor, step_for(seen[sensor], SHOWN))
                for sensor, stream in (("laser", inputs.laser_labelled), ("mbes", inputs.soundings_labelled))
            ),
            taken,
        )
    )
    residuals = residuals_table(taken)
    return Outputs(
        **_tables(state, sums, solution, scores, converged, iterations, config),
        residuals=residuals,
        residual_bins=bins_table(residuals, inputs.faces),
        residual_map=map_table(residuals, inputs.faces),
    )


def _without(pieces: Iterator[tuple[Scores, Batch]], taken: list[Batch]) -> Iterator[Scores]:
    """The scores one by one; the points to be looked at are put by."""
    for scores, points in pieces:
        taken.append(points)
        yield scores


def _negligible(solution: Solution) -> bool:
    """Whether the six's step is far below their sigmas, or below anything that matters."""
    sigma = np.sqrt(np.diag(solution.inverse))[:COMMON]
    floor = np.repeat([STEP_RAD, STEP_M], 3)
    return bool(np.all(np.abs(solution.step[:COMMON]) <= np.maximum(STEP_SIGMAS * sigma, floor)))


def _sum(pieces: Iterator[Any]) -> Any:
    return functools.reduce(operator.add, pieces)


def _tables(
    state: State, sums: Sums, solution: Solution, scores: Scores, converged: bool, iterations: int, config: Config
) -> dict[str, pd.DataFrame]:
    coarse = mount_of(config.mbes.mount)
    six = np.concatenate(
        [
            log_so3(state.R_body_from_mbes @ coarse.R_body_from_sensor.T),
            state.lever_arm_m - coarse.lever_arm_body_m,
        ]
    )
    formal = solution.inverse
    clustered = clustered_covariance(formal, scores)
    covariance = formal if clustered is None or os.environ.get("WITH_POSES") else clustered
    if solution.deficiency:
        six, covariance, formal = np.full(6, np.nan), np.full_like(formal, np.nan), np.full_like(formal, np.nan)
    names = list(NAMES) + [f"{s.family}_{name}" for s in state.surfaces for name in ("turn_1", "turn_2", "shift")]
    estimate = pd.DataFrame(
        {
            "unknown": names,
            "value": np.concatenate([six, [v for s in state.surfaces for v in (0.0, 0.0, s.shift_m)]]),
            "sigma": np.sqrt(np.diag(covariance)),
            "sigma_formal": np.sqrt(np.diag(formal)),
        }
    )
    free = redundancies(sums, solution.inverse)
    cells = cells_of(scores, config.adjust.test_tolerance_m)
    statistic = float(sum(cell.normalised**2 for cell in cells.values()))
    limit = consistency_limit(len(cells), config.adjust.test_level)
    observations = sum(group.count for group in sums.groups.values())
    reason = f"the data leave {solution.deficiency} direction(s) of the unknowns open" if solution.deficiency else ""
    summary = {
        "converged": converged,
        "iterations": iterations,
        "observations": observations,
        "redundancy": sum(free.values()),
        "sigma0": float(np.sqrt(sum(group.squares for group in sums.groups.values()) / max(sum(free.values()), 1.0))),
        "condition": solution.condition,
        "rank_deficiency": solution.deficiency,
        "weakest": "" if solution.deficiency else weakest_direction(covariance[:COMMON, :COMMON]),
        "test_statistic": statistic,
        "test_dof": len(cells),
        "test_limit": limit,
        "test_passed": statistic <= limit,
        "reason": reason,
    }
    return {
        "estimate": estimate,
        "covariance": _covariance_table(covariance[:COMMON, :COMMON]),
        "surfaces": _surfaces_table(state, cells),
        "groups": _groups_table(sums, free),
        "cells": _cells_table(state, cells),
        "summary": pd.DataFrame([summary]),
    }


def _covariance_table(covariance: Array) -> pd.DataFrame:
    sigma = np.sqrt(np.diag(covariance))
    return pd.DataFrame(
        {
            "row": np.repeat(NAMES, COMMON),
            "column": np.tile(NAMES, COMMON),
            "covariance": covariance.ravel(),
            "correlation": (covariance / np.outer(sigma, sigma)).ravel(),
        }
    )


def _surfaces_table(state: State, cells: dict[Any, Any]) -> pd.DataFrame:
    rows = []
    for k, surface in enumerate(state.surfaces):
        row: dict[str, Any] = {f"normal_{axis}_target_1": surface.normal[i] for i, axis in enumerate("xyz")}
        row |= {"family": surface.family, "distance_m": float(surface.normal @ surface.centre_m + surface.shift_m)}
        for sensor, name in (("laser", "laser_points"), ("mbes", "soundings")):
            row[name] = sum(cell.count for (s, number, _), cell in cells.items() if s == sensor and number == k)
        rows.append(row)
    return pd.DataFrame(rows)


def _groups_table(sums: Sums, free: dict[str, float]) -> pd.DataFrame:
    rows = [
        {
            "group": name,
            "count": group.count,
            "redundancy": free[name],
            "variance_factor": group.squares / max(free[name], 1.0),
            "rms_normalised": float(np.sqrt(group.squares / max(group.weights, 1.0))),
            "cut": group.cut,
            "reduced": group.reduced,
        }
        for name, group in sums.groups.items()
    ]
    return pd.DataFrame(rows)


def _cells_table(state: State, cells: dict[Any, Any]) -> pd.DataFrame:
    rows = [
        {
            "sensor": sensor,
            "family": state.surfaces[surface].family,
            "pass": number,
            "count": cell.count,
            "mean_m": cell.mean_m,
            "rms_m": cell.rms_m,
            "sigma_mean_m": cell.sigma_mean_m,
            "normalised": cell.normalised,
        }
        for (sensor, surface, number), cell in cells.items()
    ]
    return pd.DataFrame(rows, columns=[column.name for column in artefacts.CELLS.columns])
