"""The laser's own fine calibration: its points lie on the target's planes, which stand as designed, or surveyed."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.adjustment.consider import considered_of
from pipeline.adjustment.ins_drift import drift_of
from pipeline.adjustment.iteration import Given, adjust, free_unknowns, noise_of
from pipeline.adjustment.laser_design import bounds_of, coarse_covariance, design_of, held_of
from pipeline.adjustment.observation_model import laser_scene_of
from pipeline.adjustment.residual_statistics import drift_rows, look
from pipeline.adjustment.residual_tables import bins_table, map_table
from pipeline.adjustment.result_tables import tables
from pipeline.artefacts.catalogue.points import INS_SIGMAS, PASSES, POSES
from pipeline.artefacts.catalogue.target import FACES, LASER_LABELLED, PLANES, TARGET_POSE
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust, AsBuilt, Ingest, LaserFit, Segment, Verdict
from pipeline.config.session import Ins, Laser
from pipeline.config.target import Target
from pipeline.maths.adjustment.design_constraints import of_design
from pipeline.maths.adjustment.parameters import SIX
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import mount_of
from pipeline.target.design import target_of
from stages.adjust import SHOWN, Outputs

__all__ = ["Config", "Inputs", "Outputs", "run"]


@dataclass(frozen=True)
class Config:
    target: Target
    segment: Segment
    adjust: Adjust
    laser_fit: LaserFit
    verdict: Verdict
    ingest: Ingest
    as_built: AsBuilt
    ins: Ins
    laser: Laser


@dataclass(frozen=True)
class Inputs:
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    passes: Annotated[pd.DataFrame, PASSES]
    faces: Annotated[pd.DataFrame, FACES]
    poses: Annotated[pd.DataFrame, POSES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    planes: Annotated[pd.DataFrame, PLANES]
    laser_labelled: Annotated[Stream, LASER_LABELLED]


def run(inputs: Inputs, config: Config) -> Outputs:
    settings, fit = config.adjust, config.laser_fit
    model, coarse = target_of(config.target), coarse_covariance(config.laser, fit)
    given = (model, inputs.poses, inputs.target_pose, inputs.planes)
    ins = config.ins.model_copy(update={"drift": drift_of(config.ins, inputs.ins_sigmas, inputs.passes)})
    scene = laser_scene_of(*given, ins, config.laser, config.as_built.faces)
    free = free_unknowns(scene.coarse, settings.free)

    refused: dict[int, float] = {}

    def held(normal: np.ndarray) -> list[int]:
        refused.update(held_of(normal, free, bounds_of(coarse, fit, config.verdict)))
        return list(refused)

    streams = {"laser": inputs.laser_labelled}
    known = Given(noise_of(ins), partial(of_design, design_of(model, inputs.target_pose, fit)), held)
    found = adjust(streams, scene, known, settings, config.ingest.max_gap_s)
    of_drift = drift_rows(found.drift, noise_of(ins), inputs.poses, inputs.passes)
    seen = look(streams, scene, found, settings, of_drift, SHOWN)
    sigmas = considered_of(found.state.names, config.laser, None, config.as_built)
    kept = np.setdiff1d(np.arange(SIX), found.solution.free)
    sigmas[kept] = np.sqrt(np.diag(coarse))[kept]
    blocks = [(kept, coarse[np.ix_(kept, kept)])] if len(kept) else []
    mount = mount_of(config.laser.mount)
    return Outputs(
        **tables(found, seen.cells, seen.patterns, sigmas, blocks, mount, settings, inputs.poses, inputs.passes),
        geometry=_geometry_table(refused),
        patterns=seen.patterns,
        residuals=seen.residuals,
        residual_bins=bins_table(seen.residuals, inputs.faces),
        residual_map=map_table(seen.residuals, inputs.faces),
    )


def _geometry_table(refused: Mapping[int, float]) -> pd.DataFrame:
    """Which of the six are held, and with which sigma they would have come out."""
    rows = [
        ("held", name, float(np.degrees(refused[place])) if unit == "deg" else refused[place])
        for name, place, _, unit in PARAMETERS
        if place in refused
    ]
    return pd.DataFrame(rows, columns=["kind", "words", "sigma"])
