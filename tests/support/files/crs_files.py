"""Points in a CRS, written as a table and as LAS, and as they are read."""

from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

AXES = ("x_m", "y_m", "z_m")
ADJUSTED = 4e8


def table(folder: Path, points: list[tuple[float, ...]]) -> Path:
    path = folder / "a.csv"
    lines = [f"{1_400_000_000_000_000_000 + k},{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(points)]
    path.write_text("\n".join(["gps_ns,x_m,y_m,z_m", *lines, ""]))
    return path


def las(folder: Path, points: list[tuple[float, ...]], crs: str | None, scale: float = 0.001, z: float = 0.001) -> Path:
    """LAS with a CRS of its own, if any."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.array([scale, scale, z]), np.floor(np.array(points[0]))
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    if crs is not None:
        header.add_crs(CRS.from_user_input(crs))
    data = laspy.LasData(header)
    data.points = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    data.x, data.y, data.z = np.array(points).T
    data.gps_time = ADJUSTED + 0.0001 + np.arange(len(points))
    path = folder / "a.las"
    data.write(str(path))
    return path


def placed(columns: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack([columns[axis] for axis in AXES], axis=1)
