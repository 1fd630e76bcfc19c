"""The adjustment's residuals as tables: the points themselves, binned along one variable, and by cell of each face."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.results import RESIDUALS
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import normal_of
from pipeline.artefacts.streams import Batch
from pipeline.gps_time import NS
from pipeline.maths.geometry.face_grid import BinStatistics, bin_statistics, cell_centres, cells_on_face

SENSORS = ("laser", "mbes")
WIDTHS = {"angle": 2.0, "range": 0.5, "time": 1.0}  # degrees, m, s
CELL_M = 0.1
FEWEST = 10  # points behind a mean that is shown to people


def step_for(total: int, at_most: int) -> int:
    """Every how many points to take; odd, so that no pattern of twos in the data is taken for the whole."""
    step = -(-total // at_most)
    return step if step <= 1 else step | 1


def residuals_table(pieces: Sequence[Batch]) -> pd.DataFrame:
    """All batches' columns one after another."""
    names = [column.name for column in RESIDUALS.columns]
    return pd.DataFrame({name: np.concatenate([piece[name] for piece in pieces]) for name in names})


def bins_table(residuals: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """Angle and range over all passes together, time pass by pass."""
    families = sorted(set(faces["family"]))
    family = _family_number(residuals, faces, families)
    rows: list[pd.DataFrame] = []
    for sensor in SENSORS:
        use = (residuals["sensor"] == sensor).to_numpy()
        points = residuals[use]
        everywhere = np.full(len(points), ALL_PASSES)
        for by, number, values in (
            ("angle", everywhere, points["angle_deg"].to_numpy(np.float64)),
            ("range", everywhere, points["range_m"].to_numpy(np.float64)),
            ("time", points["pass"].to_numpy(), points["t_ns"].to_numpy() // round(WIDTHS["time"] * NS)),
        ):
            place = values if by == "time" else np.floor(values / WIDTHS[by]).astype(np.int64)
            found = _binned(points, family[use], number, place)
            rows.append(
                pd.DataFrame(
                    {
                        "sensor": sensor,
                        "family": np.array(families, dtype=object)[found.keys[:, 0]],
                        "pass": found.keys[:, 1].astype(np.int16),
                        "by": by,
                        "low": found.keys[:, 2] * WIDTHS[by],
                        "width": WIDTHS[by],
                        **_columns(found),
                    }
                )
            )
    return pd.concat(rows, ignore_index=True)


def map_table(residuals: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """Mean residual of each cell of each face, sensor by sensor."""
    rows: list[pd.DataFrame] = []
    for sensor in SENSORS:
        of_sensor = residuals[residuals["sensor"] == sensor]
        for face in faces.to_dict("records"):
            points = of_sensor[of_sensor["face"] == face["face"]]
            normal = normal_of(face)
            where = points[[f"{axis}_target_m" for axis in "xyz"]].to_numpy(np.float64)
            cells = cells_on_face(where, normal, CELL_M)
            found = _binned(points, cells[:, 0], cells[:, 1])
            centres = cell_centres(found.keys, normal, float(face["distance_m"]), CELL_M).reshape(-1, 3)
            placed = {f"{axis}_target_m": centres[:, k] for k, axis in enumerate("xyz")}
            number = {"sensor": sensor, "face": np.full(len(centres), face["face"], dtype=np.int16)}
            rows.append(pd.DataFrame(number | placed | {"size_m": CELL_M} | _columns(found)))
    return pd.concat(rows, ignore_index=True)


def _binned(points: pd.DataFrame, *keys: Any) -> BinStatistics:
    values = (points[name].to_numpy(np.float64) for name in ("residual_m", "weight"))
    return bin_statistics(np.column_stack([np.asarray(key, dtype=np.int64) for key in keys]), *values)


def _columns(found: BinStatistics) -> dict[str, Any]:
    return {"count": found.count, "mean_m": found.mean_m, "rms_m": found.rms_m}


def _family_number(residuals: pd.DataFrame, faces: pd.DataFrame, families: list[str]) -> NDArray[np.int64]:
    by_face = np.array([families.index(name) for name in faces["family"]], dtype=np.int64)
    return np.asarray(by_face[residuals["face"].to_numpy().astype(int)])
