"""The answer: calibration.json for programs, calibration.yaml for people, a summary for the screen, and the verdict."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.ins_drift import drift_of, told
from pipeline.adjustment.pattern_tests import pattern_tests
from pipeline.artefacts.catalogue.patent import CORRECTIONS
from pipeline.artefacts.catalogue.points import FILES, INS_SIGMAS, PASSES
from pipeline.artefacts.catalogue.results import (
    ADJUST_SUMMARY,
    CALIBRATION,
    CALIBRATION_JSON,
    CALIBRATION_YAML,
    CELLS,
    CLOSING,
    COVARIANCE,
    DRIFT,
    ESTIMATE,
    FREED,
    GEOMETRY,
    GROUPS,
    PATTERNS,
)
from pipeline.artefacts.catalogue.target import FACES, PLANES, PROVISIONAL_MOUNT, SOUNDING_MOMENTS, TARGET_POSE
from pipeline.artefacts.from_tables import rotation_vector_deg, vector_of
from pipeline.artefacts.schema import Provenance
from pipeline.config.mount import Mount
from pipeline.config.pool import Adjust, Method, Segment, Verdict
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.config.target import Target
from pipeline.mount import Mounted, corrected_mount, mount_of
from pipeline.report.as_built import as_found, by_design, oddities
from pipeline.report.calibration_document import (
    SCHEMA,
    adjustment_block,
    calibration_table,
    documents,
    free_block,
    instruments_block,
    matrix,
    method_block,
    mounted_of,
    pass_rows,
    plain,
    target_block,
)
from pipeline.report.cast_checks import cast_doubts, in_words
from pipeline.report.plane_agreement import closing_table
from pipeline.report.verdict import NO_DRIFT, Evidence, Settings, drift_doubt, one_eyed, reasons, warnings
from pipeline.results.screen import verdict_in_words
from pipeline.target.design import target_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Config:
    name: str
    target: Target
    ins: Ins
    laser: Laser
    mbes: Mbes
    segment: Segment
    adjust: Adjust
    verdict: Verdict
    result: Method


@dataclass(frozen=True)
class Inputs:
    files: Annotated[pd.DataFrame, FILES]
    passes: Annotated[pd.DataFrame, PASSES]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    faces: Annotated[pd.DataFrame, FACES]
    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    provisional_mount: Annotated[pd.DataFrame, PROVISIONAL_MOUNT]
    corrections: Annotated[pd.DataFrame, CORRECTIONS]
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
    closing: Annotated[pd.DataFrame, CLOSING]
    calibration_json: Annotated[str, CALIBRATION_JSON]
    calibration_yaml: Annotated[str, CALIBRATION_YAML]


def run(inputs: Inputs, config: Config) -> Outputs:
    coarse = mount_of(config.mbes.mount)
    methods = _patent_methods(inputs.corrections, coarse)
    methods["adjustment"] = adjustment_block(
        inputs.estimate, inputs.covariance, inputs.summary.to_dict("records")[0], coarse
    )
    passes = pass_rows(inputs.passes, inputs.cells)
    evidence = Evidence(
        inputs.faces,
        inputs.target_pose,
        inputs.provisional_mount,
        inputs.corrections,
        inputs.summary,
        inputs.cells,
        inputs.geometry,
        inputs.freed,
        inputs.patterns,
    )
    from_files = told(config.ins, inputs.ins_sigmas, inputs.passes)
    drift = drift_of(config.ins, inputs.ins_sigmas, inputs.passes)
    doubt = drift_doubt(inputs.drift, drift, "the INS's files say" if from_files else "ins.drift says")
    farthest, level = config.segment.farthest_mount, config.adjust.test_level
    tolerated = config.adjust.test_tolerance_m
    settings = Settings(
        config.verdict, level, tolerated, config.result, farthest, doubt, config.target.shape,
        sides=config.target.sides, asked=_asked(config.mbes.mount, inputs.provisional_mount),
    )
    found = reasons(evidence, methods, settings)
    model = target_of(config.target)
    built = as_found(inputs.planes, inputs.patterns, model)
    summary, target = inputs.summary.iloc[0], target_block(inputs.target_pose.iloc[0]) | {"as_found": built}
    verdict = "rejected" if found else "accepted"
    result = {
        "schema": SCHEMA,
        "session": config.name,
        "verdict": verdict,
        "verdict_in_words": verdict_in_words(verdict),
        "reasons": found,
        "warnings": warnings(
            inputs.groups, target, inputs.geometry, methods["adjustment"]["sigma_mount_total"]
        )
        + ([doubt] if doubt not in ("", NO_DRIFT, *found) else [])
        + one_eyed(passes)
        + oddities(built, by_design(model))
        + cast_doubts(config.mbes, inputs.files, methods["adjustment"]["correction"]),
        "result": config.result,
        "mbes": methods[config.result],
        "methods": methods,
        "coarse": {"mount": coarse.settings()},
        "geometry": {
            "correlation": matrix(inputs.covariance, "correlation"),
            "weakest": str(summary["weakest"]),
            "advice": "; ".join(inputs.geometry["words"]),
            "test": {name: plain(summary[f"test_{name}"]) for name in ("statistic", "limit", "dof", "passed")},
            "patterns": pattern_tests(inputs.patterns, config.adjust.test_level),
        },
        "free": free_block(inputs.freed),
        "target": target,
        "passes": passes,
        "ranges": _range_note(config.mbes),
        **_cast_block(config.mbes),
        "ins_drift": drift.model_dump() | {"from_files": list(from_files)},
        "inputs": inputs.provenance["inputs"],
        "software": inputs.provenance["software"],
    } | instruments_block({"ins": config.ins, "laser": config.laser, "mbes": config.mbes})
    mounts = {"coarse": coarse} | {name: mounted_of(block) for name, block in methods.items() if block["mount"]}
    return Outputs(
        calibration_table(methods, coarse),
        closing_table(inputs.faces, inputs.planes, inputs.sounding_moments, coarse, mounts),
        *documents(result),
    )


def _asked(coarse: Mount, provisional: pd.DataFrame) -> str:
    """What to enter where the coarse angles have been checked, and the soundings yet ask for others."""
    found = provisional.iloc[0]
    settings = corrected_mount(coarse, rotation_vector_deg(found)).settings()
    values = ", ".join(f"{key} {settings[key]:.1f}" for key in ("roll_deg", "pitch_deg", "yaw_deg"))
    return f"; if you have checked the signs, enter {values} as mbes.mount and run again"


def _range_note(mbes: Mbes) -> str:
    said = "sonar ranges taken as recorded: half the two-way path"
    if mbes.projector_offset_m is not None:
        said = f"sonar ranges reduced for a transmitter at {list(mbes.projector_offset_m)} m in the mbes frame"
    if mbes.svp is None:
        return said
    said = f"{said}; rays traced through a cast of {len(mbes.svp)} depths"
    return said if mbes.svp_from is None else f"{said} (mbes.svp {in_words(mbes.svp_from)})"


def _cast_block(mbes: Mbes) -> dict[str, Any]:
    """What of calibration.json tells of the cast; nothing without one."""
    if mbes.svp is None:
        return {}
    used = {} if mbes.svp_from is None else mbes.svp_from.model_dump(mode="json")
    return {"cast": {"depths": len(mbes.svp), "sigma_m_s": mbes.svp_sigma_m_s} | used}


def _patent_methods(corrections: pd.DataFrame, coarse: Mounted) -> dict[str, dict[str, Any]]:
    methods = {}
    for row in corrections.to_dict("records"):
        vector = np.radians(rotation_vector_deg(row))
        lever = vector_of(row, "lever_arm_{}_m")
        methods[str(row["method"])] = method_block(vector, lever, coarse, row)
    return methods
