"""The calibration of the laser: its points lie on the target's planes, as designed and, if known, as surveyed."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.consider import laser_errors
from pipeline.adjustment.ins_drift import drift_prior, pose_noise
from pipeline.adjustment.problem import (
    CalibrationProblem,
    PriorInformation,
    SessionData,
    mount_state,
    observation_model,
    sensor_sigmas,
)
from pipeline.artefacts.from_tables import target_frame
from pipeline.config.pool import LaserFit
from pipeline.config.session import Laser
from pipeline.config.stage_settings import LaserCalibration
from pipeline.maths.adjustment.pseudo_observations import DesignPrior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.mount_parameters import N_MOUNT, PARAMETERS
from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]


def laser_problem(session: SessionData, calibration: LaserCalibration) -> CalibrationProblem:
    """Return the problem of calibrating the laser against the target's design."""
    model = observation_model(
        session, mount_state(session, session.laser, "laser"), {"laser": sensor_sigmas(session.laser)}
    )
    coarse = coarse_covariance(session.laser, calibration)
    design = design_prior(session.target, session.target_pose, calibration)
    required = required_sigmas(coarse, calibration)
    prior = PriorInformation(pose_noise(session.ins), design, required, drift_prior(session.ins))
    # a fixed mount parameter has the error of the coarse mount
    errors = laser_errors(model.coarse.names, session.laser, session.as_built)
    sigmas = np.concatenate([np.sqrt(np.diag(coarse)), errors.sigmas[N_MOUNT:]])
    return CalibrationProblem(model, prior, ConsiderErrors(sigmas, [(np.arange(N_MOUNT), coarse)]))


def design_prior(target: TargetModel, target_pose: pd.DataFrame, settings: LaserFit) -> DesignPrior:
    """Return the prior information about the target, in its frame: the design, and the surveyed place if it is known.

    Parameters
    ----------
    target : TargetModel
        The design.
    target_pose : DataFrame
        Table target_pose: the pose of the target, relative to its configured place.
    settings : LaserFit
        Sigmas of the target's faces and of the survey.
    """
    planes = {}
    for family in target.families:
        corners = [target.faces[k].vertices_m - target.faces[k].offset_m * family.normal for k in family.faces]
        planes[family.name] = family.normal, np.concatenate(corners).mean(axis=0)
    pose = target_pose.iloc[0]
    turned = np.radians(float(pose["azimuth_correction_deg"]))
    place = settings.origin_sigma_m
    heading, plumb = settings.azimuth_sigma_deg, np.radians(settings.plumb_sigma_deg)
    heading_rad = np.inf if heading is None else np.radians(heading)
    return DesignPrior(
        planes=planes,
        turn_rad=float(np.radians(settings.face_sigma_deg)),
        shift_m=settings.face_sigma_m,
        set_up=np.r_[target_frame(target_pose).shift_m, 0.0, 0.0, turned],
        set_up_sigma=np.array([np.inf if place is None else place] * 3 + [plumb, plumb, heading_rad]),
    )


def coarse_covariance(laser: Laser, settings: LaserFit) -> Array:
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
