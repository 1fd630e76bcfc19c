"""The tables from which a report is made."""

from dataclasses import dataclass
from typing import Annotated

import pandas as pd

from pipeline.artefacts.catalogue.patent import CORRECTIONS
from pipeline.artefacts.catalogue.points import FILES, INS_SIGMAS, PASSES, UNSOUNDED_PASSES
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
    LEFT_OUT,
    PARTS,
    PATTERNS,
    SETS,
)
from pipeline.artefacts.catalogue.target import FACES, PLANES, PROVISIONAL_MOUNT, SOUNDING_MOMENTS, TARGET_POSE


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Tables of the earlier stages. A calibration of the laser has no ``corrections``."""

    files: Annotated[pd.DataFrame, FILES]
    passes: Annotated[pd.DataFrame, PASSES]
    unsounded_passes: Annotated[pd.DataFrame, UNSOUNDED_PASSES]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    faces: Annotated[pd.DataFrame, FACES]
    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    provisional_mount: Annotated[pd.DataFrame, PROVISIONAL_MOUNT]
    estimate: Annotated[pd.DataFrame, ESTIMATE]
    covariance: Annotated[pd.DataFrame, COVARIANCE]
    geometry: Annotated[pd.DataFrame, GEOMETRY]
    drift: Annotated[pd.DataFrame, DRIFT]
    drift_figures: Annotated[pd.DataFrame, DRIFT_FIGURES]
    freed: Annotated[pd.DataFrame, FREED]
    sets: Annotated[pd.DataFrame, SETS]
    patterns: Annotated[pd.DataFrame, PATTERNS]
    parts: Annotated[pd.DataFrame, PARTS]
    cells: Annotated[pd.DataFrame, CELLS]
    groups: Annotated[pd.DataFrame, GROUPS]
    left_out: Annotated[pd.DataFrame, LEFT_OUT]
    summary: Annotated[pd.DataFrame, ADJUST_SUMMARY]
    corrections: Annotated[pd.DataFrame | None, CORRECTIONS] = None
