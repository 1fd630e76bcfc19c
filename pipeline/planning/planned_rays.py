"""Rays of both sensors in a planned pass, and the points in which they meet the target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.stage_settings import SonarBeams, narrow
from pipeline.gps_time import NS
from pipeline.maths.adjustment.design_matrix import SPEED_M_S
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.sonar.soundings import points_in_mbes
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import label_points
from pipeline.mount import mount_of
from pipeline.planning.setting import PredictionSetting
from pipeline.target.label_limits import laser_limits, sonar_limits
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GOLDEN = 0.618034  # its multiples spread evenly over a unit
RAYS = 24  # of the laser between two INS records; each stands for several


@dataclass(frozen=True)
class Rays:
    """Rays of a sensor: times (n,), and unit directions (n, 3) in the sensor's frame."""

    sensor: str
    t_ns: Integers
    directions: Array


def laser_rays(setting: PredictionSetting, seconds: float) -> tuple[Rays, float]:
    """Return the laser's rays during ``seconds``, thinned, and the number of points that each ray represents."""
    figures = setting.plan.laser
    each = max(1, int(figures.point_rate_hz / (setting.plan.ins_rate_hz * RAYS)))
    number = np.arange(0, int(seconds * figures.point_rate_hz), each)
    low, high = np.radians(figures.field_deg)
    angle = low + (high - low) * (number * figures.line_rate_hz / figures.point_rate_hz % 1.0)
    rays = np.column_stack([np.sin(angle), np.zeros(len(angle)), np.cos(angle)])
    t_ns = np.round(number / figures.point_rate_hz * NS).astype(np.int64)
    return Rays("laser", t_ns, rays), float(each)


def sonar_rays(setting: PredictionSetting, seconds: float) -> tuple[Rays, float]:
    """Return the sonar's rays during ``seconds``, and the number of soundings that each represents: one.

    The pings fall anywhere between two INS records, and between two lines of the laser, as with clocks of their own.
    For the white noise of a pose between two records, p·(1 - f) + q·f, has (1 - f)² + f² times the variance of a
    record's, and it is the laser's, too, where the laser sees the target at the same moment.
    """
    figures = setting.plan.mbes
    half = np.radians(figures.sector_deg) / 2
    angle = np.linspace(-half, half, figures.beams)
    numbers = np.arange(int(seconds * figures.ping_rate_hz))
    pings = (numbers + numbers * GOLDEN % 1.0) / figures.ping_rate_hz
    edges_deg, tilts_deg = np.array([(sector.to_deg, sector.tilt_deg) for sector in figures.sectors] or [(90.0, 0.0)]).T
    tilt = np.radians(tilts_deg[np.searchsorted(edges_deg, np.degrees(angle))])
    speed = np.full(len(angle), SPEED_M_S)
    fan, there = points_in_mbes(2 / speed, angle, tilt, speed)
    fan = fan[there]
    t_ns = np.repeat(np.round(pings * NS).astype(np.int64), len(fan))
    return Rays("mbes", t_ns, np.tile(fan, (len(pings), 1))), 1.0


def label_rays(
    setting: PredictionSetting, caster: ClosestSurface, trajectory: Trajectory, sensor_rays: Rays
) -> dict[str, Array]:
    """Return the points in which rays meet the target, with the labels that stage segment would give them.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    caster : ClosestSurface
        The target's surface.
    trajectory : Trajectory
        Poses of the body in the target frame.
    sensor_rays : Rays
        The rays.

    Returns
    -------
    dict[str, Array]
        Columns like those of a labelled stream.
    """
    sensor, t_ns, rays = sensor_rays.sensor, sensor_rays.t_ns, sensor_rays.directions
    mount = mount_of(setting.laser.mount) if sensor == "laser" else None
    R = setting.state.R_body_from_sensor if mount is None else mount.R_body_from_sensor
    lever = setting.state.lever_arm_m if mount is None else mount.lever_arm_body_m
    figures = setting.plan.laser if sensor == "laser" else setting.plan.mbes
    origins = trajectory.points_from_body(t_ns, np.broadcast_to(lever, rays.shape))
    directions = trajectory.points_from_body(t_ns, rays @ R.T + lever) - origins
    range_m = caster.ranges(origins, directions)
    met = np.flatnonzero(range_m < figures.max_range_m)
    own, range_m, directions = rays[met] * range_m[met, None], range_m[met], directions[met]
    points = origins[met] + directions * range_m[:, None]
    segment, level = setting.segment, setting.model.water_level_m
    if sensor == "mbes":
        _, R_target_from_body = trajectory.poses_at(t_ns[met])
        beams = beams_in_target(R_target_from_body, R, own, narrow(SonarBeams, setting.mbes))
        limits = sonar_limits(segment, level, segment.gate_m)
    else:
        beams = TargetBeams(directions, range_m)
        limits = laser_limits(segment, level, segment.gate_m, setting.laser.beam_m)
    labels = label_points(setting.model, points, beams, limits)
    on = np.flatnonzero(labels.face >= 0)
    columns = {f"{axis}_{sensor}_m": own[on, k] for k, axis in enumerate("xyz")}
    columns |= {f"{axis}_target_m": points[on, k] for k, axis in enumerate("xyz")}
    return columns | {"t_ns": t_ns[met][on], "face": labels.face[on], "edge_weight": labels.edge_weight[on]}
