"""PDAL filters.georeference: the laser's mount as a matrix ``scan2imu``, row by row.

PDAL's IMU axes are forward, starboard, down; the scanner's own axes are those of its files. With P the exchange of axes
(:mod:`pipeline.exports.convention`) the matrix is [P · R_body_from_laser | P · t; 0 0 0 1]. ``time_offset`` is added
to the points' times, so it has the sign opposite to ours. Only ``coordinate_system`` NED is right with an SBET: with
ENU the code takes the azimuth for a counter-clockwise angle.
"""

import json

import numpy as np

from pipeline.errors import ConfigError
from pipeline.exports.convention import FRD, Convention
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.json_text import json_of
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, written
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

DECIMALS = 12
FILTER = "filters.georeference"
SAME = 1e-6  # of a matrix that is to be a rotation


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    P, body = np.array(target.convention.axes, dtype=np.float64), mounting.vessel
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = P @ body.R_body_from_sensor, P @ body.lever_arm_body_m
    about = [
        *heading(target, mounting),
        *explanation(target, mounting, options),
        "Add the trajectory, an SBET (option trajectory or trajectory_file, by PDAL's version). Leave "
        "coordinate_system at NED: with ENU the result is wrong by metres.",
        "Only for points in the scanner's own frame. Fields of this filter are the laser's, never the sonar's.",
    ]
    stage = {
        "type": FILTER,
        "coordinate_system": "NED",
        "scan2imu": " ".join(written(float(value), DECIMALS) for value in matrix.flat),
        "time_offset": -mounting.latency_s + 0.0,
        "user_data": {"poolcal": about},
    }
    return json.dumps({"pipeline": [stage]}, indent=2, ensure_ascii=False) + "\n"


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    stages = json_of(text, where).get("pipeline")
    found = [one for one in stages if isinstance(one, dict)] if isinstance(stages, list) else []
    filters = [stage for stage in found if stage.get("type") == FILTER]
    if len(filters) != 1:
        raise ConfigError(f"{where}: has {len(filters)} stages {FILTER}; leave one")
    (stage,) = filters
    if stage.get("coordinate_system", "NED") != "NED":
        raise ConfigError(f"{where}: coordinate_system is {stage['coordinate_system']!r}; poolcal reads NED alone")
    words = str(stage.get("scan2imu", "")).split()
    if len(words) != 16:
        raise ConfigError(f"{where}: scan2imu has {len(words)} numbers, not 16; correct it")
    matrix = np.array([number(word, "scan2imu", where) for word in words]).reshape(4, 4)
    P = np.array(target.convention.axes, dtype=np.float64)
    R = P.T @ matrix[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > SAME or np.linalg.det(R) < 0 or np.any(matrix[3] != [0, 0, 0, 1]):
        raise ConfigError(f"{where}: scan2imu is no rotation with a translation; correct it")
    return Mounted(R, P.T @ matrix[:3, 3])


TARGET = Target(
    name="pdal",
    title="PDAL filters.georeference",
    writes="JSON stage, the laser's mount",
    suffix=".json",
    convention=Convention(
        FRD, (1, 1, -1), "YPR", "code", "PDAL, filters/GeoreferenceFilter.cpp, filters/private/georeference/Utils.hpp"
    ),
    write=_write,
    read=_read,
    sensor="laser",
    counts_from="ins",
)
