"""The last reading: what the residuals of every point say, and some of the points to be looked at."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.iteration import Adjusted
from pipeline.adjustment.observation_model import Scene
from pipeline.adjustment.residual_tables import residuals_table, step_for
from pipeline.adjustment.weighting import Observations, Weighting
from pipeline.artefacts.catalogue.results import PATTERNS
from pipeline.artefacts.streams import Batch, Stream, point_array
from pipeline.config.pool import Adjust
from pipeline.gps_time import NS
from pipeline.maths.adjustment.drift_test import against_other_passes
from pipeline.maths.adjustment.mean_tests import standardised
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pose_errors import Drift, PoseNoise
from pipeline.maths.adjustment.residual_means import (
    Cell,
    Moments,
    against_others,
    cells_of,
    merged_moments,
    moments_of,
    steps_of,
)
from pipeline.maths.geometry.passes import pass_of
from pipeline.maths.sonar.soundings import receive_angle

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
WIDTHS = {"face": 1.0, "angle": 2.0, "step": 1.0, "distance": 1.0, "time": 10.0, "pass": 1.0}  # degrees, m, s
CYCLES = {"ping_2": 2, "ping_3": 3, "ping_4": 4}  # a sonar may take its modes in turn, from ping to ping
REACH = 4  # bins on either side of a step
FEWEST, FEWEST_MOMENTS, FEWEST_FREE = 30, 5, 8.0  # points, moments and degrees of freedom of a mean that is judged
TURNS = {"turn_x": 3, "turn_y": 4, "turn_z": 5}  # columns of the drift
KNOWN = 1e9  # degrees of freedom of a sigma that is given
Row = dict[str, Any]
Cells = Mapping[tuple[str, int, int], Cell]  # by sensor, surface, pass


@dataclass(frozen=True)
class Look:
    """By sensor, surface and pass; by all the bins of the table ``patterns``; the table ``residuals``."""

    cells: Cells
    patterns: pd.DataFrame
    residuals: pd.DataFrame


def look(
    streams: Mapping[str, Stream],
    scene: Scene,
    adjusted: Adjusted,
    settings: Adjust,
    of_drift: Iterable[Row],
    at_most: int,
) -> Look:
    """``of_drift``: further rows of ``patterns``; ``at_most`` points of a sensor in the table."""
    cells: dict[tuple[str, int, int], Cell] = {}
    patterns: list[Row] = []
    taken: list[Batch] = []
    families = [surface.family for surface in adjusted.state.surfaces]
    for sensor, stream in streams.items():
        step = step_for(adjusted.reading.observations(sensor), at_most)
        slot_ns = round(settings.moment_s * NS)
        arguments = (scene, sensor, adjusted.state, adjusted.drift, adjusted.weighting, slot_ns, step)
        found: dict[str, list[Moments]] = {}
        for moments, points in stream.fold(_look, *arguments):
            taken.append(points)
            for name, one in moments.items():
                found.setdefault(name, []).append(one)
        for name, pieces in found.items():
            whole = merged_moments(pieces)
            if name == "pass":
                cells |= {(sensor, *cell.key): cell for cell in cells_of(whole)}
            means = _means(name, whole)
            patterns += [_row(name, sensor, families[cell.key[0]], cell) for cell in means if _judged(cell)]
    return Look(cells, _table([*patterns, *of_drift], settings.test_tolerance_m), residuals_table(taken))


def _means(name: str, moments: Moments) -> list[Cell]:
    if name == "pass" or name in CYCLES:
        return against_others(moments)
    return steps_of(moments, REACH) if name == "step" else cells_of(moments)


def _judged(cell: Cell) -> bool:
    return cell.count >= FEWEST and cell.moments >= FEWEST_MOMENTS and cell.dof >= FEWEST_FREE


def _row(name: str, sensor: str, family: str, cell: Cell) -> Row:
    width = WIDTHS.get(name, 1.0)
    return {
        "by": name,
        "sensor": sensor,
        "family": family,
        "low": cell.key[1] * width,
        "width": width,
        "count": cell.count,
        "mean_m": cell.mean_m,
        "sigma_mean_m": cell.sigma_mean_m,
        "dof": cell.dof,
    }


def _table(rows: list[Row], tolerance_m: float) -> pd.DataFrame:
    columns = [column.name for column in PATTERNS.columns]
    table = pd.DataFrame(rows, columns=columns)
    mean, sigma, dof = (table[name].to_numpy(np.float64) for name in ("mean_m", "sigma_mean_m", "dof"))
    tolerated = np.where(table["by"] == "drift", 0.0, tolerance_m)
    return table.assign(normalised=standardised(mean, sigma, dof, tolerated))


def drift_rows(drift: Drift, noise: PoseNoise, poses: pd.DataFrame, passes: pd.DataFrame) -> list[Row]:
    """How the drift found in each pass turns the boat against the others, as rows of ``patterns``; rad. (How it moves
    the boat tells of the INS alone: both sensors move alike.)"""
    t_ns = poses["t_ns"].to_numpy()[drift.knots.record]
    number = pass_of(t_ns, passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()).astype(np.int64)
    places, values, sigmas = against_other_passes(drift, noise, number)
    return [
        {"by": "drift", "sensor": "ins", "family": name, "low": float(place), "width": 1.0}
        | {"count": int(np.sum(number == place)), "mean_m": value[k], "sigma_mean_m": sigma[k], "dof": KNOWN}
        for place, value, sigma in zip(places, values, sigmas, strict=True)
        for name, k in TURNS.items()
        if sigma[k] > 0
    ]


def _look(
    batch: Batch,
    scene: Scene,
    sensor: str,
    state: State,
    drift: Drift,
    weighting: Weighting,
    slot_ns: int,
    step: int,
) -> tuple[dict[str, Moments], Batch]:
    seen = scene.observe(sensor, batch, state, drift, weighting)
    robust, _ = weighting.weights(seen)
    plain = seen.sigma_m * np.sqrt(weighting.factor(seen.group))
    size = np.where(robust > 0, np.abs(weighting.normalised(seen)), 0.0)
    slot = seen.points["t_ns"] // slot_ns
    # a whole cell off must show, not be cut away: plain weights
    moments = {}
    for name, values in _variables(sensor, seen):
        place = np.floor(values / WIDTHS.get(name, 1.0)).astype(np.int64)
        moments[name] = moments_of(seen.surface, place, slot, 1 / plain**2, seen.v_m, size)
    some = {name: values[::step] for name, values in batch.items()}
    return moments, scene.sample(sensor, some, state, drift, weighting)


def _variables(sensor: str, seen: Observations) -> Iterator[tuple[str, Array | Integers]]:
    """What residuals are sorted by, and its value of each point (n,)."""
    batch = seen.points
    own = point_array(batch, f"{sensor}_m")
    range_m = np.linalg.norm(own, axis=1)
    angle = np.degrees(np.arcsin(own[:, 2] / range_m) if sensor == "laser" else receive_angle(own))
    yield "pass", batch["pass"].astype(np.int64)
    yield "face", batch["face"].astype(np.int64)
    yield "angle", angle
    yield "distance", range_m
    yield "time", batch["t_ns"] // NS
    if sensor == "mbes":
        yield "step", angle
        for name, pings in CYCLES.items():
            yield name, batch["ping"] % pings
