"""The calibration of the laser: its points lie on the target's planes, as designed and, if known, as surveyed."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import pandas as pd
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
from pipeline.config.mount import Covariance, MountOrigin
from pipeline.config.pool import AsBuilt, LaserFit
from pipeline.config.session import Laser
from pipeline.config.stage_settings import LaserCalibration
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pseudo_observations import DesignPrior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.mount_parameters import N_MOUNT, PARAMETERS
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.mount import Mounted

Array = NDArray[np.float64]


class CoarseLaser(PointNoise, Protocol):
    """Settings of a laser that is calibrated: its noise, and what is known of its coarse mount."""

    @property
    def mount_covariance(self) -> Covariance | None:
        """Covariance of the mount."""
        ...

    @property
    def mount_origin(self) -> MountOrigin | None:
        """Source of the mount."""
        ...


def laser_problem(
    session: SessionData, mount: Mounted, laser: CoarseLaser, calibration: LaserCalibration, set_up: Array
) -> CalibrationProblem:
    """Return the problem of calibrating the laser against the target's design. No fixed parameter has an error yet.

    Parameters
    ----------
    session : SessionData
        Poses, target and surfaces.
    mount : Mounted
        The laser's mount, at which the adjustment starts.
    laser : CoarseLaser
        The session's laser.
    calibration : LaserCalibration
        Sigmas of the target and of the coarse mount.
    set_up : (6,) array
        The surveyed displacement of the target, from :func:`surveyed_displacement`.
    """
    state = State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, session.surfaces, "laser")
    required = required_sigmas(coarse_covariance(laser, calibration), calibration)
    # the figures of the drift stay as given: corrected by likelihood they made the sigmas of pitch and roll too small
    prior = PriorInformation(session.noise, design_prior(session.target, set_up, calibration), required)
    return problem_at(session, state, prior, {"laser": laser})


def laser_consider(
    names: Sequence[str], laser: Laser, calibration: LaserCalibration, as_built: AsBuilt
) -> ConsiderErrors:
    """Return the a-priori errors for a calibration of the laser. A fixed mount parameter has the coarse mount's error.

    Parameters
    ----------
    names : sequence of str
        Names of all parameters.
    laser : Laser
        The session's laser.
    calibration : LaserCalibration
        Sigmas of the coarse mount.
    as_built : AsBuilt
        Sigmas of the wet faces against the dry ones.
    """
    coarse, errors = coarse_covariance(laser, calibration), laser_errors(names, laser, as_built)
    sigmas = np.concatenate([np.sqrt(np.diag(coarse)), errors.sigmas[N_MOUNT:]])
    return ConsiderErrors(sigmas, [(np.arange(N_MOUNT), coarse)])


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


def design_prior(target: TargetModel, set_up: Array, settings: LaserFit) -> DesignPrior:
    """Return the prior information about the target, in its frame: the design, and the surveyed place if it is known.

    Parameters
    ----------
    target : TargetModel
        The design.
    set_up : (6,) array
        The surveyed displacement of the target.
    settings : LaserFit
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


def coarse_covariance(laser: CoarseLaser, settings: LaserFit) -> Array:
    """Return the covariance (6, 6) of the coarse mount, rad and m: the session's, or by sigmas of the pool's config.

    After an earlier calibration of the laser, the session's covariance counts only for the parameters that this
    calibration fixed. The others are to be estimated anew, so they have the sigmas of the pool's config.
    """
    sigma = np.repeat([np.radians(settings.coarse_sigma_deg), settings.coarse_sigma_m], 3)
    configured = np.diag(sigma**2)
    if laser.mount_covariance is None:
        return configured
    surveyed, origin = np.array(laser.mount_covariance), laser.mount_origin
    if origin is None or origin.method == "coarse":
        return surveyed
    kept = [place for name, place, *_ in PARAMETERS if name in origin.held]
    configured[np.ix_(kept, kept)] = surveyed[np.ix_(kept, kept)]
    return configured


def required_sigmas(coarse: Array, settings: LaserCalibration) -> Array:
    """Return the largest sigmas (6,), rad and m, with which mount parameters are estimated, not fixed.

    They are the verdict's limits, or a share of the sigmas of the coarse mount, covariance (6, 6), if that is less.
    """
    limits = np.repeat([np.radians(settings.max_sigma_deg), settings.max_sigma_m], 3)
    return np.asarray(np.minimum(limits, settings.hold_share * np.sqrt(np.diag(coarse))))


def fixed_parameters_table(fixed: Mapping[int, float]) -> pd.DataFrame:
    """Return table ``geometry``: the fixed mount parameters, each with the sigma that it would have had."""
    rows = [
        ("held", name, float(np.degrees(fixed[place])) if unit == "deg" else fixed[place])
        for name, place, _, unit in PARAMETERS
        if place in fixed
    ]
    return pd.DataFrame(rows, columns=["kind", "words", "sigma"])
