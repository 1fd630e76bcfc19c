"""Coarse calibration: sensors' mounts from surveyed marks, judged, in words and as what session.yaml is to say."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from pipeline.coarse.drawing_errors import examine, examine_flat
from pipeline.coarse.frames import NEAR_DEG, Placed, place
from pipeline.coarse.session_edit import block_of
from pipeline.config.marks import Marks
from pipeline.console import signed
from pipeline.errors import ConfigError, NotConvergedError
from pipeline.maths.geometry.rotations import log_so3
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.maths.survey.data_snooping import SIGNIFICANCE, SURVEY, MarkTest, SnoopingResult, global_limit, snoop
from pipeline.maths.survey.frame_adjustment import relative_mount
from pipeline.mount import Mounted, setting_change

Array = NDArray[np.float64]
FARTHEST_M = 100.0  # of a lever arm that session.yaml takes
MOST_NAMED = 8
CAUTIOUS = 30  # degrees of freedom below which a variance factor tells little


@dataclass(frozen=True)
class Answer:
    """The marks in use, their adjustment, by sensor its mount with covariance (6, 6), and words of warning."""

    placed: Placed
    snooped: SnoopingResult
    mounts: Mapping[str, tuple[Mounted, Array]]
    warnings: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Every mark with every other: nothing had to be left out."""
        return self.snooped.agrees and not self.snooped.suspects


def judge(marks: Marks, where: str, present: Mapping[str, Mounted]) -> Answer:
    """Refuse what cannot be meant, then adjust; ``present``: mounts that the session has."""
    placed = place(marks)
    turned = {name: mounted.R_body_from_sensor for name, mounted in present.items()}
    try:
        examine(placed, where, turned)
        snooped = snoop(placed.survey, list(placed.frames.values()))
    except NotConvergedError as error:
        raise NotConvergedError(f"{where}: {error}") from error
    warnings = examine_flat(placed, where, turned) if snooped.agrees else []
    mounts = {}
    for number, name in enumerate(placed.frames):
        if name != "body":
            R, lever_arm_m, covariance = relative_mount(snooped.last, 0, number)
            if np.abs(lever_arm_m).max() > FARTHEST_M:
                length = float(np.linalg.norm(lever_arm_m))
                raise ConfigError(f"{where}: {name}: lies {length:.0f} m from the INS; give all coordinates in m")
            mounts[name] = (Mounted(R, lever_arm_m), covariance)
            away = float(np.degrees(np.linalg.norm(log_so3(R @ turned[name].T)))) if name in turned else 0.0
            if away > NEAR_DEG:
                warnings.append(f"{name}.mount is {away:.0f}° from session.yaml's: see that no axis is turned round")
    return Answer(placed, snooped, mounts, tuple(warnings))


def blocks_of(answer: Answer, origin: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """By sensor, what session.yaml is to say."""
    return {name: block_of(mounted, covariance, origin) for name, (mounted, covariance) in answer.mounts.items()}


# --- in words --------------------------------------------------------------------------------------------------------
def _to_body_mm(answer: Answer) -> Array:
    return 1000 * answer.snooped.first.poses[0].R_survey_from_frame.T


def _residuals(answer: Answer) -> Iterator[tuple[str, str, Array, MarkTest | None]]:
    """With all marks: frame, mark, residual (3,) mm in body axes, and its test if an error of it would show."""
    found, to_body = answer.snooped.first, _to_body_mm(answer)
    tests = {(test.frame, test.mark): test for test in answer.snooped.tests}
    for number, (name, frame) in enumerate(answer.placed.frames.items()):
        if frame.axes is None:
            residuals = found.residuals_of(number, frame.points) @ to_body.T
            for mark, residual in zip(frame.marks.tolist(), residuals, strict=True):
                yield name, answer.placed.names[mark], residual, tests.get((number, mark))


def _normalised(test: MarkTest) -> float:
    """Near one where all is well."""
    return float(np.sqrt(test.statistic / test.rank))


def _named(answer: Answer, test: MarkTest) -> str:
    mark = answer.placed.names[test.mark]
    return f"{mark} (survey)" if test.frame == SURVEY else f"{mark} ({list(answer.placed.frames)[test.frame]})"


def _suspicions(answer: Answer) -> list[str]:
    """What does not agree, and what to do."""
    snooped = answer.snooped
    said = []
    for one in snooped.suspects:
        rivals = "".join(f" or {_named(answer, test)}" for test in one.rivals)
        which = " (which of them, the marks do not tell)" if one.rivals else ""
        said.append(f"mark {_named(answer, one.test)}{rivals} does not fit{which}")
    if not snooped.agrees:
        left = [test for test in snooped.last_tests if test.frame != SURVEY]
        likely = [test for test in left if test.ratio > 1] or left[:3]
        names = ", ".join(f"{_named(answer, test)} {_normalised(test):.1f}" for test in likely[:MOST_NAMED])
        said.append(
            f"{'still ' if said else ''}the marks do not agree, and which is wrong cannot be pinned: of three in a "
            f"frame none can, and sigmas that are too small look alike; worst first (normalised): {names}"
        )
    return said


def table(answer: Answer, present: Mapping[str, Mounted]) -> str:
    """For the screen."""
    lines: list[str] = []
    for name, (mounted, covariance) in answer.mounts.items():
        was = present[name].settings() if name in present else None
        sigma, settings = mounted.sigmas(covariance), mounted.settings()
        lines.append(f"{name + ' mount':<12}{'session':>12}{'coarse':>14}{'change':>14}{'sigma':>12}")
        for parameter, _, key, of_setting in PARAMETERS:
            unit = "°" if of_setting == "deg" else of_setting
            before = "-" if was is None else f"{was[key]:.4f} {unit}"
            change = "-" if was is None else f"{signed(setting_change(settings, was, key), 4)} {unit}"
            found = f"{settings[key]:.4f} {unit}"
            lines.append(f"{parameter:<12}{before:>12}{found:>14}{change:>14}{sigma[key]:>10.4f} {unit}")
        lines.append("")
    lines.append("Residuals in mm, survey minus drawing, body axes; normalised, and from where on suspicious:")
    for name, mark, residual, test in _residuals(answer):
        numbers = "".join(f"{signed(value, 1):>9}" for value in residual)
        seen = "" if test is None else f"{_normalised(test):>9.1f}{np.sqrt(test.limit / test.rank):>6.1f}"
        mark_ = "  suspicious" if test is not None and test.ratio > 1 else ""
        lines.append(f"  {name:<6}{mark:<14}{numbers}{seen or '  an error of it would not show'}{mark_}")
    lines += [_global_line(answer), *(f"But look: {warning}." for warning in answer.warnings)]
    for words in _suspicions(answer):
        lines.append(f"Wrong: {words}.")
    if not answer.agrees:
        which = "without the marks named" if answer.snooped.suspects else "with all marks"
        lines.append(f"The mounts above are {which}. Nothing is written: measure again, or use leave_out.")
    return "\n".join(lines)


def _global_line(answer: Answer) -> str:
    first = answer.snooped.first
    free, passed = first.redundancy, first.squares <= global_limit(first.redundancy)
    line = f"Global test: {first.squares:.1f}, limit {global_limit(free):.1f}, {free} degrees of freedom: "
    line += f"{'passed' if passed else 'failed'}. Variance factor {first.squares / free:.2f}"
    if free < CAUTIOUS:
        low, high = (float(chdtri(free, share)) / free for share in (0.975, 0.025))
        line += f" (of so few, {low:.2f} to {high:.2f} is chance)"
    return f"{line}."


def as_plain(answer: Answer, present: Mapping[str, Mounted]) -> dict[str, Any]:
    """All of it as plain values, for YAML."""
    first = answer.snooped.first
    tests = {
        "level": SIGNIFICANCE,
        "statistic": first.squares,
        "degrees_of_freedom": first.redundancy,
        "limit": global_limit(first.redundancy),
        "passed": first.squares <= global_limit(first.redundancy),
        "variance_factor": first.squares / first.redundancy,
    }
    mounts = {}
    for name, (mounted, covariance) in answer.mounts.items():
        settings, was = mounted.settings(), present[name].settings() if name in present else None
        mounts[name] = {
            "mount": settings,
            "sigma_mount": mounted.sigmas(covariance),
            "session": was,
            "change": None if was is None else {key: setting_change(settings, was, key) for key in settings},
            "R_body_from_sensor": mounted.R_body_from_sensor.tolist(),
            "covariance": covariance.tolist(),
        }
    residuals = [
        {"frame": name, "mark": mark, "residual_body_mm": residual.tolist()}
        | {"normalised": None if test is None else _normalised(test)}
        | {"suspicious": test is not None and test.ratio > 1}
        for name, mark, residual, test in _residuals(answer)
    ]
    found = {"agrees": answer.agrees, "wrong": _suspicions(answer), "warnings": list(answer.warnings)}
    return found | {"global_test": tests, "mounts": mounts, "residuals": residuals}
