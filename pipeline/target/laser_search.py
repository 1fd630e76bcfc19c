"""The laser's provisional mount, found together with the target's pose where the laser itself is calibrated."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.labelling import Beams, label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.registration import (
    LaserMount,
    refine,
)
from pipeline.mount import Mounted
from pipeline.target.mount_search import FoundMount
from pipeline.target.pose_search import WIDE_M, FoundTarget, gate_of, planes_of

Array = NDArray[np.float64]
FARTHEST = 3.0  # sigmas of what is searched, within which a laser's mount is taken


def find_laser(
    sample: "LaserPoses",
    target: FoundTarget,
    model: TargetModel,
    coarse: Mounted,
    settings: Segment,
) -> tuple[FoundTarget, "FoundMount"]:
    """Where the target stands and how the laser is turned, from the pose found with the coarse mount.

    Its lever arm stays: a laser mounted 3 cm too far starboard and a target 3 cm nearer look alike.
    """
    angle = np.radians(settings.search_laser_deg)
    sigmas = np.r_[target.pose_sigmas, [angle] * 3]
    body = sample.points_laser_m @ coarse.R_body_from_sensor.T
    start = np.r_[target.pose.parameters, np.zeros(3)]
    placement = LaserMount(sample.positions_m, sample.R_pool_from_body, body, coarse.lever_arm_body_m, sigmas)
    normals, distances = planes_of(model)

    def label(_: Array, points: Array) -> NDArray[np.int16]:
        above = points[:, 2] > model.water_level_m + settings.water_margin_m
        labels = label_points(model, points, Beams.head_on(len(points)), WIDE_M, settings.margin_m, 0.0, seen="dry")
        return np.where(above, labels.face, -1).astype(np.int16)

    refined = refine(placement, start, label, normals, distances)
    pose = replace(refined, parameters=refined.parameters[:4], covariance=refined.covariance[:4, :4])
    found = replace(
        target,
        R_target_from_pool=rotation_z(pose.parameters[0]),
        origin_pool_m=pose.parameters[1:],
        azimuth_correction_rad=float(pose.parameters[0]),
        pose=pose,
        tilt=replace(target.tilt, parameters=np.zeros(6)),  # it was the laser's
        gate_m=gate_of(refined, settings),
    )
    off = refined.parameters[4:]
    score = refined.count / max(1, len(body))
    within = bool(np.all(np.abs(off) <= FARTHEST * angle))
    return found, FoundMount(off, np.zeros(3), refined.scale_m, found.gate_m, score, 0.0, False, within)


@dataclass(frozen=True)
class LaserPoses:
    """Laser points with their poses in the pool frame: positions (n, 3), R (n, 3, 3); points_laser_m (n, 3)."""

    positions_m: Array
    R_pool_from_body: Array
    points_laser_m: Array
