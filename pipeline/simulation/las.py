"""LAS 1.4, point format 6 (and LAZ): points with GPS time, in the scanner's frame or in ECEF."""

from datetime import date
from pathlib import Path

import laspy
import numpy as np
from laspy.header import GpsTimeType

from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, NS, WEEK_NS
from pipeline.simulation.ins import Columns
from pipeline.simulation.scenario_laser import LaserScenario

_CHUNK = 1_000_000


def write_las(path: Path, laser: Columns, scenario: LaserScenario, day: date) -> None:
    """Write one LAS or LAZ file.

    Parameters
    ----------
    path : Path
        The file.
    laser : Columns
        Points and their times.
    scenario : LaserScenario
        Format, scale, kind of times.
    day : date
        Creation date: the session's day, so that the same session gives the same bytes.
    """
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, scenario.scale_m), np.zeros(3)
    if scenario.frame != "laser" and len(laser["t_ns"]):
        header.offsets = np.array([np.rint(laser[name].mean()) for name in ("x_m", "y_m", "z_m")])
    header.creation_date = day
    header.system_identifier, header.generating_software = "simulated scanner", "poolcal simulate"
    weekly = scenario.time == "week_seconds"
    header.global_encoding.gps_time_type = GpsTimeType.WEEK_TIME if weekly else GpsTimeType.STANDARD
    with laspy.open(path, mode="w", header=header, do_compress=scenario.format == "laz") as file:
        for start in range(0, len(laser["t_ns"]), _CHUNK):
            part = {name: values[start : start + _CHUNK] for name, values in laser.items()}
            points = laspy.ScaleAwarePointRecord.zeros(len(part["t_ns"]), header=header)
            points.x, points.y, points.z = part["x_m"], part["y_m"], part["z_m"]
            t_ns = part["t_ns"] % WEEK_NS if weekly else part["t_ns"] - ADJUSTED_STANDARD_OFFSET_S * NS
            points.gps_time = t_ns // NS + t_ns % NS / NS
            points.return_number[:] = 1
            points.number_of_returns[:] = 1
            file.write_points(points)
