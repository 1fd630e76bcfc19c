"""The last reading: what the residuals of every point say, and some of the points to be looked at."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.adjusting import Adjusted
from pipeline.maths.consistency import Cell, Moments, cells_of, merged_moments, moments_of
from pipeline.maths.knots import Drift
from pipeline.maths.unknowns import State
from pipeline.residuals import residuals_table, step_for
from pipeline.scene import Scene, Weighting
from pipeline.streams import Batch, Stream
from pipeline.times import NS

Cells = Mapping[tuple[str, int, int], Cell]  # by sensor, surface, pass


@dataclass(frozen=True)
class Look:
    """Cells, and the table ``residuals``."""

    cells: Cells
    residuals: pd.DataFrame


def look(
    streams: Mapping[str, Stream], scene: Scene, adjusted: Adjusted, slot_s: float, tolerance_m: float, at_most: int
) -> Look:
    """``at_most`` points of a sensor in the table."""
    cells: dict[tuple[str, int, int], Cell] = {}
    taken: list[Batch] = []
    for sensor, stream in streams.items():
        step = step_for(adjusted.reading.observations(sensor), at_most)
        arguments = (scene, sensor, adjusted.state, adjusted.drift, adjusted.weighting, round(slot_s * NS), step)
        moments = []
        for found, points in stream.fold(_look, *arguments):
            moments.append(found)
            taken.append(points)
        of_sensor = cells_of(merged_moments(moments), tolerance_m)
        cells |= {(sensor, *key): cell for key, cell in of_sensor.items()}
    return Look(cells, residuals_table(taken))


def _look(
    batch: Batch,
    scene: Scene,
    sensor: str,
    state: State,
    drift: Drift,
    weighting: Weighting,
    slot_ns: int,
    step: int,
) -> tuple[Moments, Batch]:
    seen = scene.observe(sensor, batch, state, drift)
    robust, _ = weighting.weights(seen.group, seen.v_m, seen.sigma_m)
    plain = seen.sigma_m * np.sqrt(weighting.factor(seen.group))
    key = np.column_stack([seen.surface, batch["pass"].astype(np.int64), batch["t_ns"] // slot_ns])
    # a whole cell off must show, not be cut away: plain weights
    moments = moments_of(key, 1 / plain**2, seen.v_m, np.where(robust > 0, np.abs(seen.v_m) / plain, 0.0))
    some = {name: values[::step] for name, values in batch.items()}
    return moments, scene.sample(sensor, some, state, drift, weighting)


