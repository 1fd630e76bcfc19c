"""Errors in drawings and surveys of marks, refused before there is any result.

A frame is refused if it has fewer than three marks, if its marks lie in a line, or if its drawing has other units, is
mirror-imaged or has names interchanged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.special import fdtri

from pipeline.coarse.frames import Array, MarkFrames
from pipeline.coarse.mirror_images import MIRRORED, axis_hint, is_flat, mirrored, nearest_flip
from pipeline.console import plural
from pipeline.errors import ConfigError, DegenerateGeometryError
from pipeline.maths.survey.data_snooping import LINE_RAD, SNOOPING_LEVEL, fit_of_frame, global_limit, sigma_about_line
from pipeline.maths.survey.frame_adjustment import closed_form
from pipeline.maths.survey.frames import MarkSurvey, RigidFrame

UNITS = {"mm": 1000.0, "cm": 100.0, "inches": 1 / 0.0254, "feet": 1 / 0.3048}  # number of units in a metre
NEAR_UNIT, NEAR_ONE = 0.05, 0.4  # limits of |ln(drawn size / surveyed)| about another unit's value, about 0
STEEPEST_DEG = 60.0  # of an axis through two marks: the vertical must determine the turn about it
LIKELY = 3  # pairs of names that are tried with a full adjustment


def check_frames(frames: MarkFrames, where: str, R_present: Mapping[str, Array]) -> None:
    """Refuse frames whose drawing or survey has an error.

    Parameters
    ----------
    frames
        The marks in use.
    where
        The file of the marks, for errors.
    R_present
        By sensor R_body_from_sensor (3, 3) of the session's mount. It shows which axis of a drawing is reversed.

    Raises
    ------
    DegenerateGeometryError
        The marks do not determine a frame's rotation.
    ConfigError
        A drawing is in other units, mirror-imaged, or has names interchanged.
    """
    for name, frame in frames.by_name.items():
        if frame.axes is not None:
            _refuse_axes(frames, frame, f"{where}: body.axes")
            continue
        key = f"{where}: {name}.marks"
        count = len(frame.marks)
        if count < 3:
            few = plural(count, "usable mark")
            raise DegenerateGeometryError(f"{key}: {few}, and a rotation takes three; survey more")
        sigma = np.degrees(sigma_about_line(frames.survey, frame))
        if not sigma <= np.degrees(LINE_RAD):
            known = f"known to {sigma:.0f}° only" if sigma < 90 else "not determined"
            raise DegenerateGeometryError(
                f"{key}: all {count} lie nearly in a line, and the turn about it is {known}; add a mark well off it"
            )
    for name, frame in frames.by_name.items():
        if frame.axes is None:
            _refuse_units(frames.survey, frame, f"{where}: {name}")
    for name, frame in frames.by_name.items():
        if frame.axes is None:
            _refuse_misfit(frames, name, f"{where}: {name}.marks", R_present)


def _refuse_axes(frames: MarkFrames, frame: RigidFrame, key: str) -> None:
    axes = frame.axes
    assert axes is not None
    pair = frame.marks[[axes.first, axes.second]]
    names = " and ".join(frames.mark_names[k] for k in pair)
    d = np.diff(frames.survey.at_m[pair], axis=0)[0]
    length = float(np.linalg.norm(d))
    variance = float(np.trace(frames.survey.covariance[pair].sum(axis=0) + 2 * frame.covariance[0])) / 3
    if np.sqrt(variance) > LINE_RAD * length:
        raise DegenerateGeometryError(
            f"{key}: {names} are {1000 * length:.0f} mm apart, too near to give a direction; name marks farther apart"
        )
    steep = np.degrees(np.arcsin(min(abs(float(d[2])) / length, 1.0)))
    if steep > STEEPEST_DEG:
        raise DegenerateGeometryError(
            f"{key}: the line from {names} rises by {steep:.0f}°, so that no level tells the turn about it; name marks "
            "along the boat's axis, and see that the survey's z is up"
        )


def _refuse_units(survey: MarkSurvey, frame: RigidFrame, key: str) -> None:
    """Refuse a drawing whose size differs from the survey's.

    The size is the root mean square of the marks' distances from their centre. It does not depend on the rotation or on
    the marks' names.
    """
    drawn, measured = (
        float(np.sqrt(np.mean(np.sum((at - at.mean(axis=0)) ** 2, axis=1))))
        for at in (frame.drawing_m, survey.at_m[frame.marks])
    )
    size = float(np.log(drawn / max(measured, 1e-9)))
    for unit, number in UNITS.items():
        for whose, sign in (("its drawing's", 1.0), ("the survey's", -1.0)):
            if abs(size - sign * np.log(number)) < NEAR_UNIT:
                raise ConfigError(f"{key}: {whose} coordinates seem to be in {unit}; give all in m")
    if abs(size) > NEAR_ONE:
        raise ConfigError(
            f"{key}: its drawing is {np.exp(size):.3g} times as large as the survey says; check units and coordinates"
        )


def _refuse_misfit(frames: MarkFrames, name: str, key: str, R_present: Mapping[str, Array]) -> None:
    """Refuse a frame that does not fit, if its mirror image or two interchanged names fit clearly better.

    Ω is the weighted sum of squared residuals. A fit is clearly better if the quotient of the two Ω exceeds the limit
    of F at SNOOPING_LEVEL. The error names the best explanation, and all that pass the global test. If leaving out one
    mark explains the misfit too, interchanged names count only if they pass the global test.
    """
    frame, survey = frames.by_name[name], frames.survey
    squares, redundancy = fit_of_frame(survey, frame)
    if squares <= global_limit(redundancy):
        return
    far = float(fdtri(redundancy, redundancy, 1 - SNOOPING_LEVEL))
    enough = squares / far if np.isfinite(squares) else global_limit(redundancy)
    tried = {pair: fit_of_frame(survey, interchanged(frame, *pair))[0] for pair in _likely_pairs(survey, frame)}
    better = {pair: left for pair, left in tried.items() if left < enough}
    if any(left > global_limit(redundancy) for left in better.values()) and _fits_without_one(survey, frame):
        better = {pair: left for pair, left in better.items() if left <= global_limit(redundancy)}
    squares_mirrored = np.inf if is_flat(survey, frame) else fit_of_frame(survey, mirrored(frame, 0))[0]
    if squares_mirrored < enough:
        better[()] = squares_mirrored
    if not better:
        return
    best = min(better.values())
    named = [pair for pair, left in better.items() if left <= max(global_limit(redundancy), best)]
    pairs = ", or ".join(" and ".join(frames.mark_names[frame.marks[k]] for k in pair) for pair in named if pair)
    words = []
    if () in named:
        words.append(f"the drawing is {MIRRORED}: check its axes{axis_hint(nearest_flip(frames, name, R_present))}")
    if pairs:
        words.append(f"marks {pairs} may be interchanged: check the names in the survey and in the drawing")
    raise ConfigError(f"{key}: {'; or '.join(words)}; so all fit far better than as they stand")


def _fits_without_one(survey: MarkSurvey, frame: RigidFrame) -> bool:
    """Return whether the frame fits without one of its marks."""
    count = len(frame.marks)
    limit = global_limit(3 * count - 9)
    return count > 3 and any(fit_of_frame(survey, frame.without(k))[0] <= limit for k in range(count))


def _likely_pairs(survey: MarkSurvey, frame: RigidFrame) -> Sequence[tuple[int, ...]]:
    """Return the LIKELY pairs of marks whose interchange leaves the smallest residuals in the closed-form solution."""
    at, weight = survey.at_m[frame.marks], np.ones(len(frame.marks))

    def left(pair: tuple[int, ...]) -> float:
        drawing = interchanged(frame, *pair).drawing_m
        R, t = closed_form(drawing, at, weight)
        return float(np.sum((at - drawing @ R.T - t) ** 2))

    return sorted(combinations(range(len(frame.marks)), 2), key=left)[:LIKELY]


def interchanged(frame: RigidFrame, first: int, second: int) -> RigidFrame:
    """Return the frame with two marks interchanged in its drawing; ``first``, ``second``: their places in the frame."""
    order = np.arange(len(frame.marks))
    order[[first, second]] = second, first
    return replace(frame, drawing_m=frame.drawing_m[order])
