"""The patent's offsets: once after the angles, as the patent prints them, and in turn with them to convergence."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.patent import ALTERNATION, ANGLES, CORRECTIONS, OFFSET_PAIRS
from pipeline.artefacts.catalogue.target import FACES, PLANES, SOUNDING_MOMENTS
from pipeline.artefacts.from_tables import rotation_vector_deg
from pipeline.artefacts.patent_tables import angle_passes, offset_observations
from pipeline.artefacts.to_tables import mount_correction_columns
from pipeline.config.pool import FitPlanes, Offsets
from pipeline.config.stage_settings import SensorMount
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.patent.angles import PassPlanes
from pipeline.maths.patent.offsets import (
    AlternationResult,
    AlternationTolerances,
    OffsetObservations,
    PatentOffsets,
    alternate,
    patent_offsets,
)
from pipeline.mount import mount_of

SEQUENTIAL, ALTERNATING = "patent_sequential", "patent_alternating"


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses."""

    fit_planes: FitPlanes
    offsets: Offsets
    mbes: SensorMount


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads."""

    faces: Annotated[pd.DataFrame, FACES]
    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]
    angles: Annotated[pd.DataFrame, ANGLES]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    offset_pairs: Annotated[pd.DataFrame, OFFSET_PAIRS]
    alternation: Annotated[pd.DataFrame, ALTERNATION]
    corrections: Annotated[pd.DataFrame, CORRECTIONS]


def run(inputs: Inputs, config: Config) -> Outputs:
    """Compute the offsets by both methods. If the geometry does not allow a method, ``corrections`` has the reason."""
    min_points = config.fit_planes.min_points
    try:
        passes = angle_passes(inputs.faces, inputs.planes, inputs.sounding_moments, min_points)
    except DegenerateGeometryError as error:
        return _tables([_no_correction(method, str(error)) for method in (SEQUENTIAL, ALTERNATING)], [], [])
    observations = offset_observations(passes, inputs.faces, inputs.planes, inputs.sounding_moments, min_points)
    lever_arm_m = mount_of(config.mbes.mount).lever_arm_body_m
    corrections: list[dict[str, Any]] = []
    pairs: list[dict[str, Any]] = []
    alternation: list[dict[str, float]] = []

    angles = inputs.angles.iloc[0]
    try:
        sequential = _sequential(angles, observations, lever_arm_m, config.offsets.apply_x_first)
        pairs += [{"method": SEQUENTIAL, **pair} for pair in sequential.pairs]
        state = {"converged": bool(angles["converged"]), "iterations": int(angles["iterations"]), "reason": ""}
        vector_rad = np.radians(rotation_vector_deg(angles))
        corrections.append(_row(SEQUENTIAL, vector_rad, sequential.body_m, state))
    except DegenerateGeometryError as error:
        corrections.append(_no_correction(SEQUENTIAL, str(error)))

    try:
        result, last = _alternating(passes, observations, lever_arm_m, config.offsets)
        pairs += [{"method": ALTERNATING, **pair} for pair in last.pairs]
        alternation = result.rows
        state = {"converged": result.converged, "iterations": result.iterations, "reason": ""}
        corrections.append(_row(ALTERNATING, result.rotation_vector_rad, result.lever_arm_correction_m, state))
    except DegenerateGeometryError as error:
        corrections.append(_no_correction(ALTERNATING, str(error)))
    return _tables(corrections, pairs, alternation)


def _sequential(
    angles: pd.Series, observations: OffsetObservations, lever_arm_m: np.ndarray, apply_x_first: bool
) -> PatentOffsets:
    """Return the offsets, computed once after the angles."""
    if angles["reason"]:
        raise DegenerateGeometryError(str(angles["reason"]))
    rotation = exp_so3(np.radians(rotation_vector_deg(angles)))
    return patent_offsets(observations, rotation, lever_arm_m, apply_x_first)


def _alternating(
    passes: list[PassPlanes], observations: OffsetObservations, lever_arm_m: np.ndarray, settings: Offsets
) -> tuple[AlternationResult, PatentOffsets]:
    """Return the fixed point of the alternation of angles and offsets, and the offsets at this point."""
    tolerances = AlternationTolerances(
        max_iterations=settings.max_iterations,
        step_rad=np.radians(settings.step_tolerance_deg),
        step_m=settings.step_tolerance_m,
    )
    result = alternate(passes, observations, lever_arm_m, tolerances)
    rotation = exp_so3(result.rotation_vector_rad)
    return result, patent_offsets(observations, rotation, lever_arm_m + result.lever_arm_correction_m, True)


def _tables(
    corrections: list[dict[str, Any]], pairs: list[dict[str, Any]], alternation: list[dict[str, float]]
) -> Outputs:
    return Outputs(
        pd.DataFrame(pairs, columns=[column.name for column in OFFSET_PAIRS.columns]),
        pd.DataFrame(alternation, columns=[column.name for column in ALTERNATION.columns]),
        pd.DataFrame(corrections),
    )


def _no_correction(method: str, reason: str) -> dict[str, Any]:
    state = {"converged": False, "iterations": 0, "reason": reason}
    return _row(method, np.full(3, np.nan), np.full(3, np.nan), state)


def _row(method: str, vector_rad: np.ndarray, lever_arm_m: np.ndarray, state: dict[str, Any]) -> dict[str, Any]:
    return {"method": method} | mount_correction_columns(vector_rad, lever_arm_m) | state
