"""The answer: the verdict, calibration.json for programs and calibration.yaml for people."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import pandas as pd

from pipeline.adjustment.error_sources import stated_of
from pipeline.adjustment.ins_drift import drift_model, sigmas_from_files
from pipeline.artefacts.catalogue.results import CALIBRATION, CALIBRATION_JSON, CALIBRATION_YAML, CLOSING
from pipeline.artefacts.catalogue.target import WATER_LEVELS
from pipeline.artefacts.schema import Provenance
from pipeline.config.pool import Adjust, AsBuilt, LaserFit, Method, Segment
from pipeline.config.session import Calibrated, Ins, Laser, Mbes
from pipeline.config.target import Target
from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import limits_document, limits_of, purpose_in_words
from pipeline.report.as_built import design_shape, deviations_from_design, measured_shape, shape_errors
from pipeline.report.calibration_document import (
    SCHEMA,
    documents,
    estimated_drift_block,
    free_block,
    geometry_block,
    instruments_block,
    pass_rows,
    statement_lists,
    target_block,
)
from pipeline.report.drift_check import NO_DRIFT, check_ins_drift, figures_disagree
from pipeline.report.evidence import Evidence
from pipeline.report.heads import FIRST, HeadReport, OfHeads, evidence_of, head_report, heads_keys, outside_passes
from pipeline.report.hypotheses import hypotheses_block
from pipeline.report.label_checks import unsettled_labels
from pipeline.report.laser_report import laser_report
from pipeline.report.method_blocks import calibration_table
from pipeline.report.noise_warnings import correlated_beams, sigmas_too_small, uneven_noise
from pipeline.report.part_checks import parts_block
from pipeline.report.reason_codes import Statement, verdict_in_words
from pipeline.report.sensor_report import SensorReport
from pipeline.report.sigma_sources import laser_correlates
from pipeline.report.sonar_report import SonarSettings, sonar_report
from pipeline.report.suspected_causes import errors_allowed_for
from pipeline.report.systematic_errors import systematic_block
from pipeline.report.verdict import Criteria, explanations, has_values, rejections
from pipeline.report.wall_checks import left_out_block, unsurveyed_walls
from pipeline.report.warnings import geometry_gaps, target_found, target_off_origin, unexpected_noise
from pipeline.report.water_check import water_contradicted
from pipeline.target.design import target_of


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses; ``calibrated``: the sensor that the report is about."""

    name: str
    target: Target
    as_built: AsBuilt
    ins: Ins
    laser: Laser
    mbes: Mbes | None
    further_heads: dict[str, Mbes]  # of the sonar, by name
    calibrated: Calibrated
    laser_fit: LaserFit | None
    segment: Segment
    adjust: Adjust
    verdict: VerdictLimits
    result: Method

    @property
    def sensor(self) -> Mbes | Laser:
        """The settings of the calibrated sensor."""
        return self.mbes if self.calibrated == "mbes" and self.mbes is not None else self.laser

    @property
    def limits(self) -> VerdictLimits:
        """The limits of the verdict on the calibrated sensor."""
        return limits_of(self.verdict, self.calibrated)


@dataclass(frozen=True, kw_only=True)
class Inputs(Evidence, OfHeads):
    """Tables of the earlier stages, and the run's provenance: digests of raw files, versions of software."""

    provenance: Annotated[dict[str, Any], Provenance]
    water_levels: Annotated[pd.DataFrame, WATER_LEVELS]


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """Documents and tables that the stage writes; ``closing`` compares two sensors: None if the laser is calibrated."""

    calibration: Annotated[pd.DataFrame, CALIBRATION]
    calibration_json: Annotated[str, CALIBRATION_JSON]
    calibration_yaml: Annotated[str, CALIBRATION_YAML]
    closing: Annotated[pd.DataFrame | None, CLOSING] = None


def run(inputs: Inputs, config: Config) -> Outputs:
    """Judge a calibration, and return it as documents for programs and for people."""
    first, passes = evidence_of(inputs, inputs, FIRST), pass_rows(inputs.passes, inputs.water_levels, inputs.cells)
    report = _sensor_report(first, config, passes)
    further = [_further_head(head, inputs, config) for head in config.further_heads]
    model = target_of(config.target)
    shape = measured_shape(inputs.planes, inputs.patterns, model)
    target = target_block(inputs.target_pose.iloc[0]) | {"as_found": shape}
    drift_figures = sigmas_from_files(config.ins, inputs.ins_sigmas, inputs.passes)
    drift = drift_model(config.ins, inputs.ins_sigmas, inputs.passes)
    source = "the INS's files say" if drift_figures else "ins.drift says"
    drift_check, criteria = check_ins_drift(inputs.drift, drift, source), _criteria(config, report)
    off_figures = figures_disagree(inputs.drift_figures, source)
    systematic = _systematic(inputs.freed, config.mbes, config)
    reasons = rejections(first, report.methods, criteria, drift_check, off_figures, [head.judged for head in further])
    warnings = [
        *geometry_gaps(inputs.geometry, report.methods["adjustment"]["sigma_mount_total"]),
        *unsettled_labels(float(inputs.provisional_mount["label_change"].iloc[0])),
        *([] if model.found else target_off_origin(target)), *target_found(model),
        *water_contradicted(inputs.water_levels, inputs.cells, config.target, config.segment.water_margin_m),
        *(_of_values(first, config, (drift_check, off_figures), reasons) if has_values(inputs.summary) else ()),
        *report.pass_warnings,
        *deviations_from_design(shape, design_shape(model), shape_errors(inputs.planes, model)),
        *report.cast_warnings,
        *outside_passes(inputs.cells, inputs.counts_of_heads),
        *(one for head in further for one in head.warnings(config.adjust.test_level)),
    ]
    verdict = "rejected" if reasons else "accepted"
    result = {
        "schema": SCHEMA,
        "session": config.name,
        "verdict": verdict,
        "verdict_in_words": verdict_in_words(verdict, report.held, purpose_in_words(config.limits)),
        **statement_lists("reason", reasons),
        "hypotheses": hypotheses_block(explanations(inputs, criteria)),
        **statement_lists("warning", warnings),
        "limits": limits_document(config.limits),
        "result": report.method,
        **report.result_keys,
        **heads_keys(head_report(FIRST, first, report, criteria, systematic), further, inputs.covariance),
        "coarse": {"mount": report.coarse.settings()},
        "geometry": geometry_block(first, report.advice, config.adjust.test_level),
        "parts": parts_block(inputs.parts, config.adjust.test_level),
        "free": free_block(inputs.freed),
        "target": target, **left_out_block(inputs.left_out),
        "passes": passes,
        **report.data_keys,
        **systematic,
        "ins_drift": drift.model_dump() | {"from_files": list(drift_figures)},
        "ins_drift_estimated": estimated_drift_block(inputs.drift_figures),
        "inputs": inputs.provenance["inputs"],
        "software": inputs.provenance["software"],
        **instruments_block({"ins": config.ins, "laser": config.laser, **report.instruments, **config.further_heads}),
    }
    json_text, yaml_text = documents(result)
    return Outputs(calibration_json=json_text, calibration_yaml=yaml_text, **_tables(report, further))


def _of_values(
    evidence: Evidence, config: Config, of_drift: Sequence[Statement | None], reasons: Sequence[Statement]
) -> list[Statement]:
    """Return the warnings that rest on the adjusted values; ``of_drift``: of the INS's drift, where it is no reason."""
    level = config.adjust.test_level
    return [
        *unexpected_noise(evidence.groups),
        *uneven_noise(evidence.groups),
        *correlated_beams(evidence.groups),
        *sigmas_too_small(evidence.estimate, level),
        *errors_allowed_for(evidence.freed, level),
        *unsurveyed_walls(evidence, config.limits),
        *(check for check in of_drift if check is not None and check not in (NO_DRIFT, *reasons)),
    ]


def _tables(report: SensorReport, further: Sequence[HeadReport]) -> dict[str, Any]:
    """Return by name the tables of all heads: the rows of the first, then those of the further ones."""
    calibration = [calibration_table(report.methods, report.coarse), *(head.calibration for head in further)]
    closing = None if report.closing is None else pd.concat([report.closing, *(head.closing for head in further)])
    return {"calibration": pd.concat(calibration), "closing": closing}


def _sensor_report(evidence: Evidence, config: Config, passes: Sequence[dict[str, Any]]) -> SensorReport:
    """Return the parts of the report that depend on the calibrated sensor; ``passes``: as in calibration.json."""
    sensor = config.sensor
    if isinstance(sensor, Laser):
        assert config.laser_fit is not None
        return laser_report(sensor, evidence, config.segment, config.limits, config.laser_fit)
    settings = SonarSettings(
        mbes=sensor, segment=config.segment, method=config.result, sides=config.target.sides
    )
    return sonar_report(settings, evidence, passes)


def _further_head(head: str, inputs: Inputs, config: Config) -> HeadReport:
    """Return the report on a further head of the sonar, which was adjusted together with the first."""
    evidence = evidence_of(inputs, inputs, head)
    settings = SonarSettings(
        mbes=config.further_heads[head], segment=config.segment, method=config.result, sides=config.target.sides
    )
    report = sonar_report(settings, evidence, ())
    systematic = _systematic(evidence.freed, config.further_heads[head], config)
    return head_report(head, evidence, report, _criteria(config, report), systematic)


def _systematic(freed: pd.DataFrame, head: Mbes | None, config: Config) -> dict[str, Any]:
    """Return the block ``systematic`` of calibration.json for a head; empty if the laser is calibrated."""
    if head is None:
        return {}
    stated = stated_of(config.laser, head, config.target, config.as_built)
    return {"systematic": systematic_block(freed, config.laser.mount_covariance, stated)}


def _criteria(config: Config, report: SensorReport) -> Criteria:
    """Return the criteria by which the calibration is judged."""
    return Criteria(
        limits=config.limits,
        test_level=config.adjust.test_level,
        method=report.method,
        search=report.search,
        shape=config.target.shape,
        sides=report.sides,
        held=report.held,
        laser_correlates=laser_correlates(config.calibrated, config.laser.mount_covariance),
    )
