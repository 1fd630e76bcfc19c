"""The patent's offsets: once after the angles (as it prints them), and in turn with them until both stand still."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.patent import ALTERNATION, ANGLES, CORRECTIONS, OFFSET_PAIRS
from pipeline.artefacts.catalogue.target import FACES, PLANES, SOUNDING_MOMENTS
from pipeline.artefacts.from_tables import angle_passes, horizontal_faces, offset_passes
from pipeline.config.pool import FitPlanes, Offsets
from pipeline.config.stage_settings import SensorMount
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.patent.offsets import alternate, offsets
from pipeline.mount import mount_of

METHODS = ("patent_sequential", "patent_alternating")


@dataclass(frozen=True)
class Config:
    fit_planes: FitPlanes
    offsets: Offsets
    mbes: SensorMount


@dataclass(frozen=True)
class Inputs:
    faces: Annotated[pd.DataFrame, FACES]
    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]
    angles: Annotated[pd.DataFrame, ANGLES]


@dataclass(frozen=True)
class Outputs:
    offset_pairs: Annotated[pd.DataFrame, OFFSET_PAIRS]
    alternation: Annotated[pd.DataFrame, ALTERNATION]
    corrections: Annotated[pd.DataFrame, CORRECTIONS]


def run(inputs: Inputs, config: Config) -> Outputs:
    try:
        passes = angle_passes(inputs.faces, inputs.planes, inputs.sounding_moments, config.fit_planes.min_points)
    except DegenerateGeometryError as error:
        return _tables([_none(method, str(error)) for method in METHODS], [], [])
    pool = offset_passes(passes, inputs.planes)
    dry, wet = horizontal_faces(inputs.faces, inputs.planes, inputs.sounding_moments, config.fit_planes.min_points)
    lever = mount_of(config.mbes.mount).lever_arm_body_m
    settings = config.offsets
    angles = inputs.angles.iloc[0]
    corrections: list[dict[str, Any]] = []
    pairs: list[dict[str, Any]] = []
    alternation: list[dict[str, float]] = []

    vector = np.radians([float(angles[f"rotation_{axis}_deg"]) for axis in "xyz"])
    method = METHODS[0]
    try:
        if angles["reason"]:
            raise DegenerateGeometryError(str(angles["reason"]))
        once = offsets(pool, dry, wet, exp_so3(vector), lever, settings.apply_x_first)
        pairs += [{"method": method, **pair} for pair in once.pairs]
        corrections.append(_row(method, vector, once.body_m, bool(angles["converged"]), int(angles["iterations"]), ""))
    except DegenerateGeometryError as error:
        corrections.append(_none(method, str(error)))

    method = METHODS[1]
    try:
        tolerances = (np.radians(settings.step_tolerance_deg), settings.step_tolerance_m)
        result = alternate(passes, pool, dry, wet, lever, settings.max_iterations, *tolerances)
        rotation, shift = result.rotation_vector_rad, result.lever_arm_correction_m
        last = offsets(pool, dry, wet, exp_so3(rotation), lever + shift, True)
        pairs += [{"method": method, **pair} for pair in last.pairs]
        alternation = result.rows
        corrections.append(_row(method, rotation, shift, result.converged, result.iterations, ""))
    except DegenerateGeometryError as error:
        corrections.append(_none(method, str(error)))
    return _tables(corrections, pairs, alternation)


def _tables(
    corrections: list[dict[str, Any]], pairs: list[dict[str, Any]], alternation: list[dict[str, float]]
) -> Outputs:
    return Outputs(
        pd.DataFrame(pairs, columns=[column.name for column in OFFSET_PAIRS.columns]),
        pd.DataFrame(alternation, columns=[column.name for column in ALTERNATION.columns]),
        pd.DataFrame(corrections),
    )


def _none(method: str, reason: str) -> dict[str, Any]:
    return _row(method, np.full(3, np.nan), np.full(3, np.nan), False, 0, reason)


def _row(
    method: str, vector_rad: np.ndarray, lever_m: np.ndarray, converged: bool, iterations: int, reason: str
) -> dict[str, Any]:
    row: dict[str, Any] = {"method": method}
    row |= {f"rotation_{axis}_deg": float(np.degrees(vector_rad[k])) for k, axis in enumerate("xyz")}
    row |= {f"lever_arm_{axis}_m": float(lever_m[k]) for k, axis in enumerate("xyz")}
    return row | {"converged": converged, "iterations": iterations, "reason": reason}
