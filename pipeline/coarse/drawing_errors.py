"""Errors of drawings and surveys of marks, named before any result: units, mirror images, interchanged names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.special import fdtri

from pipeline.coarse.frames import AXES, FAR_DEG, NEAR_DEG, NEAR_ONE, NEAR_UNIT, Array, Placed
from pipeline.console import plural
from pipeline.errors import ConfigError, DegenerateGeometryError
from pipeline.maths.geometry.rotations import log_so3
from pipeline.maths.survey.data_snooping import LINE_RAD, SIGNIFICANCE, fit_of_frame, global_limit, sigma_about_line
from pipeline.maths.survey.frame_adjustment import Frame, Survey, adjust_frames, closed_form

UNITS = {"mm": 1000.0, "cm": 100.0, "inches": 1 / 0.0254, "feet": 1 / 0.3048}  # how many of them are a metre


STEEPEST_DEG = 60.0  # of an axis through two marks: the vertical must give the turn about it


LIKELY = 3  # pairs of names that are tried in full


MIRRORED = "mirror-imaged (left-handed, or one axis with the wrong sign)"


def examine(placed: Placed, where: str, present: Mapping[str, Array]) -> None:
    """Refuse what cannot be meant; ``present``: R_body_from_sensor of the session's mounts, to name an axis by."""
    for name, frame in placed.frames.items():
        if frame.axes is not None:
            _refuse_axes(placed, frame, f"{where}: body.axes")
            continue
        key = f"{where}: {name}.marks"
        count = len(frame.marks)
        if count < 3:
            few = plural(count, "usable mark")
            raise DegenerateGeometryError(f"{key}: {few}, and a rotation takes three; survey more")
        sigma = np.degrees(sigma_about_line(placed.survey, frame))
        if not sigma <= np.degrees(LINE_RAD):
            known = f"known to {sigma:.0f}° only" if sigma < 90 else "not determined"
            raise DegenerateGeometryError(
                f"{key}: all {count} lie nearly in a line, and the turn about it is {known}; add a mark well off it"
            )
    for name, frame in placed.frames.items():
        if frame.axes is None:
            _refuse_units(placed.survey, frame, f"{where}: {name}")
    for name, frame in placed.frames.items():
        if frame.axes is None:
            _refuse_misfit(placed, name, f"{where}: {name}.marks", present)


def _refuse_axes(placed: Placed, frame: Frame, key: str) -> None:
    axes = frame.axes
    assert axes is not None
    pair = frame.marks[[axes.first, axes.second]]
    names = " and ".join(placed.names[k] for k in pair)
    d = np.diff(placed.survey.at_m[pair], axis=0)[0]
    length = float(np.linalg.norm(d))
    variance = float(np.trace(placed.survey.covariance[pair].sum(axis=0) + 2 * frame.covariance[0])) / 3
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


def _refuse_units(survey: Survey, frame: Frame, key: str) -> None:
    """Spread of the drawing over that of the survey (root mean square: no rotation changes it, nor names)."""
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


def _refuse_misfit(placed: Placed, name: str, key: str, present: Mapping[str, Array]) -> None:
    """Where a frame does not fit, but its mirror image or with two names interchanged it clearly does: quotient of the
    two Ω beyond F at SIGNIFICANCE. Of several such explanations those are said that fit as well as the best. Where
    leaving out one mark explains it too, names must explain it in full."""
    frame, survey = placed.frames[name], placed.survey
    squares, redundancy = fit_of_frame(survey, frame)
    if squares <= global_limit(redundancy):
        return
    far = float(fdtri(redundancy, redundancy, 1 - SIGNIFICANCE))
    enough = squares / far if np.isfinite(squares) else global_limit(redundancy)
    tried = {pair: fit_of_frame(survey, swap(frame, *pair))[0] for pair in _likely_pairs(survey, frame)}
    better = {pair: left for pair, left in tried.items() if left < enough}
    if any(left > global_limit(redundancy) for left in better.values()) and _one_explains_it(survey, frame):
        better = {pair: left for pair, left in better.items() if left <= global_limit(redundancy)}
    mirrored = np.inf if is_flat(survey, frame) else fit_of_frame(survey, mirror(frame, 0))[0]
    if mirrored < enough:
        better[()] = mirrored
    if not better:
        return
    best = min(better.values())
    said = [pair for pair, left in better.items() if left <= max(global_limit(redundancy), best)]
    pairs = ", or ".join(" and ".join(placed.names[frame.marks[k]] for k in pair) for pair in said if pair)
    words = []
    if () in said:
        words.append(f"the drawing is {MIRRORED}: check its axes{_which_axis(flips(placed, name, present))}")
    if pairs:
        words.append(f"marks {pairs} may be interchanged: check the names in the survey and in the drawing")
    raise ConfigError(f"{key}: {'; or '.join(words)}; so all fit far better than as they stand")


def _one_explains_it(survey: Survey, frame: Frame) -> bool:
    """Whether all but some one mark fit."""
    count = len(frame.marks)
    limit = global_limit(3 * count - 9)
    return count > 3 and any(fit_of_frame(survey, frame.without(k))[0] <= limit for k in range(count))


def _likely_pairs(survey: Survey, frame: Frame) -> Sequence[tuple[int, ...]]:
    """The pairs that, interchanged, leave least to the closed form."""
    at, weight = survey.at_m[frame.marks], np.ones(len(frame.marks))

    def left(pair: tuple[int, ...]) -> float:
        drawing = swap(frame, *pair).drawing_m
        R, t = closed_form(drawing, at, weight)
        return float(np.sum((at - drawing @ R.T - t) ** 2))

    return sorted(combinations(range(len(frame.marks)), 2), key=left)[:LIKELY]


def swap(frame: Frame, one: int, other: int) -> Frame:
    """Two marks interchanged in the drawing."""
    order = np.arange(len(frame.marks))
    order[[one, other]] = other, one
    return replace(frame, drawing_m=frame.drawing_m[order])


def mirror(frame: Frame, axis: int) -> Frame:
    """The drawing with the sign of one axis changed."""
    return replace(frame, drawing_m=frame.drawing_m * np.where(np.arange(3) == axis, -1.0, 1.0))


def is_flat(survey: Survey, frame: Frame) -> bool:
    """All marks so nearly in one plane that a mirror image would not show: it is the drawing with its distances h from
    that plane changed in sign, which raises Ω by no more than 4 Σ h² / σ²."""
    variance = float(np.trace(survey.covariance[frame.marks] + frame.covariance, axis1=1, axis2=2).mean()) / 3
    thickness = np.linalg.svd(frame.drawing_m - frame.drawing_m.mean(axis=0), compute_uv=False)[-1]
    return bool(4 * thickness**2 / variance <= global_limit(3 * len(frame.marks) - 6))


@dataclass(frozen=True)
class Flips:
    """Largest angle (degrees) between the session's mounts and those found; and with one axis of a drawing turned."""

    as_drawn_deg: float
    axis: str
    turned_deg: float

    @property
    def telling(self) -> bool:
        return self.turned_deg < NEAR_DEG


def flips(placed: Placed, name: str, present: Mapping[str, Array]) -> Flips | None:
    """Of a frame's drawing; None where the session has no mount that depends on it."""
    sensors = [one for one in present if one in placed.frames and name in ("body", one)]
    if not sensors:
        return None

    def turned(frame: Frame) -> Array:
        return adjust_frames(placed.survey, [frame]).poses[0].R_survey_from_frame

    as_drawn = {one: turned(placed.frames[one]) for one in ("body", *sensors)}

    def away_deg(R: Mapping[str, Array]) -> float:
        turns = [log_so3(R["body"].T @ R[one] @ present[one].T) for one in sensors]
        return max(float(np.degrees(np.linalg.norm(turn))) for turn in turns)

    by_axis = [(away_deg(as_drawn | {name: turned(mirror(placed.frames[name], k))}), AXES[k]) for k in range(3)]
    nearest = min(by_axis)
    return Flips(away_deg(as_drawn), nearest[1], nearest[0])


def _which_axis(flipped: Flips | None) -> str:
    if flipped is None or not flipped.telling:
        return " (any one of them turned makes it right-handed)"
    return f" (with the sign of {flipped.axis} changed the mount is {flipped.turned_deg:.1f}° from session.yaml's)"


def examine_flat(placed: Placed, where: str, present: Mapping[str, Array]) -> list[str]:
    """Of marks in one plane the mirror image fits as well, turned over: refused where the session's mount says that it
    is one, and otherwise a word of warning."""
    said = []
    for name, frame in placed.frames.items():
        if frame.axes is not None or not is_flat(placed.survey, frame):
            continue
        flipped = flips(placed, name, present)
        if flipped is not None and flipped.as_drawn_deg > FAR_DEG and flipped.telling:
            raise ConfigError(
                f"{where}: {name}.marks: the drawing is {MIRRORED}: as it stands the mount is "
                f"{flipped.as_drawn_deg:.0f}° from session.yaml's; check its axes{_which_axis(flipped)}"
            )
        seems = flipped is not None and flipped.as_drawn_deg > NEAR_DEG and flipped.telling
        axis = _which_axis(flipped) if seems else ""
        said.append(f"{name}.marks lie in one plane: a mirror-imaged drawing would not show{axis}")
    return said
