"""The laser's provisional mount and the pose of the target, both estimated from the laser's points.

A calibration of the laser uses this module.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.maths.target.placements import LaserMount
from pipeline.maths.target.registration import refine
from pipeline.mount import Mounted
from pipeline.target.matching import dry_labeller, gate_of, planes_of_faces
from pipeline.target.samples import LaserPoses
from pipeline.target.search_results import LocatedTarget, ProvisionalMount

Array = NDArray[np.float64]
LARGEST_TURN = 3.0  # largest turn of the laser about each axis, as a multiple of segment.search_laser_deg


def refine_target_and_laser(
    sample: LaserPoses, target: LocatedTarget, model: TargetModel, coarse: Mounted, settings: Segment
) -> tuple[LocatedTarget, ProvisionalMount]:
    """Return the pose of the target and the laser's provisional mount, starting from the pose with the coarse mount.

    The mount's rotation is estimated. Its lever arm stays, because a laser 3 cm farther to starboard and a target 3 cm
    nearer would give the same points.

    Parameters
    ----------
    sample
        Laser points with their poses.
    target
        The target, located with the coarse mount.
    model
        The target by design.
    coarse
        Coarse mount of the laser.
    settings
        Settings of stage segment.
    """
    angle = np.radians(settings.search_laser_deg)
    sigmas = np.r_[target.pose_sigmas, [angle] * 3]
    placement = LaserMount(
        positions_m=sample.positions_m,
        R_pool_from_body=sample.R_pool_from_body,
        points_body_m=sample.points_laser_m @ coarse.R_body_from_sensor.T,
        lever_arm_m=coarse.lever_arm_body_m,
        prior_sigmas=sigmas,
    )
    start = np.r_[target.pose.parameters, np.zeros(3)]
    refined = refine(placement, start, dry_labeller(model, settings), planes_of_faces(model))
    pose = replace(refined, parameters=refined.parameters[:4], covariance=refined.covariance[:4, :4])
    located = replace(
        target,
        frame=TargetFrame(rotation_z(pose.parameters[0]), pose.parameters[1:]),
        azimuth_correction_rad=float(pose.parameters[0]),
        pose=pose,
        tilt=replace(target.tilt, parameters=np.zeros(6)),  # the tilt was that of the laser's coarse mount
        gate_m=gate_of(refined, settings),
    )
    turn_rad = refined.parameters[4:]
    mount = ProvisionalMount(
        rotation_vector_rad=turn_rad,
        lever_arm_correction_m=np.zeros(3),
        scale_m=refined.scale_m,
        gate_m=located.gate_m,
        score=refined.count / max(1, len(sample.points_laser_m)),
        rival_score=0.0,
        ambiguous=False,
        within=bool(np.all(np.abs(turn_rad) <= LARGEST_TURN * angle)),
    )
    return located, mount
