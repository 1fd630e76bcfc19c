"""The rigorous solution: both sensors observe shared surfaces from one moving body; unknowns and their covariance."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.adjustment.consider import considered_of, correlated
from pipeline.adjustment.ins_drift import drift_of
from pipeline.adjustment.iteration import Adjusted, Given, adjust, noise_of
from pipeline.adjustment.observation_model import scene_of
from pipeline.adjustment.residual_statistics import Cells, drift_rows, look
from pipeline.adjustment.residual_tables import bins_table, map_table
from pipeline.adjustment.result_tables import tables
from pipeline.artefacts.catalogue.points import FILES, INS_SIGMAS, PASSES, POSES
from pipeline.artefacts.catalogue.results import (
    ADJUST_SUMMARY,
    CELLS,
    COVARIANCE,
    DRIFT,
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
from pipeline.config.plan import LaserFigures, MbesFigures, Pass, Plan
from pipeline.config.pool import Adjust, AsBuilt, Ingest, Segment
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.config.target import Target
from pipeline.maths.adjustment.design_constraints import Known
from pipeline.maths.adjustment.parallel_constraints import of_ties
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.planning.observability import Coverage, geometry_advice
from pipeline.planning.prediction import PredictionSetting
from pipeline.target.design import target_of

SHOWN = 100_000  # points of a sensor in the table residuals, at most
LEAST_RAD = 1e-7  # nothing is known better


@dataclass(frozen=True)
class Config:
    target: Target
    segment: Segment
    adjust: Adjust
    ingest: Ingest
    as_built: AsBuilt
    ins: Ins
    laser: Laser
    mbes: Mbes


@dataclass(frozen=True)
class Inputs:
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
    estimate: Annotated[pd.DataFrame, ESTIMATE]
    covariance: Annotated[pd.DataFrame, COVARIANCE]
    geometry: Annotated[pd.DataFrame, GEOMETRY]
    surfaces: Annotated[pd.DataFrame, SURFACES]
    drift: Annotated[pd.DataFrame, DRIFT]
    freed: Annotated[pd.DataFrame, FREED]
    groups: Annotated[pd.DataFrame, GROUPS]
    cells: Annotated[pd.DataFrame, CELLS]
    summary: Annotated[pd.DataFrame, ADJUST_SUMMARY]
    patterns: Annotated[pd.DataFrame, PATTERNS]
    residuals: Annotated[pd.DataFrame, RESIDUALS]
    residual_bins: Annotated[pd.DataFrame, RESIDUAL_BINS]
    residual_map: Annotated[pd.DataFrame, RESIDUAL_MAP]


def run(inputs: Inputs, config: Config) -> Outputs:
    settings = config.adjust
    model = target_of(config.target)
    given = (model, inputs.poses, inputs.target_pose, inputs.planes)
    ins = config.ins.model_copy(update={"drift": drift_of(config.ins, inputs.ins_sigmas, inputs.passes)})
    scene = scene_of(*given, ins, config.laser, config.mbes, config.as_built.faces)
    streams = {"laser": inputs.laser_labelled, "mbes": inputs.soundings_labelled}
    known = Given(noise_of(ins), _ties(model, config.as_built))
    found = adjust(streams, scene, known, settings, config.ingest.max_gap_s)
    of_drift = drift_rows(found.drift, noise_of(ins), inputs.poses, inputs.passes)
    seen = look(streams, scene, found, settings, of_drift, SHOWN)
    sigmas = considered_of(found.state.names, config.laser, config.mbes, config.as_built, model.depth_m)
    together = correlated(found.state.names, config.laser)
    coarse = mount_of(config.mbes.mount)
    return Outputs(
        **tables(found, seen.cells, seen.patterns, sigmas, together, coarse, settings, inputs.poses, inputs.passes),
        geometry=_geometry_table(found, seen.cells, inputs, config, ins),
        patterns=seen.patterns,
        residuals=seen.residuals,
        residual_bins=bins_table(seen.residuals, inputs.faces),
        residual_map=map_table(seen.residuals, inputs.faces),
    )


def _ties(model: TargetModel, as_built: AsBuilt) -> Callable[[State], Known] | None:
    """Families that are parallel, within what they may be turned as built."""
    if not model.parallel:
        return None
    sigma = max(float(np.radians(as_built.angle_sigma_deg)), LEAST_RAD)
    return partial(of_ties, model.parallel, sigma)


def _geometry_table(
    found: Adjusted, cells: Cells, inputs: Inputs, config: Config, ins: Ins
) -> pd.DataFrame:
    """What the passes lack, and what would cure it."""
    passes = inputs.passes.set_index("pass").loc[sorted({number for sensor, _, number in cells if sensor == "mbes"})]
    rates = inputs.files.groupby("sensor")["rate_hz"].median()
    figures = Plan(passes=(Pass(distance_m=1.0),))
    plan = figures.model_copy(
        update={
            "ins_rate_hz": max(10.0, _or(rates["ins"], figures.ins_rate_hz)),
            "laser": LaserFigures(point_rate_hz=_or(rates["laser"], figures.laser.point_rate_hz)),
            "mbes": MbesFigures(ping_rate_hz=float(np.clip(_or(rates["mbes"], figures.mbes.ping_rate_hz), 0.1, 200.0))),
        }
    )
    model = target_of(config.target)
    setting = PredictionSetting(model, found.state, plan, config.segment, ins, config.laser, config.mbes)
    families = [surface.family for surface in found.state.surfaces]
    soundings = dict.fromkeys(families, 0)
    for (sensor, surface, _), cell in cells.items():
        soundings[families[surface]] += cell.count if sensor == "mbes" else 0
    distances = [float(one) for one in passes["distance_m"] if np.isfinite(one)]
    usual = figures.passes[0]
    speed = _or(passes["speed_m_s"].abs().median(), usual.speed_m_s)
    swing = _or(passes["heading_swing_deg"].median() * np.sqrt(2), usual.heading_swing_deg)  # of a wave: its amplitude
    level = {family.name for family in model.families if family.level}
    coverage = Coverage(distances, soundings, level, speed, swing)
    geometry = geometry_advice(setting, coverage, found.equations.normal, found.solution)
    rows = [("gap", words) for words in geometry.gaps] + ([("remedy", geometry.remedy)] if geometry.remedy else [])
    return pd.DataFrame(rows, columns=["kind", "words"]).assign(sigma=np.nan)


def _or(measured: float, otherwise: float) -> float:
    """What the session had, where it tells; as a plan's figures may have it."""
    return float(np.clip(measured, 0.05, 1e7)) if np.isfinite(measured) else otherwise
