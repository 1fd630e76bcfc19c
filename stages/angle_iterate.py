"""The patent's angle iteration, with the lever arm left at its coarse value; and the same word for word."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.patent import ANGLES, ITERATIONS, LITERAL_ANGLES, LITERAL_ITERATIONS, PASS_ITERATIONS
from pipeline.artefacts.catalogue.target import FACES, PLANES, SOUNDING_MOMENTS
from pipeline.artefacts.patent_tables import angle_passes, session_planes
from pipeline.artefacts.to_tables import xyz_columns
from pipeline.config.pool import AngleIterate, FitPlanes
from pipeline.config.stage_settings import SensorMount
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.patent.angles import AngleResult, AngleTolerances, iterate_angles
from pipeline.maths.patent.literal_angles import LiteralAngles, iterate_literally
from pipeline.mount import mount_of


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses."""

    fit_planes: FitPlanes
    angle_iterate: AngleIterate
    mbes: SensorMount


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads."""

    faces: Annotated[pd.DataFrame, FACES]
    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    iterations: Annotated[pd.DataFrame, ITERATIONS]
    pass_iterations: Annotated[pd.DataFrame, PASS_ITERATIONS]
    angles: Annotated[pd.DataFrame, ANGLES]
    literal_iterations: Annotated[pd.DataFrame, LITERAL_ITERATIONS]
    literal_angles: Annotated[pd.DataFrame, LITERAL_ANGLES]


def run(inputs: Inputs, config: Config) -> Outputs:
    """Iterate the angles. If the geometry does not allow it, they are NaN, and table ``angles`` has the reason."""
    settings = config.angle_iterate
    tolerances = AngleTolerances(
        max_iterations=settings.max_iterations,
        step_rad=np.radians(settings.step_tolerance_deg),
        angle_rad=np.radians(settings.angle_tolerance_deg),
    )
    lever_arm_m = mount_of(config.mbes.mount).lever_arm_body_m
    reason = ""
    try:
        passes = angle_passes(inputs.faces, inputs.planes, inputs.sounding_moments, config.fit_planes.min_points)
        result = iterate_angles(passes, lever_arm_m, tolerances)
    except DegenerateGeometryError as error:
        result, reason = AngleResult(np.full(3, np.nan), False, 0, [], []), str(error)
    literal = _literal(inputs, config, lever_arm_m)
    return Outputs(
        pd.DataFrame(result.rows, columns=[column.name for column in ITERATIONS.columns]),
        pd.DataFrame(result.pass_rows, columns=[column.name for column in PASS_ITERATIONS.columns]),
        _angles(result.rotation_vector_rad, result, reason),
        pd.DataFrame(literal.rows, columns=[column.name for column in LITERAL_ITERATIONS.columns]),
        _angles(literal.angles_rad, literal, literal.reason),
    )


def _literal(inputs: Inputs, config: Config, lever_arm_m: np.ndarray) -> LiteralAngles:
    """Return the angles of the literal form; without a result they are NaN."""
    settings = config.angle_iterate
    min_points = config.fit_planes.min_points
    try:
        planes = session_planes(inputs.faces, inputs.planes, inputs.sounding_moments, min_points)
    except DegenerateGeometryError as error:
        return LiteralAngles(np.full(3, np.nan), False, 0, str(error))
    return iterate_literally(planes, lever_arm_m, settings.max_iterations, np.radians(settings.literal_threshold_deg))


def _angles(vector_rad: np.ndarray, result: AngleResult | LiteralAngles, reason: str) -> pd.DataFrame:
    """Return the one row of an iteration's result."""
    row = xyz_columns("rotation_{}_deg", np.degrees(vector_rad))
    return pd.DataFrame([row | {"converged": result.converged, "iterations": result.iterations, "reason": reason}])
