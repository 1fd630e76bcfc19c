"""The rigorous solution: one least-squares adjustment of all points on the target, with the parameters' covariance.

The sonar is calibrated against the surfaces that the laser measures, or the laser against the target's design.
"""

from dataclasses import dataclass
from typing import Annotated

import pandas as pd

from pipeline.adjustment.ins_drift import drift_model
from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.adjustment.laser_design import fixed_parameters_table, laser_problem
from pipeline.adjustment.problem import SessionData, sonar_problem
from pipeline.adjustment.residual_statistics import ResidualStatistics, residual_statistics
from pipeline.adjustment.residual_tables import bins_table, map_table
from pipeline.adjustment.result_tables import result_tables
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
    PATTERNS,
    RESIDUAL_BINS,
    RESIDUAL_MAP,
    RESIDUALS,
    SURFACES,
)
from pipeline.artefacts.catalogue.target import FACES, LASER_LABELLED, PLANES, SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust, AsBuilt, Ingest, Segment
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.config.stage_settings import LaserCalibration
from pipeline.config.target import Target
from pipeline.planning.session_geometry import geometry_table, sailed_plan
from pipeline.planning.setting import PredictionSetting
from pipeline.target.design import target_of


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
    laser_fit: LaserCalibration | None

    @property
    def calibration(self) -> Mbes | LaserCalibration:
        """The settings of the calibration: ``mbes`` or ``laser_fit``, whichever is not None."""
        (calibration,) = (block for block in (self.mbes, self.laser_fit) if block is not None)
        return calibration


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads; ``soundings_labelled`` is empty if the laser is calibrated."""

    files: Annotated[pd.DataFrame, FILES]
    passes: Annotated[pd.DataFrame, PASSES]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    faces: Annotated[pd.DataFrame, FACES]
    poses: Annotated[pd.DataFrame, POSES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    planes: Annotated[pd.DataFrame, PLANES]
    laser_labelled: Annotated[Stream, LASER_LABELLED]
    soundings_labelled: Annotated[Stream, SOUNDINGS_LABELLED]


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
    groups: Annotated[pd.DataFrame, GROUPS]
    cells: Annotated[pd.DataFrame, CELLS]
    summary: Annotated[pd.DataFrame, ADJUST_SUMMARY]
    patterns: Annotated[pd.DataFrame, PATTERNS]
    residuals: Annotated[pd.DataFrame, RESIDUALS]
    residual_bins: Annotated[pd.DataFrame, RESIDUAL_BINS]
    residual_map: Annotated[pd.DataFrame, RESIDUAL_MAP]


def run(inputs: Inputs, config: Config) -> Outputs:
    """Adjust the mount of the sensor that is calibrated."""
    # Set up the problem of the sensor that is calibrated.
    calibration, session = config.calibration, session_data(inputs, config)
    problem = (
        sonar_problem(session, calibration) if isinstance(calibration, Mbes) else laser_problem(session, calibration)
    )

    # Adjust the mount to all labelled points of the sensors that take part.
    labelled = {"laser": inputs.laser_labelled, "mbes": inputs.soundings_labelled}
    points = {sensor: labelled[sensor] for sensor in problem.model.sigmas}
    adjustment = adjust_mount(problem, points, config.adjust, config.ingest.max_gap_s)

    # Compute the residuals of all points at the adjusted values, and make the tables.
    statistics = residual_statistics(problem, adjustment, points, inputs.passes, config.adjust)
    return Outputs(
        **result_tables(problem, adjustment, statistics, inputs.passes, config.adjust.test_level),
        geometry=weak_geometry(inputs, config, session, adjustment, statistics),
        patterns=statistics.patterns,
        residuals=statistics.residuals,
        residual_bins=bins_table(statistics.residuals, inputs.faces),
        residual_map=map_table(statistics.residuals, inputs.faces),
    )


def session_data(inputs: Inputs, config: Config) -> SessionData:
    """Return the results of earlier stages and the instruments, with the drift model for the adjustment."""
    drift = drift_model(config.ins, inputs.ins_sigmas, inputs.passes)
    return SessionData(
        target=target_of(config.target),
        poses=inputs.poses,
        target_pose=inputs.target_pose,
        planes=inputs.planes,
        ins=config.ins.model_copy(update={"drift": drift}),
        laser=config.laser,
        as_built=config.as_built,
    )


def weak_geometry(
    inputs: Inputs, config: Config, session: SessionData, adjustment: MountAdjustment, statistics: ResidualStatistics
) -> pd.DataFrame:
    """Return table ``geometry``: the laser's parameters that were fixed, or the weaknesses of the sonar's passes.

    Parameters
    ----------
    inputs, config : Inputs, Config
        The inputs and settings of the stage.
    session : SessionData
        Target and instruments.
    adjustment : MountAdjustment
        The adjusted values.
    statistics : ResidualStatistics
        Numbers of soundings by surface and pass.
    """
    if config.mbes is None:
        return fixed_parameters_table(adjustment.fixed_mount)
    passes = inputs.passes.set_index("pass").loc[statistics.passes_of("mbes")]
    surfaces = enumerate(adjustment.state.surfaces)
    soundings = {surface.family: statistics.count("mbes", number) for number, surface in surfaces}
    setting = PredictionSetting(
        model=session.target,
        state=adjustment.state,
        plan=sailed_plan(inputs.files),
        segment=config.segment,
        ins=session.ins,
        laser=config.laser,
        mbes=config.mbes,
    )
    return geometry_table(setting, passes, soundings, adjustment.equations.normal, adjustment.solution)
