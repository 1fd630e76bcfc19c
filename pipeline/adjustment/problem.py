"""The calibration problem: observation model, prior information and consider errors.

This module makes the sonar's problem; :mod:`pipeline.adjustment.laser_design` makes the laser's.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.consider import sonar_errors
from pipeline.adjustment.ins_drift import drift_prior, pose_noise
from pipeline.adjustment.observation_model import ObservationModel
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes, trajectory_in_target
from pipeline.config.pool import AsBuilt
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.maths.adjustment.design_matrix import SensorSigmas
from pipeline.maths.adjustment.drift_likelihood import EXACT, DriftPrior
from pipeline.maths.adjustment.normal_equations import BodyMotion
from pipeline.maths.adjustment.parameters import ObservedSurface, Sensor, State
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.adjustment.pseudo_observations import ParallelPrior, SurfacePrior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.target.model import Family, TargetModel
from pipeline.mount import mount_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
LEAST_PARALLEL_RAD = 1e-7  # smallest sigma of the angle between parallel families


@dataclass(frozen=True)
class PriorInformation:
    """Prior information.

    noise: white noise and drift of the recorded poses; surfaces: pseudo-observations of the surfaces; required_sigmas
    (6,) rad and m: a mount parameter that would have a larger sigma is fixed (None: all are estimated); drift: how well
    the figures of the drift in ``noise`` are known.
    """

    noise: PoseNoise
    surfaces: SurfacePrior | None = None
    required_sigmas: Array | None = None
    drift: DriftPrior = EXACT


@dataclass(frozen=True)
class CalibrationProblem:
    """A calibration to be solved.

    model: turns points into observations, and its coarse state names the calibrated sensor; prior: prior information;
    consider: a-priori errors of the fixed parameters.
    """

    model: ObservationModel
    prior: PriorInformation
    consider: ConsiderErrors


@dataclass(frozen=True)
class SessionData:
    """Data of a session: the target's design and survey, three tables of earlier stages, and the instruments.

    ``ins`` has the drift model for the adjustment.
    """

    target: TargetModel
    poses: pd.DataFrame
    target_pose: pd.DataFrame
    planes: pd.DataFrame
    ins: Ins
    laser: Laser
    as_built: AsBuilt


def sonar_problem(session: SessionData, mbes: Mbes) -> CalibrationProblem:
    """Return the problem of calibrating the sonar against the surfaces that the laser sees from the same body."""
    sigmas = {"laser": sensor_sigmas(session.laser), "mbes": sensor_sigmas(mbes)}
    model = observation_model(session, mount_state(session, mbes, "mbes"), sigmas)
    target, names = session.target, model.coarse.names
    return CalibrationProblem(
        model,
        PriorInformation(
            pose_noise(session.ins), _parallel_families(target, session.as_built), drift=drift_prior(session.ins)
        ),
        sonar_errors(names, session.laser, mbes, session.as_built, target.depth_m),
    )


def mount_state(session: SessionData, sensor: Laser | Mbes, calibrated: Sensor) -> State:
    """Return the state from which the adjustment starts: the sensor's coarse mount, the laser's planes.

    A family starts as designed if it is horizontal, lies in several planes, or has no plane of the laser.

    Parameters
    ----------
    session : SessionData
        The target and the laser's planes.
    sensor : Laser or Mbes
        Settings of the sensor that is calibrated.
    calibrated : {"mbes", "laser"}
        Name of this sensor.
    """
    planes, surfaces = laser_planes(session.planes), []
    for family in session.target.families:
        plane = planes.get((ALL_PASSES, family.name)) if family.one_plane and not family.level else None
        if plane is not None:
            surfaces.append(ObservedSurface.at(family.name, plane.normal, plane.centroid_m, 0.0))
        else:
            surfaces.append(design_surface(session.target, family))
    mount = mount_of(sensor.mount)
    return State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, surfaces, calibrated)


def observation_model(session: SessionData, state: State, sigmas: Mapping[str, SensorSigmas]) -> ObservationModel:
    """Return the observation model of a session.

    Parameters
    ----------
    session : SessionData
        Poses, target and instruments. A face's height above its surface is the designed height plus the deviation as
        built.
    state : State
        The state from which the adjustment starts.
    sigmas : mapping of SensorSigmas
        Standard deviations of each sensor that observes.
    """
    number = {surface.family: k for k, surface in enumerate(state.surfaces)}
    faces, as_built = session.target.faces, session.as_built.faces
    trajectory = trajectory_in_target(session.poses, session.target_pose)
    return ObservationModel(
        body=BodyMotion.of(trajectory, mount_of(session.laser.mount).lever_arm_body_m),
        surface_of_face=np.array([number[face.family] for face in faces]),
        height_of_face=np.array([face.offset_m + face.sense * as_built.get(face.name, 0.0) for face in faces]),
        coarse=state,
        white_m=session.ins.white.position_m,
        sigmas=sigmas,
    )


def sensor_sigmas(sensor: Laser | Mbes) -> SensorSigmas:
    """Return the standard deviations of a sensor's range and angle."""
    return SensorSigmas(sensor.range_sigma_m, float(np.radians(sensor.angle_sigma_deg)))


def design_surface(target: TargetModel, family: Family) -> ObservedSurface:
    """Return the family's plane as designed. Its centre is the mean of all corners, projected onto the plane."""
    corners_m = np.concatenate([target.faces[number].vertices_m for number in family.faces])
    centre = corners_m.mean(axis=0)
    on_plane = centre - (centre @ family.normal - family.distance_m) * family.normal
    return ObservedSurface.at(family.name, family.normal, on_plane)


def _parallel_families(target: TargetModel, as_built: AsBuilt) -> ParallelPrior | None:
    """Return the prior information that families are parallel, by the sigma of the angle as built; None if none are."""
    if not target.parallel:
        return None
    return ParallelPrior(target.parallel, max(float(np.radians(as_built.angle_sigma_deg)), LEAST_PARALLEL_RAD))
