"""Tables of the residuals' sample: the sample, its means along one variable, and by grid cell of each face."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.point_sums import SummedBatch
from pipeline.artefacts.catalogue.results import RESIDUALS
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import normal_of
from pipeline.artefacts.streams import Batch, point_array
from pipeline.gps_time import NS
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.geometry.face_grid import BinStatistics, bin_statistics, cell_centres, cells_on_face
from pipeline.maths.sonar.soundings import receive_angle

Array = NDArray[np.float64]
WIDTHS = {"angle": 2.0, "range": 0.5, "time": 1.0}  # of bins: degrees, m, s
CELL_M = 0.1
FEWEST = 10  # points: the report shows no mean of fewer
AT_MOST = 100_000  # about the largest number of points of a sensor in table residuals


def bins_table(residuals: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``residual_bins``: means by angle and range over all passes together, by time in each pass."""
    families = sorted(set(faces["family"]))
    family = _family_number(residuals, faces, families)
    rows: list[pd.DataFrame] = []
    for sensor in _sensors(residuals):
        use = (residuals["sensor"] == sensor).to_numpy()
        points = residuals[use]
        everywhere = np.full(len(points), ALL_PASSES)
        for by, number, values in (
            ("angle", everywhere, points["angle_deg"].to_numpy(np.float64)),
            ("range", everywhere, points["range_m"].to_numpy(np.float64)),
            ("time", points["pass"].to_numpy(), points["t_ns"].to_numpy() // round(WIDTHS["time"] * NS)),
        ):
            place = values if by == "time" else np.floor(values / WIDTHS[by]).astype(np.int64)
            bins = _binned(points, family[use], number, place)
            rows.append(
                pd.DataFrame(
                    {
                        "sensor": sensor,
                        "family": np.array(families, dtype=object)[bins.keys[:, 0]],
                        "pass": bins.keys[:, 1].astype(np.int16),
                        "by": by,
                        "low": bins.keys[:, 2] * WIDTHS[by],
                        "width": WIDTHS[by],
                        **_columns(bins),
                    }
                )
            )
    return pd.concat(rows, ignore_index=True)


def map_table(residuals: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``residual_map``: the mean residual of each sensor in each grid cell of each face."""
    rows: list[dict[str, Any]] = []
    for sensor in _sensors(residuals):
        of_sensor = residuals[residuals["sensor"] == sensor]
        positions = of_sensor[[f"{axis}_target_m" for axis in "xyz"]].to_numpy(np.float64)
        residual_m, weight = (of_sensor[name].to_numpy(np.float64) for name in ("residual_m", "weight"))
        face_number = of_sensor["face"].to_numpy()
        by_face = np.argsort(face_number, kind="stable")
        for face in faces.to_dict("records"):
            ends = (np.searchsorted(face_number, face["face"], side, by_face) for side in ("left", "right"))
            points, normal = by_face[slice(*ends)], normal_of(face)
            cells = cells_on_face(positions[points], normal, CELL_M)
            bins = bin_statistics(cells, residual_m[points], weight[points])
            centres = cell_centres(bins.keys, normal, float(face["distance_m"]), CELL_M).reshape(-1, 3)
            centre_columns = {f"{axis}_target_m": centres[:, k] for k, axis in enumerate("xyz")}
            number = np.full(len(centres), face["face"], dtype=np.int16)
            rows.append({"sensor": np.full(len(centres), sensor, dtype=object), "face": number, **centre_columns})
            rows[-1] |= {"size_m": np.full(len(centres), CELL_M), **_columns(bins)}
    return pd.DataFrame({name: np.concatenate([row[name] for row in rows]) for name in rows[0]})


def _sensors(residuals: pd.DataFrame) -> list[str]:
    """Return the names of the sensors: the laser, the first head of the sonar, and further heads that have points."""
    return sorted({"laser", "mbes", *residuals["sensor"].unique()})


def _binned(points: pd.DataFrame, *keys: Any) -> BinStatistics:
    values = (points[name].to_numpy(np.float64) for name in ("residual_m", "weight"))
    return bin_statistics(np.column_stack([np.asarray(key, dtype=np.int64) for key in keys]), *values)


def _columns(bins: BinStatistics) -> dict[str, Any]:
    return {"count": bins.count, "mean_m": bins.mean_m, "rms_m": bins.rms_m}


def _family_number(residuals: pd.DataFrame, faces: pd.DataFrame, families: list[str]) -> NDArray[np.int64]:
    by_face = np.array([families.index(name) for name in faces["family"]], dtype=np.int64)
    return np.asarray(by_face[residuals["face"].to_numpy().astype(int)])


def sampling_step(total: int, at_most: int = AT_MOST) -> int:
    """Return n for a sample of every n-th point. An odd n cannot miss one of two alternating kinds of points."""
    step = -(-total // at_most)
    return step if step <= 1 else step | 1


def residual_sample(model: ObservationModel, sensor: str, observed: SummedBatch, state: State, step: int) -> Batch:
    """Return columns of table ``residuals``: positions and residuals with the calibrated and with the coarse mount.

    Parameters
    ----------
    model : ObservationModel
        Model that turns points into observations.
    sensor : str
        The sensor that observed the points: the laser, or a head of the sonar.
    observed : SummedBatch
        Labelled points with their residuals.
    state : State
        The adjusted values.
    step : int
        Every ``step``-th point is in the sample.
    """
    points = {name: column[::step].copy() for name, column in observed.points.items()}  # views would keep all
    v_m, mean_m, robust, *_ = observed.observed[:, ::step]
    own = point_array(points, f"{kind_of(sensor)}_m")
    ranges = np.linalg.norm(own, axis=1)
    angle = receive_angle(own) if kind_of(sensor) == "mbes" else np.arcsin(own[:, 2] / ranges)
    if sensor not in state.heads:
        positions = coarse_positions = point_array(points, "target_m")
        coarse_residual = v_m
    else:
        positions, coarse_positions = (model.points_in_target(sensor, points, at) for at in (state, model.coarse))
        coarse_residual = _distances(model, points["face"], coarse_positions, state)
    columns = {f"{axis}_target_m": positions[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"coarse_{axis}_target_m": coarse_positions[:, k] for k, axis in enumerate("xyz")}
    columns |= {"range_m": ranges, "angle_deg": np.degrees(angle)}
    columns |= {"residual_m": v_m + mean_m, "coarse_residual_m": coarse_residual, "weight": robust}
    single = {name: column.astype(np.float32) for name, column in columns.items()}
    sensors = np.empty(len(v_m), dtype=object)
    sensors.fill(sensor)  # one text for all; np.full makes one for each
    return {"sensor": sensors} | {name: points[name] for name in ("t_ns", "pass", "face")} | single


def _distances(model: ObservationModel, face: NDArray[np.int16], positions_m: Array, state: State) -> Array:
    """Return the distances (n,) m of points (n, 3) from the surfaces of the state, along their normals."""
    surface = model.faces.surface[face]
    normals = np.array([each.normal for each in state.surfaces])
    away = np.einsum("ni,ni->n", positions_m, normals[surface])
    distances_m = np.array([each.distance_m for each in state.surfaces])
    return np.asarray(away - distances_m[surface] - model.height_of_face[face])


def residuals_table(pieces: Sequence[Batch]) -> pd.DataFrame:
    """Return the table ``residuals``: the columns of all batches, one after another."""
    names = [column.name for column in RESIDUALS.columns]
    return pd.DataFrame({name: np.concatenate([piece[name] for piece in pieces]) for name in names})
