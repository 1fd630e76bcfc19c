"""Coarse mounts from marks as text for the screen and as plain values for YAML."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtri

from pipeline.coarse.mounts_from_marks import Array, MarksAssessment
from pipeline.console import signed
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.maths.survey.data_snooping import SNOOPING_LEVEL, SURVEY, MarkTest, global_limit
from pipeline.mount import Mounted, setting_change
from pipeline.text_table import text_table

MOST_NAMED = 8
CAUTIOUS = 30  # degrees of freedom below which a variance factor is uncertain


@dataclass(frozen=True)
class MarkResidual:
    """A mark's residual (survey minus drawing, (3,) mm, body axes) and its test; None if its error would not show."""

    frame: str
    mark: str
    residual_mm: Array
    test: MarkTest | None

    @property
    def is_suspicious(self) -> bool:
        """Whether the mark fails its test."""
        return self.test is not None and self.test.ratio > 1


def marks_text(assessment: MarksAssessment, present: Mapping[str, Mounted]) -> str:
    """Return the mounts, residuals and tests as text for the screen; ``present``: the mounts in session.yaml."""
    lines: list[str] = []
    for name in assessment.mounts:
        lines += [*_mount_table(assessment, name, present.get(name)), ""]
    lines.append("Residuals in mm, survey minus drawing, body axes; normalised, and from where on suspicious:")
    lines += _residual_lines(assessment)
    lines += [_global_line(assessment), *(f"But look: {warning}." for warning in assessment.warnings)]
    lines += [f"Wrong: {words}." for words in _contradictions(assessment)]
    if not assessment.agrees:
        which = "without the marks named" if assessment.snooped.suspects else "with all marks"
        lines.append(f"The mounts above are {which}. Nothing is written: measure again, or use leave_out.")
    return "\n".join(lines)


def marks_values(assessment: MarksAssessment, present: Mapping[str, Mounted]) -> dict[str, Any]:
    """Return the mounts, residuals and tests as plain values for YAML; ``present``: the mounts in session.yaml."""
    first = assessment.snooped.first
    tests = {
        "level": SNOOPING_LEVEL,
        "statistic": first.squares,
        "degrees_of_freedom": first.redundancy,
        "limit": global_limit(first.redundancy),
        "passed": first.squares <= global_limit(first.redundancy),
        "variance_factor": first.squares / first.redundancy,
    }
    mounts = {}
    for name, (mounted, covariance) in assessment.mounts.items():
        settings, session = mounted.settings(), present[name].settings() if name in present else None
        mounts[name] = {
            "mount": settings,
            "sigma_mount": mounted.sigmas(covariance),
            "session": session,
            "change": None if session is None else {key: setting_change(settings, session, key) for key in settings},
            "R_body_from_sensor": mounted.R_body_from_sensor.tolist(),
            "covariance": covariance.tolist(),
        }
    residuals = [
        {
            "frame": row.frame,
            "mark": row.mark,
            "residual_body_mm": row.residual_mm.tolist(),
            "normalised": None if row.test is None else _normalised(row.test),
            "suspicious": row.is_suspicious,
        }
        for row in _residuals(assessment)
    ]
    return {
        "agrees": assessment.agrees,
        "wrong": _contradictions(assessment),
        "warnings": list(assessment.warnings),
        "global_test": tests,
        "mounts": mounts,
        "residuals": residuals,
    }


def _mount_table(assessment: MarksAssessment, name: str, present: Mounted | None) -> list[str]:
    mounted, covariance = assessment.mounts[name]
    session = None if present is None else present.settings()
    sigma, settings = mounted.sigmas(covariance), mounted.settings()
    rows = []
    for parameter, _, key, unit_of_setting in PARAMETERS:
        unit = "°" if unit_of_setting == "deg" else unit_of_setting
        before = "-" if session is None else f"{session[key]:.4f} {unit}"
        change = "-" if session is None else f"{signed(setting_change(settings, session, key), 4)} {unit}"
        rows.append((parameter, before, f"{settings[key]:.4f} {unit}", change, f"{sigma[key]:.4f} {unit}"))
    return text_table("<12>12>14>14>12", (f"{name} mount", "session", "coarse", "change", "sigma"), rows)


def _residuals(assessment: MarksAssessment) -> Iterator[MarkResidual]:
    """Yield the residuals of the adjustment with all marks."""
    adjusted, frames = assessment.snooped.first, assessment.frames
    to_body_mm = 1000 * adjusted.poses[0].R_survey_from_frame.T
    tests = {(test.frame, test.mark): test for test in assessment.snooped.tests}
    for number, (name, frame) in enumerate(frames.by_name.items()):
        if frame.axes is None:
            residuals_mm = adjusted.residuals_of(number, frame.points) @ to_body_mm.T
            for mark, residual_mm in zip(frame.marks.tolist(), residuals_mm, strict=True):
                yield MarkResidual(name, frames.mark_names[mark], residual_mm, tests.get((number, mark)))


def _residual_lines(assessment: MarksAssessment) -> list[str]:
    rows = []
    for row in _residuals(assessment):
        tested, words = ["", ""], "an error of it would not show"
        if row.test is not None:
            tested = [f"{_normalised(row.test):.1f}", f"{np.sqrt(row.test.limit / row.test.rank):.1f}"]
            words = "suspicious" if row.is_suspicious else ""
        rows.append([row.frame, row.mark, *(signed(value, 1) for value in row.residual_mm), *tested, words])
    return text_table("  <6<14>9>9>9>9>6  <1", [], rows)[1:]


def _global_line(assessment: MarksAssessment) -> str:
    first = assessment.snooped.first
    freedom, passed = first.redundancy, first.squares <= global_limit(first.redundancy)
    line = f"Global test: {first.squares:.1f}, limit {global_limit(freedom):.1f}, {freedom} degrees of freedom: "
    line += f"{'passed' if passed else 'failed'}. Variance factor {first.squares / freedom:.2f}"
    if freedom < CAUTIOUS:
        low, high = (float(chdtri(freedom, share)) / freedom for share in (0.975, 0.025))
        line += f" (of so few, {low:.2f} to {high:.2f} is chance)"
    return f"{line}."


def _normalised(test: MarkTest) -> float:
    """Return the test's statistic as a normalised residual, about one if the mark is right."""
    return float(np.sqrt(test.statistic / test.rank))


def _mark_name(assessment: MarksAssessment, test: MarkTest) -> str:
    mark = assessment.frames.mark_names[test.mark]
    return f"{mark} (survey)" if test.frame == SURVEY else f"{mark} ({list(assessment.frames.by_name)[test.frame]})"


def _contradictions(assessment: MarksAssessment) -> list[str]:
    """Return the sentences that name the marks that do not agree."""
    snooped = assessment.snooped
    words = []
    for suspect in snooped.suspects:
        rivals = "".join(f" or {_mark_name(assessment, test)}" for test in suspect.rivals)
        which = " (the marks do not show which of them)" if suspect.rivals else ""
        words.append(f"mark {_mark_name(assessment, suspect.test)}{rivals} does not fit{which}")
    if not snooped.agrees:
        remaining = [test for test in snooped.last_tests if test.frame != SURVEY]
        likely = [test for test in remaining if test.ratio > 1] or remaining[:3]
        names = ", ".join(f"{_mark_name(assessment, test)} {_normalised(test):.1f}" for test in likely[:MOST_NAMED])
        words.append(
            f"{'still ' if words else ''}the marks do not agree, and the wrong one cannot be identified: three marks "
            f"in a frame are too few for that, or sigmas are too small; worst first (normalised): {names}"
        )
    return words
