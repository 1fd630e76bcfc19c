"""The last reading: what the residuals of every point say, and some of the points to be looked at."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import artefacts
from pipeline.adjusting import Adjusted
from pipeline.maths.consistency import Cell, Moments, cells_of, merged_moments, moments_of
from pipeline.maths.knots import Drift
from pipeline.maths.soundings import receive_angle
from pipeline.maths.unknowns import State
from pipeline.residuals import residuals_table, step_for
from pipeline.scene import Observations, Scene, Weighting
from pipeline.streams import Batch, Stream, xyz
from pipeline.times import NS

Integers = NDArray[np.int64]
ANGLE_DEG, DISTANCE_M, TIME_S = 5.0, 1.0, 10.0
FEWEST, FEWEST_MOMENTS = 30, 5  # points and moments of a bin that is judged
Cells = Mapping[tuple[str, int, int], Cell]  # by sensor, surface, pass


@dataclass(frozen=True)
class Look:
    """By sensor, surface and pass; by all the bins of the table ``patterns``; the table ``residuals``."""

    cells: Cells
    patterns: pd.DataFrame
    residuals: pd.DataFrame


def look(
    streams: Mapping[str, Stream], scene: Scene, adjusted: Adjusted, slot_s: float, tolerance_m: float, at_most: int
) -> Look:
    """``at_most`` points of a sensor in the table."""
    cells: dict[tuple[str, int, int], Cell] = {}
    patterns: list[dict[str, Any]] = []
    taken: list[Batch] = []
    families = [surface.family for surface in adjusted.state.surfaces]
    for sensor, stream in streams.items():
        step = step_for(adjusted.reading.observations(sensor), at_most)
        arguments = (scene, sensor, adjusted.state, adjusted.drift, adjusted.weighting, round(slot_s * NS), step)
        found: dict[str, list[Moments]] = {}
        for moments, points in stream.fold(_look, *arguments):
            taken.append(points)
            for name, one in moments.items():
                found.setdefault(name, []).append(one)
        for name, pieces in found.items():
            binned = cells_of(merged_moments(pieces), tolerance_m)
            if name == "pass":
                cells |= {(sensor, *cell.key): cell for cell in binned}
            else:
                patterns += [_row(name, sensor, families, cell) for cell in binned if _judged(cell)]
    columns = [column.name for column in artefacts.PATTERNS.columns]
    return Look(cells, pd.DataFrame(patterns, columns=columns), residuals_table(taken))


def _judged(cell: Cell) -> bool:
    return cell.count >= FEWEST and cell.moments >= FEWEST_MOMENTS


def _row(name: str, sensor: str, families: list[str], cell: Cell) -> dict[str, Any]:
    first, second = cell.key
    width = {"face": 1.0, "angle": ANGLE_DEG, "distance": DISTANCE_M, "time": TIME_S}[name]
    return {
        "by": name,
        "sensor": sensor,
        "family": families[first],
        "low": second * width,
        "width": width,
        "count": cell.count,
        "mean_m": cell.mean_m,
        "sigma_mean_m": cell.sigma_mean_m,
        "normalised": cell.normalised,
    }


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
    moments = {
        name: moments_of(first, second, slot, 1 / plain**2, seen.v_m, size)
        for name, first, second in _bins(sensor, seen)
    }
    some = {name: values[::step] for name, values in batch.items()}
    return moments, scene.sample(sensor, some, state, drift, weighting)


def _bins(sensor: str, seen: Observations) -> Iterator[tuple[str, Integers, Integers]]:
    """Name, and two numbers of each point's bin."""
    batch = seen.points
    own = xyz(batch, f"{sensor}_m")
    range_m = np.linalg.norm(own, axis=1)
    angle = np.arcsin(own[:, 2] / range_m) if sensor == "laser" else receive_angle(own)
    yield "pass", seen.surface, batch["pass"].astype(np.int64)
    yield "face", seen.surface, batch["face"].astype(np.int64)
    yield "angle", seen.surface, np.floor(np.degrees(angle) / ANGLE_DEG).astype(np.int64)
    yield "distance", seen.surface, np.floor(range_m / DISTANCE_M).astype(np.int64)
    yield "time", seen.surface, batch["t_ns"] // round(TIME_S * NS)
