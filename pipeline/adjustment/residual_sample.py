"""A thinned sample of the residuals for the report: the table ``residuals``."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.artefacts.catalogue.results import RESIDUALS
from pipeline.artefacts.streams import Batch, point_array
from pipeline.maths.sonar.soundings import receive_angle

AT_MOST = 100_000  # points of a sensor in the table


def sampling_step(total: int, at_most: int = AT_MOST) -> int:
    """Return every how many points to take; odd, so that no pattern of twos in the data is taken for the whole."""
    step = -(-total // at_most)
    return step if step <= 1 else step | 1


def residual_sample(model: ObservationModel, sensor: str, batch: Batch, values: CurrentValues) -> Batch:
    """Return positions and residuals of points, calibrated and coarse, as columns of the table ``residuals``.

    Parameters
    ----------
    model : ObservationModel
        Turns points into observations.
    sensor : {"laser", "mbes"}
        The sensor that observed the points.
    batch : Batch
        Columns of labelled points.
    values : CurrentValues
        The adjusted values.
    """
    state, weighting = values.state, values.weighting
    numbered = {**batch, "row": np.arange(len(batch["t_ns"]))}
    observations = model.linearise(sensor, numbered, values)
    points = observations.points
    own = point_array(points, f"{sensor}_m")
    ranges = np.linalg.norm(own, axis=1)
    angle = receive_angle(own) if sensor == "mbes" else np.arcsin(own[:, 2] / ranges)
    if sensor != state.calibrated:
        positions = coarse_positions = point_array(points, "target_m")
        coarse_residual = observations.v_m
    else:
        coarse = replace(model.coarse, surfaces=state.surfaces)
        positions, coarse_positions = model.points_in_target(points, state), model.points_in_target(points, coarse)
        before = model.linearise(sensor, points, CurrentValues(coarse))
        coarse_residual = before.v_m + before.mean_m
    columns = {f"{axis}_target_m": positions[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"coarse_{axis}_target_m": coarse_positions[:, k] for k, axis in enumerate("xyz")}
    columns |= {"range_m": ranges, "angle_deg": np.degrees(angle)}
    columns |= {"residual_m": observations.v_m + observations.mean_m, "coarse_residual_m": coarse_residual}
    columns |= {"weight": weighting.weights(observations)[0]}
    single = {name: column.astype(np.float32) for name, column in columns.items()}
    sensors = np.full(len(observations.v_m), sensor, dtype=object)
    sample = {"sensor": sensors} | {name: points[name] for name in ("t_ns", "pass", "face")} | single
    in_order = np.argsort(points["row"])
    return {name: column[in_order] for name, column in sample.items()}


def residuals_table(pieces: Sequence[Batch]) -> pd.DataFrame:
    """Return the table ``residuals``: the columns of all batches, one after another."""
    names = [column.name for column in RESIDUALS.columns]
    return pd.DataFrame({name: np.concatenate([piece[name] for piece in pieces]) for name in names})
