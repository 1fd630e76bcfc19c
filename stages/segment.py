"""Find the target in the laser's points, and label the points of both sensors by face."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import pandas as pd

from pipeline.adjustment.ins_drift import drift_model, pose_noise
from pipeline.adjustment.laser_design import laser_problem, surveyed_displacement
from pipeline.adjustment.problem import CalibrationProblem, SessionData, designed_surfaces, sonar_problem
from pipeline.adjustment.provisional import (
    design_without_place,
    sample_near_target,
    uncertain_wet_faces,
    with_adjusted_sample,
)
from pipeline.artefacts.catalogue.points import (
    GEOREFERENCE_COUNTS,
    INS_SIGMAS,
    LASER_POOL,
    PASSES,
    POOL_FRAME,
    POSES,
    SOUNDINGS_POOL,
)
from pipeline.artefacts.catalogue.target import (
    FACES,
    LASER_LABELLED,
    PROVISIONAL_MOUNT,
    SEGMENT_COUNTS,
    SOUNDINGS_LABELLED,
    TARGET_POSE,
    WATER_LEVELS,
)
from pipeline.artefacts.counts import counts_table, used, why_none_used
from pipeline.artefacts.from_tables import trajectory_in_pool
from pipeline.artefacts.streams import EMPTY_STREAM, BatchResult, Chunk, Mapper, Stream, serial
from pipeline.artefacts.to_tables import faces_table
from pipeline.config.pool import Segment
from pipeline.config.stage_settings import (
    AdjustIteration,
    FacesAsBuilt,
    InsErrors,
    LaserPoints,
    LaserPrior,
    PassGaps,
    SonarBeams,
)
from pipeline.config.target import Target
from pipeline.errors import RawDataError
from pipeline.maths.adjustment.drift_likelihood import EXACT
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.mount import mount_of
from pipeline.target.design import target_of
from pipeline.target.gate import for_uncertain_faces
from pipeline.target.labelled_points import LabellingContext, label_batch
from pipeline.target.laser_search import refine_target_and_laser
from pipeline.target.mount_search import search_mount
from pipeline.target.pose_search import search_target_pose
from pipeline.target.result_tables import provisional_mount_table, target_pose_table, water_table
from pipeline.target.samples import laser_poses, laser_sample, scan_of, sounding_sample
from pipeline.target.surface import ClosestSurface

COUNTED = {"laser_pool": "laser_points", "soundings_pool": "soundings"}  # names in table counts, by stream
FEWEST_VOXELS = 50  # fewest voxels with laser points above the water


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses; ``mbes`` is None if the laser is calibrated, ``laser_fit`` if the sonar is."""

    target: Target
    segment: Segment
    adjust: AdjustIteration
    ingest: PassGaps
    as_built: FacesAsBuilt
    ins: InsErrors
    laser: LaserPoints
    mbes: SonarBeams | None
    laser_fit: LaserPrior | None


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads."""

    passes: Annotated[pd.DataFrame, PASSES]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    poses: Annotated[pd.DataFrame, POSES]
    counts: Annotated[pd.DataFrame, GEOREFERENCE_COUNTS]
    laser_pool: Annotated[Stream, LASER_POOL]
    soundings_pool: Annotated[Stream, SOUNDINGS_POOL]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    faces: Annotated[pd.DataFrame, FACES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    water_levels: Annotated[pd.DataFrame, WATER_LEVELS]
    provisional_mount: Annotated[pd.DataFrame, PROVISIONAL_MOUNT]
    counts: Annotated[pd.DataFrame, SEGMENT_COUNTS]
    laser_labelled: Annotated[Stream, LASER_LABELLED] = EMPTY_STREAM
    soundings_labelled: Annotated[Stream, SOUNDINGS_LABELLED] = EMPTY_STREAM


def prepare(inputs: Inputs, config: Config) -> LabellingContext:
    """Find the target in the laser's points, and the provisional mount of the sensor that is calibrated."""
    context = search(inputs, config)

    # Adjust a sample of the points: labels need the trajectory without its drift.
    streams = {"laser_pool": inputs.laser_pool, "soundings_pool": inputs.soundings_pool}
    counts = {name: used(inputs.counts, kind) for name, kind in COUNTED.items()}
    if config.mbes is None:
        del counts["soundings_pool"]
    if not all(counts.values()):
        return context
    sample = {name: sample_near_target(streams[name], name, count, context) for name, count in counts.items()}
    drift = drift_model(config.ins, inputs.ins_sigmas, inputs.passes)
    noise, mapper = pose_noise(drift, config.ins.white), inputs.laser_pool.here
    problem_at = partial(provisional_problem, noise=noise, config=config, mapper=mapper)
    return with_adjusted_sample(context, sample, problem_at, config.adjust, config.ingest.max_gap_s)


def search(inputs: Inputs, config: Config) -> LabellingContext:
    """Search for the target, and for the mount of the sensor that is calibrated."""
    model = target_of(config.target)
    lowest_m = config.target.water_level_m - model.half_period_m / 2
    dry = laser_sample(inputs.laser_pool, used(inputs.counts, "laser_points"), lowest_m)
    if len(dry.voxel_means_m) < FEWEST_VOXELS:
        raise RawDataError(
            f"laser: {len(dry.voxel_means_m)} places seen above the water near the target, at least 50 are needed; "
            "check target.origin, target.water_level_m and laser.mount; poolcal check tells which of them"
        )
    azimuth_known = not bool(inputs.pool_frame["azimuth_estimated"].iloc[0])
    in_pool, laser = trajectory_in_pool(inputs.poses), mount_of(config.laser.mount)
    target = search_target_pose(dry, scan_of(dry, in_pool, laser), model, config.segment, azimuth_known)
    if config.mbes is None:
        target, mount = refine_target_and_laser(laser_poses(dry, in_pool), target, model, laser, config.segment)
    trajectory = target.frame.trajectory_from_pool(in_pool)
    if config.mbes is not None:
        soundings = sounding_sample(inputs.soundings_pool, used(inputs.counts, "soundings"), trajectory)
        mount = search_mount(soundings, model, mount_of(config.mbes.mount), config.mbes, config.segment)
        mount = for_uncertain_faces(mount, config.as_built, model)
    return LabellingContext(
        model=model,
        surface=ClosestSurface(model),
        target=target,
        mount=mount,
        trajectory=trajectory,
        corrected=trajectory,
        water=water_table(config.target, trajectory, inputs.passes),
        laser=laser,
        laser_beam_m=config.laser.beam_m,
        mbes=config.mbes,
        settings=config.segment,
    )


def provisional_problem(
    context: LabellingContext, noise: PoseNoise, config: Config, mapper: Mapper = serial
) -> CalibrationProblem:
    """Return the calibration problem of the provisional adjustment, which starts from the designed surfaces."""
    mount, laser = context.provisional_mount, config.laser
    session = SessionData(
        target=context.model,
        surfaces=designed_surfaces(context.model),
        trajectory=context.trajectory,
        laser_lever_arm_m=context.laser.lever_arm_body_m,
        noise=noise,
        drift=EXACT,
        as_built=config.as_built,
        mapper=mapper,
    )
    if config.mbes is not None:
        problem = sonar_problem(session, mount, {"laser": laser, "mbes": config.mbes})
        problem = replace(problem, prior=replace(problem.prior, surfaces=design_without_place(context.model)))
        return uncertain_wet_faces(problem, config.as_built)
    assert config.laser_fit is not None
    set_up = surveyed_displacement(context.target.frame, context.target.azimuth_correction_rad)
    return laser_problem(session, mount, laser, config.laser_fit, set_up)


def run_batch(source: str, chunk: Chunk, prepared: LabellingContext, config: Config) -> BatchResult:
    """Label the points of one chunk."""
    return label_batch(source, chunk.columns, prepared)


def combine(
    prepared: LabellingContext, partials: dict[str, list[tuple[str, dict[str, int]]]], config: Config
) -> Outputs:
    """Return the target's faces and pose, the provisional mount, and the sums of the counts.

    Raises
    ------
    RawDataError
        A sensor has no point on the target's faces.
    """
    counts = counts_table(partials)
    for source, sensor in (("laser_pool", "laser"), ("soundings_pool", "mbes")):
        if sensor == "mbes" and config.mbes is None:
            continue
        reasons = why_none_used(counts, source)
        if reasons is not None:
            limits = f"{config.segment.search_mount_deg:g}° and {config.segment.search_mount_m:g} m"
            mount = f"the coarse mount by more than {limits}, " if sensor == "mbes" else ""
            raise RawDataError(
                f"{sensor}: no point on the target's faces ({reasons}); target.origin, target.azimuth_deg (of +y) "
                f"or {config.target.shape} may be wrong, {mount}or a clock (UTC is 18 s behind GPS time); "
                "poolcal check tells which"
            )
    return Outputs(
        faces=faces_table(prepared.model),
        target_pose=target_pose_table(prepared.target),
        water_levels=prepared.water,
        provisional_mount=provisional_mount_table(prepared.mount),
        counts=counts,
    )
