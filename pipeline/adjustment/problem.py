"""The calibration problem: observation model, prior information and consider errors.

This module makes the sonar's problem; :mod:`pipeline.adjustment.laser_design` makes the laser's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import ObservationModel
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes
from pipeline.artefacts.streams import Mapper, serial
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.design_matrix import SensorSigmas
from pipeline.maths.adjustment.drift_likelihood import EXACT, DriftPrior
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import FurtherHead, State
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.adjustment.pseudo_observations import ParallelPrior, ParameterPrior, Prior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.target.face import Face
from pipeline.maths.target.model import TargetModel
from pipeline.mount import Mounted

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NO_HEADS: Mapping[str, Mounted] = MappingProxyType({})
LEAST_PARALLEL_RAD = 1e-7  # smallest sigma of the angle between parallel families


class PointNoise(Protocol):
    """Settings of a sensor: standard deviations of its range and of its angle."""

    @property
    def range_sigma_m(self) -> float:
        """Standard deviation of a range, m."""
        ...

    @property
    def angle_sigma_deg(self) -> float:
        """Standard deviation of an angle, degrees."""
        ...


class SurveyedFaces(Protocol):
    """The target as surveyed: deviations of faces from the design, and how parallel its families are."""

    @property
    def faces(self) -> Mapping[str, float]:
        """Deviation of a face from the design, m outward, by its name."""
        ...

    @property
    def angle_sigma_deg(self) -> float:
        """Standard deviation of the angle between two parallel families."""
        ...


@dataclass(frozen=True)
class PriorInformation:
    """Prior information.

    noise: white noise and drift of the recorded poses; surfaces: pseudo-observations of the surfaces; drift: how well
    the figures of the drift in ``noise`` are known; parameters: the values known beforehand of parameters that are
    estimated; from_start: whether these are estimated from the first step on, because they may be so large that the
    weights must not be found without them; otherwise with the last weights.
    """

    noise: PoseNoise
    surfaces: Prior | None = None
    drift: DriftPrior = EXACT
    parameters: ParameterPrior | None = None
    from_start: bool = False

    @property
    def priors(self) -> tuple[Prior, ...]:
        """All pseudo-observations."""
        return tuple(prior for prior in (self.surfaces, self.parameters) if prior is not None)

    def of_mount(self, state: State) -> bool:
        """Return whether the mount itself is known beforehand: then it is near, and has no other side."""
        return bool(np.isin(self.known_parameters, state.mounts).any())

    @property
    def known_parameters(self) -> Integers:
        """Numbers (k,) of the parameters whose values are known beforehand."""
        return np.empty(0, dtype=np.int64) if self.parameters is None else self.parameters.numbers


@dataclass(frozen=True)
class CalibrationProblem:
    """A calibration to be solved.

    model: turns points into observations, and its coarse state names the calibrated sensor; prior: prior information;
    consider: a-priori errors of the fixed parameters; mapper: spreads the elimination of the records' noise.
    """

    model: ObservationModel
    prior: PriorInformation
    consider: ConsiderErrors
    mapper: Mapper = serial


@dataclass(frozen=True)
class SessionData:
    """Data of a session, as the functional model and the prior information need them.

    target: the design; surfaces: the surface of each family, at which the adjustment starts; trajectory: recorded
    poses, target frame; laser_lever_arm_m (3,), body axes; noise: errors of the poses; drift: how well the
    figures of their drift are known; as_built: the target as surveyed; mapper: of the problem.
    """

    target: TargetModel
    surfaces: Sequence[ObservedSurface]
    trajectory: Trajectory
    laser_lever_arm_m: Array
    noise: PoseNoise
    drift: DriftPrior
    as_built: SurveyedFaces
    mapper: Mapper = serial


def sonar_problem(
    session: SessionData, mount: Mounted, noise: Mapping[str, PointNoise], further: Mapping[str, Mounted] = NO_HEADS
) -> CalibrationProblem:
    """Return the problem of calibrating the sonar against the surfaces that the laser sees from the same body.

    No fixed parameter has an error yet (:func:`pipeline.adjustment.consider.sonar_errors` returns these errors).

    Parameters
    ----------
    session : SessionData
        Poses, target and surfaces.
    mount : Mounted
        The sonar's mount, at which the adjustment starts; of several heads that of the first.
    noise : mapping of PointNoise
        Settings of the laser and of all heads.
    further : mapping of Mounted
        The mounts of the other heads, by name.
    """
    others = [FurtherHead(name, at.R_body_from_sensor, at.lever_arm_body_m) for name, at in further.items()]
    state = State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, session.surfaces, "mbes", others)
    parallel = _parallel_families(session.target, session.as_built)
    prior = PriorInformation(session.noise, parallel, drift=session.drift)
    return problem_at(session, state, prior, noise)


def problem_at(
    session: SessionData, state: State, prior: PriorInformation, noise: Mapping[str, PointNoise]
) -> CalibrationProblem:
    """Return the problem that starts from a state, with certain fixed parameters.

    Parameters
    ----------
    session : SessionData
        Poses and target. A face's height above its surface is the designed height plus the deviation as built.
    state : State
        The state from which the adjustment starts.
    prior : PriorInformation
        Prior information.
    noise : mapping of PointNoise
        Settings of each sensor that observes.
    """
    faces, as_built = session.target.faces, session.as_built.faces
    model = ObservationModel(
        body=BodyMotion.of(session.trajectory, session.laser_lever_arm_m),
        faces=faces_on_surfaces(faces, state),
        height_of_face=np.array([face.offset_m + face.sense * as_built.get(face.name, 0.0) for face in faces]),
        coarse=state,
        sigmas={sensor: sensor_sigmas(settings) for sensor, settings in noise.items()},
        wet_heights_m=session.target.wet_heights_m,
    )
    return CalibrationProblem(model, prior, ConsiderErrors(np.zeros(state.size)), session.mapper)


def faces_on_surfaces(faces: Sequence[Face], state: State) -> Faces:
    """Return for each face the number of its family's surface, and whether both look the same way."""
    number = {surface.family: k for k, surface in enumerate(state.surfaces)}
    return Faces(
        names=tuple(face.name for face in faces),
        surface=np.array([number[face.family] for face in faces]),
        sense=np.array([face.sense for face in faces]),
    )


def surfaces_of_laser(target: TargetModel, planes: pd.DataFrame) -> tuple[ObservedSurface, ...]:
    """Return the surface of each family from the laser's planes.

    A family is as designed if it is horizontal, lies in several planes, or has no plane of the laser. The centre of a
    surface, about which its wet part turns, is the designed one, brought onto the laser's plane.

    Parameters
    ----------
    target : TargetModel
        The design.
    planes : DataFrame
        Table planes.
    """
    found = laser_planes(planes)
    measured = {
        family.name: found[ALL_PASSES, family.name]
        for family in target.families
        if family.one_plane and not family.level and (ALL_PASSES, family.name) in found
    }
    surfaces = []
    for surface in designed_surfaces(target):
        plane = measured.get(surface.family)
        if plane is not None:
            off_m = plane.normal @ (surface.centre_m - plane.centroid_m)
            surface = ObservedSurface.at(surface.family, plane.normal, surface.centre_m - off_m * plane.normal)
        surfaces.append(surface)
    return tuple(surfaces)


def sensor_sigmas(sensor: PointNoise) -> SensorSigmas:
    """Return the standard deviations of a sensor's range and angle."""
    return SensorSigmas(sensor.range_sigma_m, float(np.radians(sensor.angle_sigma_deg)))


def designed_surfaces(target: TargetModel) -> tuple[ObservedSurface, ...]:
    """Return the surface of each family as designed."""
    return tuple(ObservedSurface.at(family, *plane) for family, plane in designed_planes(target).items())


def designed_planes(target: TargetModel) -> dict[str, tuple[Array, Array]]:
    """Return for each family the normal (3,) of its plane, and a point (3,) m of the plane amid its faces."""
    planes = {}
    for family in target.families:
        corners = [target.faces[k].vertices_m - target.faces[k].offset_m * family.normal for k in family.faces]
        planes[family.name] = family.normal, np.concatenate(corners).mean(axis=0)
    return planes


def _parallel_families(target: TargetModel, as_built: SurveyedFaces) -> ParallelPrior | None:
    """Return the prior information that families are parallel, by the sigma of the angle as built; None if none are."""
    if not target.parallel:
        return None
    return ParallelPrior(target.parallel, max(float(np.radians(as_built.angle_sigma_deg)), LEAST_PARALLEL_RAD))
