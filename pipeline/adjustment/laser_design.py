"""The calibration of the laser: its points lie on the target's planes, as designed and, if known, as surveyed.

The coarse mount enters as an observation with its covariance (:class:`ParameterPrior`).
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.consider import laser_errors
from pipeline.adjustment.problem import (
    CalibrationProblem,
    PointNoise,
    PriorInformation,
    SessionData,
    designed_planes,
    problem_at,
)
from pipeline.config.mount import Covariance, Mount, MountOrigin
from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser
from pipeline.config.stage_settings import LaserPrior
from pipeline.maths.adjustment.drift_likelihood import DriftPrior
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pseudo_observations import DesignPrior, ParameterPrior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.mount_parameters import N_MOUNT, PARAMETERS
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.mount import Mounted, mount_of

Array = NDArray[np.float64]
LEAST = np.repeat([1e-8, 1e-7], 3)  # rad and m: sigmas that even an exact coarse mount has


class CoarseLaser(PointNoise, Protocol):
    """Settings of a laser that is calibrated: its noise, and what is known of its coarse mount."""

    @property
    def mount(self) -> Mount:
        """The mount."""
        ...

    @property
    def mount_covariance(self) -> Covariance | None:
        """Covariance of the mount."""
        ...

    @property
    def mount_origin(self) -> MountOrigin | None:
        """Source of the mount."""
        ...


def laser_problem(
    session: SessionData, mount: Mounted, laser: CoarseLaser, settings: LaserPrior, set_up: Array
) -> CalibrationProblem:
    """Return the problem of calibrating the laser against the target's design. No fixed parameter has an error yet.

    The coarse mount is an observation of all six mount parameters, so that each is estimated, and has the sigma that
    it and the points give together. Of the drift's figures only the sigmas follow the points, and only upwards, where
    that is certain (:mod:`~pipeline.maths.adjustment.drift_likelihood` tells why).

    Parameters
    ----------
    session : SessionData
        Poses, target and surfaces.
    mount : Mounted
        The laser's mount, at which the adjustment starts.
    laser : CoarseLaser
        The session's laser.
    settings : LaserPrior
        Sigmas of the target and of the coarse mount.
    set_up : (6,) array
        The surveyed displacement of the target, from :func:`surveyed_displacement`.
    """
    state = State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, session.surfaces, "laser")
    coarse, covariance = coarse_mount(laser, settings)
    known = State.at(coarse.R_body_from_sensor, coarse.lever_arm_body_m, session.surfaces, "laser")
    prior = PriorInformation(
        noise=session.noise,
        surfaces=design_prior(session.target, set_up, settings),
        drift=DriftPrior(session.drift.sigma, 0.0, only_larger=True),
        parameters=ParameterPrior(np.arange(N_MOUNT), covariance, known),
    )
    return problem_at(session, state, prior, {"laser": laser})


def laser_consider(names: Sequence[str], laser: Laser, coarse: Array, as_built: AsBuilt) -> ConsiderErrors:
    """Return the a-priori errors for a calibration of the laser; its mount has those of the coarse mount.

    Parameters
    ----------
    names : sequence of str
        Names of all parameters.
    laser : Laser
        The session's laser.
    coarse : (6, 6) array
        Covariance of the coarse mount.
    as_built : AsBuilt
        Sigmas of the wet faces against the dry ones.
    """
    errors = laser_errors(names, laser, as_built)
    return ConsiderErrors(np.concatenate([np.sqrt(np.diag(coarse)), errors.sigmas[N_MOUNT:]]))


def surveyed_displacement(frame: TargetFrame, azimuth_correction_rad: float) -> Array:
    """Return the displacement (6,) m and rad of the surveyed place from the one that the laser's points gave.

    Parameters
    ----------
    frame : TargetFrame
        Pose of the target in the pool frame.
    azimuth_correction_rad : float
        Azimuth of the target minus the surveyed one, clockwise.
    """
    return np.array([*frame.shift_m, 0.0, 0.0, azimuth_correction_rad])


def design_prior(target: TargetModel, set_up: Array, settings: LaserPrior) -> DesignPrior:
    """Return the prior information about the target, in its frame: the design, and the surveyed place if it is known.

    Parameters
    ----------
    target : TargetModel
        The design.
    set_up : (6,) array
        The surveyed displacement of the target.
    settings : LaserPrior
        Sigmas of the target's faces and of the survey.
    """
    place = settings.origin_sigma_m
    heading, plumb = settings.azimuth_sigma_deg, np.radians(settings.plumb_sigma_deg)
    heading_rad = np.inf if heading is None else np.radians(heading)
    return DesignPrior(
        planes=designed_planes(target),
        turn_rad=float(np.radians(settings.face_sigma_deg)),
        shift_m=settings.face_sigma_m,
        set_up=set_up,
        set_up_sigma=np.array([np.inf if place is None else place] * 3 + [plumb, plumb, heading_rad]),
    )


def coarse_mount(laser: CoarseLaser, settings: LaserPrior) -> tuple[Mounted, Array]:
    """Return the coarse mount and its covariance (6, 6), rad and m: the session's, or by sigmas of the pool's config.

    A mount from an earlier calibration of the laser is no coarse mount: with the same passes, its information would
    count twice. Its source names the coarse mount from which that calibration started. Where an older version did not
    write this, the covariance counts only for the parameters that it fixed at the coarse mount; the others have the
    sigmas of the pool's config.
    """
    sigma = np.repeat([np.radians(settings.coarse_sigma_deg), settings.coarse_sigma_m], 3)
    covariance, origin, mount, stated = np.diag(sigma**2), laser.mount_origin, laser.mount, laser.mount_covariance
    if origin is not None and origin.coarse is not None:
        mount, stated = origin.coarse.mount, origin.coarse.covariance
    if stated is not None:
        surveyed, kept = np.array(stated), list(range(N_MOUNT))
        if origin is not None and origin.method == "fine" and origin.coarse is None:
            kept = [place for name, place, *_ in PARAMETERS if name in origin.held]
        covariance[np.ix_(kept, kept)] = surveyed[np.ix_(kept, kept)]
    return mount_of(mount), covariance + np.diag(LEAST**2)
