"""Laser points as other programs deliver them: placed in ECEF (EPSG:4978) with the recorded INS poses."""

import numpy as np
from pyproj import Transformer

from pipeline.gps_time import NS
from pipeline.simulation.ins import Columns
from pipeline.simulation.motion import R_level_from_body
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.scenario_laser import LaserScenario
from pipeline.simulation.site import Floats, R_ecef_from_level

_CHUNK = 200_000


def laser_in_ecef(laser: Columns, ins: Columns, scenario: LaserScenario) -> Columns:
    """Return laser points in ECEF.

    x_ecef = x_ins + R_ecef_from_level R_level_from_body (R_body_from_laser x_laser + lever arm). Poses are interpolated
    linearly between INS records, at recorded time - declared latency; the times stay as recorded.

    Parameters
    ----------
    laser : Columns
        Points in the scanner's frame.
    ins : Columns
        Recorded poses.
    scenario : LaserScenario
        Mount and declared latency.
    """
    columns_ecef = {name: np.empty(len(laser["t_ns"])) for name in ("x_m", "y_m", "z_m")}
    for start in range(0, len(laser["t_ns"]), _CHUNK):
        part = slice(start, start + _CHUNK)
        points = _place({name: values[part] for name, values in laser.items()}, ins, scenario)
        for name, values in zip(columns_ecef, points.T, strict=True):
            columns_ecef[name][part] = values
    return {"t_ns": laser["t_ns"]} | columns_ecef


def _place(laser: Columns, ins: Columns, scenario: LaserScenario) -> Floats:
    """Return points (n, 3) in ECEF, m."""
    begin_ns = ins["t_ns"][0]
    times_s = (laser["t_ns"] - round(scenario.latency_declared_s * NS) - begin_ns) / NS
    epochs_s = (ins["t_ns"] - begin_ns) / NS
    names = ("latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad")
    latitude, longitude, height, roll, pitch = (np.interp(times_s, epochs_s, ins[name]) for name in names)
    azimuth = np.interp(times_s, epochs_s, np.unwrap(ins["azimuth_rad"]))
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    position = np.stack(to_ecef.transform(longitude, latitude, height, radians=True), axis=1)
    points_laser = np.stack([laser["x_m"], laser["y_m"], laser["z_m"]], axis=1)
    points_body = R_body_from_sensor(scenario.mount).apply(points_laser) + lever_arm_m(scenario.mount)
    R_ecef_from_body = R_ecef_from_level(latitude, longitude) @ R_level_from_body(roll, pitch, azimuth)
    points_ecef: Floats = position + np.einsum("nij,nj->ni", R_ecef_from_body, points_body)
    return points_ecef
