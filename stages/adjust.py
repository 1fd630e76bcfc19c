"""The rigorous solution: one least-squares adjustment of all points on the target, with the parameters' covariance.

The sonar is calibrated against the surfaces that the laser measures, or the laser against the target's design.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.adjustment.consider import known_parameters, sonar_errors
from pipeline.adjustment.further_heads import in_passes
from pipeline.adjustment.ins_drift import drift_model, drift_prior, pose_noise
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.laser_design import laser_consider, laser_problem, surveyed_displacement
from pipeline.adjustment.parts import parts_table
from pipeline.adjustment.problem import CalibrationProblem, SessionData, sonar_problem, surfaces_of_laser
from pipeline.adjustment.residual_statistics import ResidualStatistics, residual_statistics
from pipeline.adjustment.residual_tables import bins_table, map_table
from pipeline.adjustment.result_tables import result_tables
from pipeline.adjustment.wet_errors import outward_of, wet_faces_uncertain
from pipeline.adjustment.wet_planes import FaceLimits, adjust_true_faces
from pipeline.artefacts.catalogue.points import FILES, INS_SIGMAS, PASSES, POSES
from pipeline.artefacts.catalogue.results import (
    ADJUST_SUMMARY,
    CELLS,
    COVARIANCE,
    DRIFT,
    DRIFT_FIGURES,
    ESTIMATE,
    FREED,
    GEOMETRY,
    GROUPS,
    HEAD_EFFECTS,
    LEFT_OUT,
    PARTS,
    PATTERNS,
    RESIDUAL_BINS,
    RESIDUAL_MAP,
    RESIDUALS,
    SETS,
    SURFACES,
)
from pipeline.artefacts.catalogue.target import (
    FACES,
    LASER_LABELLED,
    PLANES,
    PROVISIONAL_MOUNT,
    SOUNDINGS_LABELLED,
    TARGET_POSE,
)
from pipeline.artefacts.from_tables import target_frame, trajectory_in_target
from pipeline.artefacts.schema import OfFurtherHeads
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust, AsBuilt, Ingest, Segment
from pipeline.config.session import Drift, Ins, Laser, Mbes
from pipeline.config.stage_settings import LaserPrior
from pipeline.config.target import Target
from pipeline.mount import mount_of
from pipeline.planning.session_geometry import geometry_table, sailed_plan
from pipeline.planning.setting import PredictionSetting
from pipeline.target.design import target_of
from pipeline.target.mount_search import farthest_correction


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses; ``mbes`` is None if the laser is calibrated, ``laser_fit`` if the sonar is."""

    target: Target
    segment: Segment
    adjust: Adjust
    ingest: Ingest
    as_built: AsBuilt
    ins: Ins
    laser: Laser
    mbes: Mbes | None
    further_heads: dict[str, Mbes]  # of the sonar, by name
    laser_fit: LaserPrior | None


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads; ``soundings_labelled`` is empty if the laser is calibrated."""

    files: Annotated[pd.DataFrame, FILES]
    passes: Annotated[pd.DataFrame, PASSES]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    faces: Annotated[pd.DataFrame, FACES]
    poses: Annotated[pd.DataFrame, POSES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    provisional_mount: Annotated[pd.DataFrame, PROVISIONAL_MOUNT]
    planes: Annotated[pd.DataFrame, PLANES]
    laser_labelled: Annotated[Stream, LASER_LABELLED]
    soundings_labelled: Annotated[Stream, SOUNDINGS_LABELLED]
    of_further_heads: Annotated[Mapping[str, Stream], OfFurtherHeads(SOUNDINGS_LABELLED)]
    mounts_of_further_heads: Annotated[Mapping[str, pd.DataFrame], OfFurtherHeads(PROVISIONAL_MOUNT)]


@dataclass(frozen=True)
class Outputs:
    """Tables that the stage writes."""

    estimate: Annotated[pd.DataFrame, ESTIMATE]
    covariance: Annotated[pd.DataFrame, COVARIANCE]
    geometry: Annotated[pd.DataFrame, GEOMETRY]
    surfaces: Annotated[pd.DataFrame, SURFACES]
    drift: Annotated[pd.DataFrame, DRIFT]
    drift_figures: Annotated[pd.DataFrame, DRIFT_FIGURES]
    freed: Annotated[pd.DataFrame, FREED]
    sets: Annotated[pd.DataFrame, SETS]
    groups: Annotated[pd.DataFrame, GROUPS]
    cells: Annotated[pd.DataFrame, CELLS]
    summary: Annotated[pd.DataFrame, ADJUST_SUMMARY]
    left_out: Annotated[pd.DataFrame, LEFT_OUT]
    parts: Annotated[pd.DataFrame, PARTS]
    patterns: Annotated[pd.DataFrame, PATTERNS]
    residuals: Annotated[pd.DataFrame, RESIDUALS]
    residual_bins: Annotated[pd.DataFrame, RESIDUAL_BINS]
    residual_map: Annotated[pd.DataFrame, RESIDUAL_MAP]
    head_effects: Annotated[pd.DataFrame | None, HEAD_EFFECTS] = None  # of a sonar with several heads


def run(inputs: Inputs, config: Config) -> Outputs:
    """Adjust the mount of the sensor that is calibrated, or of all heads of the sonar."""
    # Set up the problem of the sensor that is calibrated.
    drift = drift_model(config.ins, inputs.ins_sigmas, inputs.passes)
    problem = calibration_problem(session_data(inputs, config, drift), inputs, config)

    # Adjust the mount to all labelled points of the sensors that take part.
    labelled = {"laser": inputs.laser_labelled, "mbes": inputs.soundings_labelled}
    labelled |= in_passes(inputs.of_further_heads, inputs.passes)
    points = {sensor: labelled[sensor] for sensor in problem.model.sigmas}
    found = {"mbes": inputs.provisional_mount, **inputs.mounts_of_further_heads}
    gates_m = {head: float(mount["gate_m"].iloc[0]) for head, mount in found.items() if head in points}
    limits = FaceLimits(gates_m, farthest_correction(config.segment))
    gap_s = config.ingest.max_gap_s
    adjustment, points, left_out = adjust_true_faces(problem, points, inputs.passes, config.adjust, gap_s, limits)

    # Compute the residuals of all points at the adjusted values, and make the tables.
    statistics = residual_statistics(problem, adjustment, points, inputs.passes, config.adjust)
    return Outputs(
        **result_tables(problem, adjustment, statistics, inputs.passes, config.adjust.test_level),
        geometry=weak_geometry(inputs, config, drift, adjustment, statistics),
        left_out=left_out,
        parts=parts_table(problem, adjustment, inputs.passes),
        patterns=statistics.patterns,
        residuals=statistics.residuals,
        residual_bins=bins_table(statistics.residuals, inputs.faces),
        residual_map=map_table(statistics.residuals, inputs.faces),
    )


def session_data(inputs: Inputs, config: Config, drift: Drift) -> SessionData:
    """Return the target, its surfaces as the laser sees them, the poses, and their errors with this drift."""
    target = target_of(config.target)
    return SessionData(
        target=target,
        surfaces=surfaces_of_laser(target, inputs.planes),
        trajectory=trajectory_in_target(inputs.poses, inputs.target_pose),
        laser_lever_arm_m=mount_of(config.laser.mount).lever_arm_body_m,
        noise=pose_noise(drift, config.ins.white),
        drift=drift_prior(config.ins.drift_within),
        as_built=config.as_built,
        mapper=inputs.laser_labelled.here,
    )


def calibration_problem(session: SessionData, inputs: Inputs, config: Config) -> CalibrationProblem:
    """Return the problem of the sensor that is calibrated, from its coarse mount, with errors of fixed parameters."""
    laser, as_built = config.laser, config.as_built
    if config.mbes is not None:
        heads = {"mbes": config.mbes, **config.further_heads}
        further = {head: mount_of(block.mount) for head, block in config.further_heads.items()}
        problem = sonar_problem(session, mount_of(config.mbes.mount), {"laser": laser, **heads}, further)
        state = problem.model.coarse
        outward, depth_m = outward_of(problem.model.faces, state), session.target.depth_m
        errors = sonar_errors(problem.model.names, laser, heads, as_built, outward, depth_m)
        known = known_parameters(state, errors, config.adjust.free)
        prior = replace(problem.prior, parameters=known, from_start=wet_faces_uncertain(as_built))
        return replace(problem, prior=prior, consider=errors)
    assert config.laser_fit is not None
    pose = target_frame(inputs.target_pose), float(np.radians(inputs.target_pose["azimuth_correction_deg"].iloc[0]))
    problem = laser_problem(session, mount_of(laser.mount), laser, config.laser_fit, surveyed_displacement(*pose))
    coarse = problem.prior.parameters
    assert coarse is not None
    errors = laser_consider(problem.model.names, laser, coarse.covariance, as_built)
    known = known_parameters(problem.model.coarse, errors, config.adjust.free)
    both = coarse if known is None else coarse.with_independent(known)
    return replace(problem, prior=replace(problem.prior, parameters=both), consider=errors)


def weak_geometry(
    inputs: Inputs, config: Config, drift: Drift, adjustment: MountAdjustment, statistics: ResidualStatistics
) -> pd.DataFrame:
    """Return table ``geometry``: the weaknesses of the sonar's passes; empty if the laser is calibrated.

    Parameters
    ----------
    inputs, config : Inputs, Config
        The inputs and settings of the stage.
    drift : Drift
        The drift model of the adjustment.
    adjustment : MountAdjustment
        The adjusted values.
    statistics : ResidualStatistics
        Numbers of soundings by surface and pass.
    """
    if config.mbes is None:
        return pd.DataFrame(columns=[column.name for column in GEOMETRY.columns])
    passes = inputs.passes.set_index("pass").loc[statistics.passes_of("mbes")]
    surfaces = enumerate(adjustment.state.surfaces)
    soundings = {surface.family: statistics.count("mbes", number) for number, surface in surfaces}
    setting = PredictionSetting(
        model=target_of(config.target),
        state=adjustment.state,
        plan=sailed_plan(inputs.files),
        segment=config.segment,
        ins=config.ins.model_copy(update={"drift": drift}),
        laser=config.laser,
        mbes=config.mbes,
    )
    rough = any(one.added.any() for one in adjustment.rough.values())
    return geometry_table(setting, passes, soundings, adjustment.equations.normal, adjustment.solution, rough)
