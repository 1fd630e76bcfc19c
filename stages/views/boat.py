"""The boat in the middle of each pass: a box for it, for scanner and sonar head, their axes and fans of rays.

    /fans/<sensor>/pass_<n>           rays from the sensor to its points of one epoch
    /boat/pass_<n>                    the body frame at that epoch: hull and axes
    /boat/pass_<n>/scanner, /head     the sensors' frames on it: box and axes

The hull is a sketch of usual size; it has its place by the water and by the INS. The sensors stand where their mounts
say: the sonar, or the laser that is calibrated, by the adjustment's result.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.results import ESTIMATE
from pipeline.artefacts.catalogue.target import TARGET_POSE
from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.gps_time import NS
from pipeline.maths.adjustment.parameters import kind_of
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.mount import Mounted, mount_of
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from stages.views.recording import GREY, SONAR

Array = NDArray[np.float64]

RAYS = 60  # most rays in a fan
FAN_NS = NS // 50  # points of a fan lie within this time of its epoch
HULL_M = (0.8, 2.2, 0.35)  # half sizes of the sketched hull: starboard, forward, up
NAMES = {"laser": "scanner", "mbes": "head"}
BOXES_M = {"laser": (0.12, 0.12, 0.12), "mbes": (0.16, 0.1, 0.06)}  # half sizes along the sensor's axes
AXIS_COLOURS = [(200, 50, 50), (40, 140, 60), (50, 80, 200)]  # x, y, z


def log_boats(recording: Any, tables: Tables, residuals: pd.DataFrame) -> None:
    """Log the fans of both sensors and the boat at one epoch of each pass.

    Parameters
    ----------
    recording
        The rerun recording stream.
    tables
        The run's tables.
    residuals
        The artefact ``residuals``.
    """
    settings = read_settings(tables.run)
    session = settings.session
    trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
    mounts = {"laser": mount_of(session.laser.mount)}
    if session.mbes is None:
        mounts["laser"] = _calibrated(tables, mounts["laser"], "")
    for name, block in session.heads.items():
        mounts[name] = _calibrated(tables, mount_of(block.mount), "" if block is session.mbes else name)
    first = residuals["pass"].min()  # the boat of this pass has names at its sensors; more would hide the scene
    for number, of_pass in residuals.groupby("pass", sort=True):
        epochs = {}
        for sensor, rows in of_pass.groupby("sensor", sort=True):
            t_ns = rows["t_ns"].to_numpy()
            epochs[str(sensor)] = int(t_ns[np.argmin(np.abs(t_ns - int(np.median(t_ns))))])
            _fan(recording, trajectory, rows, (str(sensor), int(str(number))), epochs[str(sensor)], mounts)
        epoch = epochs.get(session.calibrated, next(iter(epochs.values())))
        position, R_target_from_body = (values[0] for values in trajectory.poses_at(np.array([epoch])))
        path, named = f"boat/pass_{number}", number == first
        _boat(recording, path, position, R_target_from_body, settings.pool.target.water_level_m)
        _axes(recording, f"{path}/axes", 0.8, "INS" if named else "")
        for sensor, mount in mounts.items():
            name = NAMES.get(sensor, sensor)
            place = f"{path}/{name}"
            _sensor(recording, place, mount, BOXES_M[kind_of(sensor)])
            _axes(recording, f"{place}/axes", 0.45, name if named else "")


def _fan(
    recording: Any, trajectory: Any, rows: pd.DataFrame, of: tuple[str, int], epoch: int, mounts: dict[str, Mounted]
) -> None:
    """Log the rays from a sensor to its points near an epoch; ``of``: sensor and pass."""
    import rerun as rr

    sensor, number = of
    fan = rows[np.abs(rows["t_ns"].to_numpy() - epoch) <= FAN_NS]
    fan = fan.iloc[:: max(1, -(-len(fan) // RAYS))]
    positions, R_target_from_body = trajectory.poses_at(fan["t_ns"].to_numpy())
    origins = positions + R_target_from_body @ mounts[sensor].lever_arm_body_m
    ends = fan[[f"{axis}_target_m" for axis in "xyz"]].to_numpy(np.float64)
    rays = np.stack([origins, ends], axis=1).astype(np.float32)
    lines = rr.LineStrips3D(rays, radii=0.004, colors=GREY if sensor == "laser" else SONAR)
    recording.log(f"fans/{sensor}/pass_{number}", lines, static=True)


def _boat(recording: Any, path: str, position: Array, R_target_from_body: Array, water_level_m: float) -> None:
    """Log the body frame, and a sketch of the hull in the water."""
    import rerun as rr

    recording.log(path, rr.Transform3D(translation=position, mat3x3=R_target_from_body), static=True)
    middle = (0.0, 0.0, water_level_m - position[2] + 0.3 * HULL_M[2])
    hull = rr.Boxes3D(centers=[middle], half_sizes=[HULL_M], colors=[GREY], radii=0.01)
    recording.log(f"{path}/hull", hull, static=True)


def _sensor(recording: Any, path: str, mount: Mounted, half_sizes_m: tuple[float, float, float]) -> None:
    """Log a sensor's frame on the boat, and its box."""
    import rerun as rr

    placed = rr.Transform3D(translation=mount.lever_arm_body_m, mat3x3=mount.R_body_from_sensor)
    recording.log(path, placed, static=True)
    box = rr.Boxes3D(half_sizes=[half_sizes_m], colors=[GREY], radii=0.008)
    recording.log(f"{path}/box", box, static=True)


def _axes(recording: Any, path: str, length_m: float, name: str) -> None:
    """Log the axes of a frame as arrows, x red, y green, z blue; with a name at its origin, unless it is empty."""
    import rerun as rr

    arrows = rr.Arrows3D(vectors=length_m * np.eye(3), radii=0.012, colors=AXIS_COLOURS)
    recording.log(path, arrows, static=True)
    if name:  # a label has the colour of its point, and a grey ground
        point = rr.Points3D([[0.0, 0.0, length_m]], radii=0.001, colors=(255, 255, 255), labels=name)
        recording.log(f"{path}/name", point, static=True)


def _calibrated(tables: Tables, coarse: Mounted, head: str) -> Mounted:
    """Return the mount of the adjustment's estimate; the coarse mount if there is no estimate.

    ``head``: name of a further head; empty: the first one, or the laser.
    """
    estimate = tables.table(ESTIMATE).set_index("unknown")["value"]
    values = estimate.loc[[f"{head}_{name}" if head else name for name in MOUNT_NAMES]].to_numpy()
    if not np.all(np.isfinite(values)):
        return coarse
    return Mounted(exp_so3(values[:3]) @ coarse.R_body_from_sensor, coarse.lever_arm_body_m + values[3:])
