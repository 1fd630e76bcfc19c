"""A simulated session as plain tables, and its soundings placed by an independent forward model."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from pyproj import Transformer
from scipy.spatial.transform import Rotation, Slerp

from pipeline.gps_time import WEEK_NS
from pipeline.simulation.session import SimulatedSession


def write_tables(
    simulated: SimulatedSession, folder: Path, kind: str, keep: np.ndarray | None = None, weeks: bool = False
) -> None:
    """The session as one table a sensor, CSV or Parquet; ``keep`` picks soundings, ``weeks`` splits the times."""
    ins, laser, mbes = simulated.ins, simulated.laser, simulated.mbes
    if keep is not None:
        mbes = {name: values[keep] for name, values in mbes.items()}
    degrees = {
        "latitude_deg": "latitude_rad", "longitude_deg": "longitude_rad", "roll_deg": "roll_rad",
        "pitch_deg": "pitch_rad", "heading_deg": "azimuth_rad",
    }
    tables = {
        "ins": {name: np.degrees(ins[source]) for name, source in degrees.items()} | {"height_m": ins["height_m"]},
        "laser": {f"{axis}_m": laser[f"{axis}_m"] for axis in "xyz"},
        "mbes": {
            "ping": mbes["ping"], "beam": mbes["beam"], "angle_deg": np.degrees(mbes["angle_rad"]),
            "transmit_tilt_deg": np.degrees(mbes["transmit_tilt_rad"]),
            "sound_speed_m_s": mbes["sound_speed_m_s"], "two_way_time_s": mbes["two_way_time_s"],
        },
    }
    times = {"ins": ins["t_ns"], "laser": laser["t_ns"], "mbes": mbes["t_ns"]}
    text: dict[str, Any] = dict(simulated.session)
    for sensor, columns in tables.items():
        t_ns = times[sensor]
        if weeks:
            columns = {"gps_week": t_ns // WEEK_NS, "seconds_of_week": t_ns % WEEK_NS / 1e9} | columns
        else:
            columns = {"gps_ns": t_ns} | columns
        table = pa.table({name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()})
        path = folder / sensor / f"{sensor}.{kind}"
        path.parent.mkdir(parents=True, exist_ok=True)
        if kind == "csv":
            table.to_pandas().to_csv(path, index=False)
        else:
            pq.write_table(table, path)
        text[sensor] = text[sensor] | {"format": "table", "files": [f"{sensor}/*.{kind}"]}
    (folder / "session.yaml").write_text(yaml.safe_dump(text, sort_keys=False), encoding="utf-8")
    (folder / "pool.yaml").write_text(yaml.safe_dump(simulated.pool, sort_keys=False), encoding="utf-8")


def place_soundings(simulated: SimulatedSession) -> np.ndarray:
    """(n, 3) soundings in the target frame with the true mount: through ECEF by pyproj, attitude by scipy's Slerp."""
    truth, ins, mbes = simulated.truth, simulated.ins, simulated.mbes
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    origin, azimuth_rad = truth["target"]["origin"], np.radians(truth["target"]["azimuth_deg"])
    latitude, longitude = np.radians(origin["latitude_deg"]), np.radians(origin["longitude_deg"])
    at = np.array(to_ecef.transform(origin["longitude_deg"], origin["latitude_deg"], origin["height_m"]))
    sp, cp, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    R_ecef_from_level = np.array([[-sl, -sp * cl, cp * cl], [cl, -sp * sl, cp * sl], [0, cp, sp]])
    R_target_from_level = Rotation.from_euler("z", azimuth_rad)
    places = np.array(
        to_ecef.transform(np.degrees(ins["longitude_rad"]), np.degrees(ins["latitude_rad"]), ins["height_m"])
    ).T
    level = (places - at) @ R_ecef_from_level
    R_level_from_body = Rotation.from_euler(
        "ZXY", np.column_stack([-ins["azimuth_rad"], ins["pitch_rad"], ins["roll_rad"]])
    )
    seconds, when = ((t - ins["t_ns"][0]) / 1e9 for t in (ins["t_ns"], mbes["t_ns"]))
    inside = np.clip(when, seconds[0], seconds[-1])
    attitude = R_target_from_level * Slerp(seconds, R_level_from_body)(inside)
    position = R_target_from_level.apply(np.column_stack([np.interp(inside, seconds, level[:, k]) for k in range(3)]))
    ranges = mbes["two_way_time_s"] / 2 * mbes["sound_speed_m_s"]
    angle = mbes["angle_rad"]
    upright = np.column_stack([np.sin(angle), np.zeros_like(angle), -np.cos(angle)])
    forward = np.arcsin(np.sin(mbes["transmit_tilt_rad"]) / np.cos(angle))  # the turn about x that looks so far forward
    sonar = ranges[:, None] * Rotation.from_euler("x", forward[:, None]).apply(upright)
    R_body_from_mbes = np.array(truth["mbes"]["R_body_from_mbes"])
    lever_arm_m = np.array(truth["mbes"]["lever_arm_m"])
    return np.asarray(position + attitude.apply(sonar @ R_body_from_mbes.T + lever_arm_m))
