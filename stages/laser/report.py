"""The answer of a laser's own calibration: its mount, what is held of it, and the verdict."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.adjustment.ins_drift import drift_of, told
from pipeline.adjustment.pattern_tests import pattern_tests
from pipeline.artefacts.catalogue.points import INS_SIGMAS, PASSES
from pipeline.artefacts.catalogue.results import (
    ADJUST_SUMMARY,
    CALIBRATION,
    CALIBRATION_JSON,
    CALIBRATION_YAML,
    CELLS,
    COVARIANCE,
    DRIFT,
    ESTIMATE,
    FREED,
    GEOMETRY,
    GROUPS,
    PATTERNS,
)
from pipeline.artefacts.catalogue.target import FACES, PLANES, PROVISIONAL_MOUNT, TARGET_POSE
from pipeline.artefacts.schema import Provenance
from pipeline.config.pool import Adjust, Segment, Verdict
from pipeline.config.session import Ins, Laser
from pipeline.config.target import Target
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import mount_of
from pipeline.report.as_built import as_found, by_design, oddities
from pipeline.report.calibration_document import (
    SCHEMA,
    adjustment_block,
    calibration_table,
    documents,
    free_block,
    instruments_block,
    matrix,
    pass_rows,
    plain,
    target_block,
)
from pipeline.report.verdict import NO_DRIFT, Evidence, Settings, drift_doubt, reasons, warnings
from pipeline.results.screen import verdict_in_words
from pipeline.target.design import target_of
from pipeline.target.laser_search import LARGEST_TURN


@dataclass(frozen=True)
class Config:
    name: str
    target: Target
    ins: Ins
    laser: Laser
    segment: Segment
    adjust: Adjust
    verdict: Verdict


@dataclass(frozen=True)
class Inputs:
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    passes: Annotated[pd.DataFrame, PASSES]
    faces: Annotated[pd.DataFrame, FACES]
    planes: Annotated[pd.DataFrame, PLANES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    provisional_mount: Annotated[pd.DataFrame, PROVISIONAL_MOUNT]
    estimate: Annotated[pd.DataFrame, ESTIMATE]
    covariance: Annotated[pd.DataFrame, COVARIANCE]
    geometry: Annotated[pd.DataFrame, GEOMETRY]
    drift: Annotated[pd.DataFrame, DRIFT]
    freed: Annotated[pd.DataFrame, FREED]
    patterns: Annotated[pd.DataFrame, PATTERNS]
    cells: Annotated[pd.DataFrame, CELLS]
    groups: Annotated[pd.DataFrame, GROUPS]
    summary: Annotated[pd.DataFrame, ADJUST_SUMMARY]
    provenance: Annotated[dict[str, Any], Provenance]


@dataclass(frozen=True)
class Outputs:
    calibration: Annotated[pd.DataFrame, CALIBRATION]
    calibration_json: Annotated[str, CALIBRATION_JSON]
    calibration_yaml: Annotated[str, CALIBRATION_YAML]


def run(inputs: Inputs, config: Config) -> Outputs:
    coarse, model = mount_of(config.laser.mount), target_of(config.target)
    summary = inputs.summary.iloc[0]
    block = adjustment_block(inputs.estimate, inputs.covariance, dict(summary), coarse, "laser")
    rows = inputs.geometry[inputs.geometry["kind"] == "held"]
    held = dict(zip(rows["words"].tolist(), rows["sigma"].tolist(), strict=True))
    evidence = Evidence(
        inputs.faces,
        inputs.target_pose,
        inputs.provisional_mount,
        pd.DataFrame(),
        inputs.summary,
        inputs.cells,
        inputs.geometry,
        inputs.freed,
        inputs.patterns,
    )
    from_files = told(config.ins, inputs.ins_sigmas, inputs.passes)
    drift, level = drift_of(config.ins, inputs.ins_sigmas, inputs.passes), config.adjust.test_level
    tolerated = config.adjust.test_tolerance_m
    doubt = drift_doubt(inputs.drift, drift, "the INS's files say" if from_files else "ins.drift says")
    farthest = (LARGEST_TURN * config.segment.search_laser_deg, np.inf)
    given = Settings(config.verdict, level, tolerated, "adjustment", farthest, doubt, config.target.shape, "laser")
    found = reasons(evidence, {"adjustment": block}, given)
    built = as_found(inputs.planes, inputs.patterns, model)
    target = target_block(inputs.target_pose.iloc[0]) | {"as_found": built}
    methods = {"adjustment": block}
    verdict = "rejected" if found else "accepted"
    result = {
        "schema": SCHEMA,
        "session": config.name,
        "verdict": verdict,
        "verdict_in_words": verdict_in_words(verdict, held),
        "reasons": found,
        "warnings": warnings(inputs.groups, target, inputs.geometry, block["sigma_mount_total"])
        + ([doubt] if doubt not in ("", NO_DRIFT, *found) else [])
        + oddities(built, by_design(model)),
        "result": "adjustment",
        "calibrated": "laser",
        "laser": block,
        "methods": methods,
        "held": held,
        "coarse": {"mount": coarse.settings()},
        "geometry": {
            "correlation": matrix(inputs.covariance, "correlation"),
            "weakest": str(summary["weakest"]),
            "advice": _advice(held),
            "test": {name: plain(summary[f"test_{name}"]) for name in ("statistic", "limit", "dof", "passed")},
            "patterns": pattern_tests(inputs.patterns, level),
        },
        "free": free_block(inputs.freed),
        "target": target,
        "passes": pass_rows(inputs.passes, inputs.cells),
        "ins_drift": drift.model_dump() | {"from_files": list(from_files)},
        "inputs": inputs.provenance["inputs"],
        "software": inputs.provenance["software"],
    } | instruments_block({"ins": config.ins, "laser": config.laser})
    return Outputs(calibration_table(methods, coarse), *documents(result))


def _advice(held: Mapping[str, float]) -> str:
    """What keeps its coarse value, and what would help."""
    if not held:
        return ""
    are, them, values = ("is", "it", "value") if len(held) == 1 else ("are", "them", "values")
    of_angle = [name for name, _, _, unit in PARAMETERS if unit == "deg"]
    each = [f"{name} (±{s:.3f}°)" if name in of_angle else f"{name} (±{1000 * s:.0f} mm)" for name, s in held.items()]
    return (
        f"{', '.join(each)} {are} held at the coarse {values}: this target and these passes cannot give {them} within "
        "the verdict's limits; a surveyed target (laser_fit.origin_sigma_m, azimuth_sigma_deg), more passes at other "
        "distances, or a less drifting INS would"
    )
