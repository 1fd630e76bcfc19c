"""Mean residuals of the sample as tables: along one variable, and by grid cell of each face."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import normal_of
from pipeline.gps_time import NS
from pipeline.maths.geometry.face_grid import BinStatistics, bin_statistics, cell_centres, cells_on_face

SENSORS = ("laser", "mbes")
WIDTHS = {"angle": 2.0, "range": 0.5, "time": 1.0}  # degrees, m, s
CELL_M = 0.1
FEWEST = 10  # points behind a mean that the report shows


def bins_table(residuals: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``residual_bins``: by angle and range over all passes together, by time pass by pass."""
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
    """Return the table ``residual_map``: the mean residual of each grid cell of each face, sensor by sensor."""
    rows: list[pd.DataFrame] = []
    for sensor in SENSORS:
        of_sensor = residuals[residuals["sensor"] == sensor]
        for face in faces.to_dict("records"):
            points = of_sensor[of_sensor["face"] == face["face"]]
            normal = normal_of(face)
            positions = points[[f"{axis}_target_m" for axis in "xyz"]].to_numpy(np.float64)
            cells = cells_on_face(positions, normal, CELL_M)
            bins = _binned(points, cells[:, 0], cells[:, 1])
            centres = cell_centres(bins.keys, normal, float(face["distance_m"]), CELL_M).reshape(-1, 3)
            centre_columns = {f"{axis}_target_m": centres[:, k] for k, axis in enumerate("xyz")}
            number = {"sensor": sensor, "face": np.full(len(centres), face["face"], dtype=np.int16)}
            rows.append(pd.DataFrame(number | centre_columns | {"size_m": CELL_M} | _columns(bins)))
    return pd.concat(rows, ignore_index=True)


def _binned(points: pd.DataFrame, *keys: Any) -> BinStatistics:
    values = (points[name].to_numpy(np.float64) for name in ("residual_m", "weight"))
    return bin_statistics(np.column_stack([np.asarray(key, dtype=np.int64) for key in keys]), *values)


def _columns(bins: BinStatistics) -> dict[str, Any]:
    return {"count": bins.count, "mean_m": bins.mean_m, "rms_m": bins.rms_m}


def _family_number(residuals: pd.DataFrame, faces: pd.DataFrame, families: list[str]) -> NDArray[np.int64]:
    by_face = np.array([families.index(name) for name in faces["family"]], dtype=np.int64)
    return np.asarray(by_face[residuals["face"].to_numpy().astype(int)])
