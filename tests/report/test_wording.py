"""The words of every reason and warning: the one place that holds sentences."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.config.pool import PoolConfig
from pipeline.config.references import CastUsed
from pipeline.config.session import Drift, Mbes
from pipeline.config.verdict import VerdictLimits
from pipeline.config.yaml_models import parse
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.as_built import deviations_from_design
from pipeline.report.calibration_document import statement_lists
from pipeline.report.cast_checks import cast_origin_warnings, cast_warnings
from pipeline.report.drift_check import check_ins_drift, figures_disagree
from pipeline.report.heads import outside_passes
from pipeline.report.label_checks import unsettled_labels
from pipeline.report.limit_checks import soundings_above_limit
from pipeline.report.noise_warnings import correlated_beams, sigmas_too_small, uneven_noise
from pipeline.report.reason_codes import ReasonCode, Statement
from pipeline.report.suspected_causes import errors_allowed_for
from pipeline.report.verdict import rejections
from pipeline.report.warnings import (
    geometry_gaps,
    passes_with_one_sensor,
    passes_without_files,
    target_found,
    target_off_origin,
    unexpected_noise,
)
from pipeline.target.design import target_of
from tests.support.docks import DOCK
from tests.support.evidence import (
    ADJUSTED,
    FIGURES,
    FOUND,
    OFF,
    SEARCH,
    SIGMA,
    checked,
    drift,
    drift_figures,
    evidence,
    families,
    gaps,
    groups,
    judged,
    methods,
)
from tests.support.reason_cases import REASONS

MODEL = target_of(parse(PoolConfig, {"target": DOCK["target"]}, "pool").target)

IN_TURN = replace(ADJUSTED, method="patent_alternating")
OF_LASER = replace(ADJUSTED, search=replace(SEARCH, sensor="laser", max_angle_deg=1.5, max_lever_arm_m=float("inf")))
LABELLED = pd.DataFrame({"source": ["soundings_pool"], "reason": ["used"], "count": [1000]})
SHAPE = {"b_m": 3.0, "e_m": 0.5, "corner_deg": {"P1": 45.0, "P3": 45.0}, "lean_deg": {"P1": 0.0, "P2": 0.0, "P3": 0.0}}
FILES = pd.DataFrame({"sound_speed_low_m_s": [1504.1], "sound_speed_high_m_s": [1504.1]})
PROJECTOR = {"unknown": "projector_z", "known": True, "value": 0.119, "sigma": 0.005, "expected": 0.06}
CAST = ((0.0, 1500.0), (5.0, 1501.0))
USED = CastUsed(
    file="1.svp", sha256="0" * 64, kind="text", number=1, casts=1, taken="2026-05-09 05:00:00", place_deg=(36.0, 120.0),
    rows=2, left_out={}, first_m=0.0, last_m=5.0, tolerance_m_s=0.1, averaged_m=0.0, scatter_m_s=0.0,
)  # fmt: skip


OTHERS: list[tuple[Callable[[], Iterable[Statement]], ReasonCode, str]] = [
    (
        lambda: judged(evidence(mount={"within": False, "rotation_z_deg": -1.6}), OF_LASER),
        ReasonCode.MOUNT_BEYOND_SEARCH,
        "no mount of the laser within 1.5° of the coarse one (3 times segment.search_laser_deg) brings its points onto "
        "the target; best fits +4.40° in pitch, +4.40° in roll, -1.60° in yaw: laser.mount is farther off than that",
    ),
    (
        lambda: rejections(
            evidence(),
            {"adjustment": dict.fromkeys(("sigma_mount_total", "covariance_total", "correction"))},
            ADJUSTED,
        ),
        ReasonCode.NO_COVARIANCE,
        "the adjustment has no covariance",
    ),
    (
        lambda: judged(evidence(), replace(ADJUSTED, held=[name for name, *_ in PARAMETERS])),
        ReasonCode.NO_PARAMETER_ESTIMABLE,
        "no mount parameter is good enough: none is within its limit and better than the coarse mount",
    ),
    (
        lambda: judged(evidence(), replace(ADJUSTED, limits=VerdictLimits(max_sigma_deg=0.0059, max_sigma_m=1.0))),
        ReasonCode.SIGMA_ABOVE_LIMIT,
        "total sigma of yaw is 0.006°, above the limit of 0.0059°",
    ),
    (
        lambda: soundings_above_limit(np.diag([4e-6] * 6).tolist(), VerdictLimits(purpose="special_order")),
        ReasonCode.SOUNDINGS_ABOVE_LIMIT,
        "by the mount alone a sounding is uncertain by 0.136 m (95 %) in height, at a depth of 20 m, 60° from the "
        "vertical: 47 % of the 0.292 m that Special Order allows, above the share of 30 %",
    ),
    (
        lambda: judged(evidence(alternating={"reason": "the sonar sees no horizontal face"}), IN_TURN),
        ReasonCode.PATENT_NO_RESULT,
        "patent_alternating has no result: the sonar sees no horizontal face",
    ),
    (
        lambda: judged(evidence(alternating={"converged": False}), IN_TURN),
        ReasonCode.PATENT_NOT_CONVERGED,
        "patent_alternating did not converge in 9 turns",
    ),
    (
        lambda: rejections(evidence(), methods(lever_arm_m=[0.1, 0.094, 0.1]), IN_TURN),
        ReasonCode.PATENT_OFF_ADJUSTMENT,
        "patent_alternating differs from the adjustment by -0.0060 m in lever arm y, more than",
    ),
    (
        lambda: rejections(evidence(), methods(rotation_vector_deg=[0.8, -0.8, 0.86]), IN_TURN),
        ReasonCode.PATENT_OFF_ADJUSTMENT,
        "differs from the adjustment by +0.0600° in yaw, more than",
    ),
    (
        lambda: _one(check_ins_drift(drift(1.0), Drift(**dict.fromkeys(FIGURES, 0.0)))),
        ReasonCode.INS_DRIFT_NOT_GIVEN,
        "ins.drift allows the INS no drift at all: give its figures before you look for any other cause",
    ),
    (
        lambda: _one(check_ins_drift(drift(1.21), Drift())),
        ReasonCode.INS_DRIFT_ABOVE_SETTINGS,
        "the INS drifts at least 1.2 times as far as ins.drift says: give its figures before you look",
    ),
    (
        lambda: unsettled_labels(0.034),
        ReasonCode.LABELS_UNSETTLED,
        "the last adjustment of the sample still changed 3.4 % of the labels; labels near edges may be wrong: run",
    ),
    (
        lambda: _one(figures_disagree(drift_figures(time_constant_s=(10.0, -2.5), horizontal_m=(0.03, 1.0)))),
        ReasonCode.INS_DRIFT_OFF_FIGURES,
        "the INS drifts otherwise than ins.drift says: 2.0 times as far in position and 1.0 times as far in attitude, "
        "with a time constant of 10 s, not 200 s; the sigmas count with that, but look for the cause in the INS",
    ),
    (
        lambda: errors_allowed_for(pd.DataFrame([PROJECTOR]), 0.001),
        ReasonCode.ERROR_ALLOWED_FOR,
        "the mount allows for this, the survey does not yet: the transmitter sits higher than "
        "mbes.projector_offset_m says (null: where the receiver is), by 119 ± 5 mm in",
    ),
    (
        lambda: geometry_gaps(gaps("one pass alone"), SIGMA),
        ReasonCode.GEOMETRY_GAP,
        "one pass alone; total sigmas are up to 0.006° (yaw) and 0.6 mm (lever arm y)",
    ),
    (
        lambda: unexpected_noise(groups(variance_factor=2.01)),
        ReasonCode.NOISE_OFF_SIGMAS,
        "soundings on horizontal faces scatter 1.4 times as much as the session's sigmas say: more noise, or",
    ),
    (lambda: unexpected_noise(groups(variance_factor=0.49)), ReasonCode.NOISE_OFF_SIGMAS, "sigmas say: less noise"),
    (
        lambda: unexpected_noise(groups(group="ins_white", variance_factor=4.1)),
        ReasonCode.INS_NOISE_ABOVE_SETTINGS,
        "the INS's poses scatter from record to record 2.0 times as much as ins.white says",
    ),
    (
        lambda: unexpected_noise(groups(group="ping", variance_factor=9.0)),
        ReasonCode.PING_NOISE_ABOVE_SETTINGS,
        "whole pings scatter 3.0 times as much as ins.white says",
    ),
    (
        lambda: uneven_noise(families("mbes", P1=12.0)),
        ReasonCode.NOISE_DIFFERS_BY_FAMILY,
        "soundings on P1 scatter 3.5 times as much as on the other faces (up to 3 times is usual): look at their",
    ),
    (
        lambda: correlated_beams(families("mbes", effects={"P2": (1.0, 1.6), "H": (2.3, 1.0), "P1": (1.5, 1.0)})),
        ReasonCode.BEAMS_CORRELATED,
        "neighbouring beams err alike on P2, H: of up to 2.3 soundings of a ping only one counts; the sigmas allow",
    ),
    (
        lambda: sigmas_too_small(checked(rotation_y=(4.0, 50.0), lever_arm_z=(2.56, 128.0)), 0.001),
        ReasonCode.SIGMAS_OFF_SCATTER,
        "more than the random sigmas say: roll 2.0 ± 0.2 times (50 slots), lever arm z 1.6 ± 0.1 times (128 slots);",
    ),
    (
        lambda: unexpected_noise(groups(cut=11)),
        ReasonCode.MANY_OUTLIERS,
        "1.1 % of soundings on horizontal faces were cut as outliers",
    ),
    (
        lambda: target_found(replace(MODEL, found=True)),
        ReasonCode.TARGET_FOUND,
        "go straight on to 4.0 m below the water is an assumption",
    ),
    (
        lambda: target_off_origin(FOUND | {"tilt_deg": [0.0, 0.11]}),
        ReasonCode.TARGET_OFF_ORIGIN,
        "the target was found +0.00, +0.05, -0.09 m (x, y, z) from target.origin, out of plumb by +0.00° and +0.11°: "
        "if it was set up and surveyed better than this, check laser.mount",
    ),
    (
        lambda: passes_with_one_sensor([{"pass": k, "laser_points": 9, "soundings": 0} for k in (2, 5)]),
        ReasonCode.PASS_WITHOUT_SOUNDINGS,
        "passes 2, 5: the laser saw the target, and there are no soundings on it; was it recording?",
    ),
    (
        lambda: passes_without_files(pd.DataFrame({"start_ns": [1_462_608_018 * 10**9], "distance_m": [4.96]})),
        ReasonCode.PASS_WITHOUT_SOUNDINGS,
        "the boat also passed the target with the laser running and without any soundings, which the result lacks: "
        "2026-05-12T08:00:00Z (5.0 m); is a file of the sonar missing?",
    ),
    (
        lambda: passes_with_one_sensor([{"pass": 6, "laser_points": 0, "soundings": 9}]),
        ReasonCode.PASS_WITHOUT_LASER,
        "pass 6: the sonar saw the target, and there are no laser points on it; was it recording?",
    ),
    (
        lambda: outside_passes(pd.DataFrame({"sensor": ["mbes_2"], "count": [980]}), {"mbes_2": LABELLED}),
        ReasonCode.SOUNDINGS_OUTSIDE_PASSES,
        "mbes_2: 20 of its 1,000 soundings on the target lie outside the passes of the first head, and are not used",
    ),
    (
        lambda: deviations_from_design(SHAPE | {"b_m": 3.012}, SHAPE, {}),
        ReasonCode.LENGTH_OFF_DESIGN,
        "the laser finds b = 3.0120 m where the config has 3 m: measure it",
    ),
    (
        lambda: deviations_from_design(SHAPE | {"corner_deg": {"P1": 45.0, "P3": 45.3}}, SHAPE, {}),
        ReasonCode.ANGLE_OFF_DESIGN,
        "the laser finds 45.30° between wall and P3, by design 45°",
    ),
    (
        lambda: cast_origin_warnings(USED, (1_462_500_000_000_000_000,) * 2, None),
        ReasonCode.CAST_OF_ANOTHER_TIME,
        "mbes.svp: 1.svp was taken at 2026-05-09 05:00:00, ",
    ),
    (
        lambda: cast_origin_warnings(USED, None, (37.0, 120.0)),
        ReasonCode.CAST_OF_ANOTHER_PLACE,
        "mbes.svp: 1.svp was taken 111 km from here: the cast is taken for true",
    ),
    (
        lambda: cast_warnings(Mbes.model_construct(svp=CAST), FILES, {"rotation_vector_deg": None}),
        ReasonCode.CAST_OFF_HEAD_SPEED,
        "mbes.svp lies between 1500.0 and 1501.0 m/s, the head recorded 1504.1 to 1504.1",
    ),
    (
        lambda: cast_warnings(
            Mbes.model_construct(svp=CAST), FILES.replace(1504.1, 1500.0), {"rotation_vector_deg": [0.0, 1.9, 1.0]}
        ),
        ReasonCode.RAYS_TRACED_WITH_WRONG_MOUNT,
        "rays were traced through mbes.svp with a coarse mount that is 2.1° off: enter the values found as mbes.mount",
    ),
]


OF_WALLS = {  # test_wall_checks.py, test_unseen_faces.py, test_water_check.py
    ReasonCode.FACE_LEFT_OUT, ReasonCode.ROUGH_WALL, ReasonCode.UNSEEN_FACE_ERROR, ReasonCode.WATER_CONTRADICTED,
}  # fmt: skip


def _one(check: Statement | None) -> list[Statement]:
    return [] if check is None else [check]


@pytest.mark.parametrize(("change", "code", "words"), REASONS)
def test_each_evidence_is_one_reason(change: dict[str, Any], code: ReasonCode, words: str) -> None:
    (reason,) = judged(evidence(**change))
    assert reason.code == code
    assert words in reason.words


@pytest.mark.parametrize(("statements", "code", "words"), OTHERS)
def test_each_statement_has_its_words(
    statements: Callable[[], Iterable[Statement]], code: ReasonCode, words: str
) -> None:
    (statement,) = statements()
    assert statement.code == code
    assert words in statement.words


def test_words_and_codes_are_parallel_lists() -> None:
    reasons = judged(evidence(count=-371, patterns=[OFF]))
    lists = statement_lists("reason", reasons)
    assert lists == {
        "reasons": [reason.words for reason in reasons],
        "reason_codes": ["too_few_soundings", "residuals_by_angle"],
    }
    assert all(type(code) is str for code in lists["reason_codes"])  # as YAML writes it
    assert statement_lists("warning", []) == {"warnings": [], "warning_codes": []}


def test_no_code_is_without_words_and_a_meaning() -> None:
    assert {code for _, code, _ in [*REASONS, *OTHERS]} | OF_WALLS == set(ReasonCode)
    for code in ReasonCode:
        assert code.value == code.name.lower() == str(code)
        assert code.meaning
        assert "\n" not in code.meaning
