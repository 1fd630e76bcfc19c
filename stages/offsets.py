"""The patent's offsets: once after the angles; in turn with them to convergence; and word for word."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.patent import ALTERNATION, ANGLES, CORRECTIONS, LITERAL_ANGLES, OFFSET_PAIRS
from pipeline.artefacts.catalogue.points import POOL_FRAME
from pipeline.artefacts.catalogue.target import FACES, PLANES, SOUNDING_MOMENTS, TARGET_POSE
from pipeline.artefacts.from_tables import rotation_vector_deg
from pipeline.artefacts.patent_tables import angle_passes, offset_observations, session_planes
from pipeline.artefacts.to_tables import mount_correction_columns
from pipeline.config.pool import FitPlanes, Offsets
from pipeline.config.stage_settings import SensorMount
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.patent.angles import PassPlanes
from pipeline.maths.patent.literal_offsets import literal_offsets
from pipeline.maths.patent.offsets import (
    AlternationTolerances,
    OffsetObservations,
    alternate,
    patent_offsets,
)
from pipeline.mount import mount_of

SEQUENTIAL, ALTERNATING, LITERAL = "patent_sequential", "patent_alternating", "patent_literal"


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
    literal_angles: Annotated[pd.DataFrame, LITERAL_ANGLES]
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    offset_pairs: Annotated[pd.DataFrame, OFFSET_PAIRS]
    alternation: Annotated[pd.DataFrame, ALTERNATION]
    corrections: Annotated[pd.DataFrame, CORRECTIONS]


def run(inputs: Inputs, config: Config) -> Outputs:
    """Compute the offsets by all forms. If the geometry does not allow a form, ``corrections`` has the reason."""
    min_points = config.fit_planes.min_points
    tables = (inputs.faces, inputs.planes, inputs.sounding_moments)
    try:
        passes = angle_passes(*tables, min_points)
    except DegenerateGeometryError as error:
        reasons = [_no_correction(method, str(error)) for method in (SEQUENTIAL, ALTERNATING, LITERAL)]
        return _tables(reasons, [], [])
    observations = offset_observations(passes, *tables, min_points)
    lever_arm_m = mount_of(config.mbes.mount).lever_arm_body_m
    forms: dict[str, Callable[[], _Form]] = {
        SEQUENTIAL: lambda: _sequential(inputs.angles, observations, lever_arm_m, config.offsets.apply_x_first),
        ALTERNATING: lambda: _alternating(passes, observations, lever_arm_m, config.offsets),
        LITERAL: lambda: _literal(inputs, observations, lever_arm_m, min_points),
    }
    corrections: list[dict[str, Any]] = []
    pairs: list[dict[str, Any]] = []
    turns: list[dict[str, float]] = []
    for method, form in forms.items():
        try:
            found = form()
        except DegenerateGeometryError as error:
            corrections.append(_no_correction(method, str(error)))
            continue
        state = {"converged": found.converged, "iterations": found.iterations, "reason": ""}
        corrections.append(_row(method, found.rotation_vector_rad, found.lever_arm_m, state))
        pairs += [{"method": method, **pair} for pair in found.pairs]
        turns += found.turns
    return _tables(corrections, pairs, turns)


@dataclass(frozen=True)
class _Form:
    """One form: corrections (3,) of rotation and lever arm, body axes; face pairs; turns, if it alternates."""

    rotation_vector_rad: np.ndarray
    lever_arm_m: np.ndarray
    converged: bool
    iterations: int
    pairs: list[dict[str, float | str]]
    turns: list[dict[str, float]] = field(default_factory=list)


def _found_angles(table: pd.DataFrame) -> tuple[np.ndarray, bool, int]:
    """Return the corrections (3,) rad of the angles, whether they converged, and the steps taken."""
    angles = table.iloc[0]
    if angles["reason"]:
        raise DegenerateGeometryError(str(angles["reason"]))
    return np.radians(rotation_vector_deg(angles)), bool(angles["converged"]), int(angles["iterations"])


def _sequential(
    angles: pd.DataFrame, observations: OffsetObservations, lever_arm_m: np.ndarray, apply_x_first: bool
) -> _Form:
    """Return the offsets, computed once after the angles."""
    vector_rad, converged, iterations = _found_angles(angles)
    offsets = patent_offsets(observations, exp_so3(vector_rad), lever_arm_m, apply_x_first)
    return _Form(vector_rad, offsets.body_m, converged, iterations, offsets.pairs)


def _alternating(
    passes: list[PassPlanes], observations: OffsetObservations, lever_arm_m: np.ndarray, settings: Offsets
) -> _Form:
    """Return the fixed point of the alternation of angles and offsets, with the face pairs at this point."""
    tolerances = AlternationTolerances(
        max_iterations=settings.max_iterations,
        step_rad=np.radians(settings.step_tolerance_deg),
        step_m=settings.step_tolerance_m,
    )
    result = alternate(passes, observations, lever_arm_m, tolerances)
    rotation, correction = exp_so3(result.rotation_vector_rad), result.lever_arm_correction_m
    last = patent_offsets(observations, rotation, lever_arm_m + correction, True)
    return _Form(
        result.rotation_vector_rad, correction, result.converged, result.iterations, last.pairs, result.rows
    )


def _literal(inputs: Inputs, observations: OffsetObservations, lever_arm_m: np.ndarray, min_points: int) -> _Form:
    """Return the printed offsets, computed once after the literal angles."""
    angles_rad, converged, iterations = _found_angles(inputs.literal_angles)
    planes = session_planes(inputs.faces, inputs.planes, inputs.sounding_moments, min_points)
    pool_frame, target_pose = inputs.pool_frame.iloc[0], inputs.target_pose.iloc[0]
    azimuth_rad = np.radians(pool_frame["azimuth_deg"] + target_pose["azimuth_correction_deg"])
    offsets = literal_offsets(planes, (observations.dry, observations.wet), azimuth_rad, angles_rad, lever_arm_m)
    return _Form(angles_rad, offsets.enu_m, converged, iterations, [offsets.pair])


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
