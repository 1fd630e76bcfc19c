"""Marks of a survey and of drawings as frames to be adjusted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.marks import Mark, Marks, Sigmas
from pipeline.maths.survey.frames import FORWARD, STARBOARD, FrameAxis, MarkSurvey, RigidFrame

Array = NDArray[np.float64]
NEAR_DEG = 30.0  # a mount within this angle of the session's mount is right


@dataclass(frozen=True)
class MarkFrames:
    """Marks in use, and the frames that are drawn with them.

    Attributes
    ----------
    mark_names
        Names of the survey's marks in use, in the survey's order.
    survey
        Surveyed coordinates of these marks.
    by_name
        The frames by name, the body first.
    """

    mark_names: tuple[str, ...]
    survey: MarkSurvey
    by_name: Mapping[str, RigidFrame]


def frames_of_marks(marks: Marks) -> MarkFrames:
    """Return the frames with the marks in use: marks that a frame names, without the marks in ``leave_out``."""
    wanted = {name for names in marks.named.values() for name in names} - set(marks.leave_out)
    names = tuple(name for name in marks.survey.marks if name in wanted)
    surveyed = [marks.survey.marks[name] for name in names]
    sigmas = np.array([mark.sigma_m or marks.survey.sigma_m for mark in surveyed]).reshape(-1, 3)
    survey = MarkSurvey(np.array([mark.at for mark in surveyed]).reshape(-1, 3), _diagonal(sigmas))
    number = {name: k for k, name in enumerate(names)}
    body = marks.body
    frames = {"body": _by_axes(marks, number) if body.marks is None else _by_marks(body.marks, body.sigma_m, number)}
    frames |= {name: _by_marks(sensor.marks, sensor.sigma_m, number) for name, sensor in marks.sensors.items()}
    return MarkFrames(names, survey, frames)


def _by_marks(marks: Mapping[str, Mark], sigma_m: Sigmas, number: Mapping[str, int]) -> RigidFrame:
    used = {name: mark for name, mark in marks.items() if name in number}
    sigmas = np.array([mark.sigma_m or sigma_m for mark in used.values()]).reshape(-1, 3)
    at = np.array([mark.at for mark in used.values()]).reshape(-1, 3)
    return RigidFrame(np.array([number[name] for name in used], dtype=np.int64), at, _diagonal(sigmas))


def _by_axes(marks: Marks, number: Mapping[str, int]) -> RigidFrame:
    axes = marks.body.axes
    assert axes is not None
    pair = axes.forward or axes.starboard or ()
    used = list(dict.fromkeys([axes.origin, *pair]))
    first, second = (used.index(name) for name in pair)
    along, angle, sigma = FORWARD, axes.roll_deg, axes.roll_sigma_deg
    if axes.forward is None:
        along, angle, sigma = STARBOARD, axes.pitch_deg, axes.pitch_sigma_deg
    level = FrameAxis(along, first, second, float(np.radians(angle or 0.0)), float(np.radians(sigma)))
    sigmas = np.tile(marks.body.sigma_m, (len(used), 1))
    return RigidFrame(np.array([number[name] for name in used]), np.zeros((len(used), 3)), _diagonal(sigmas), level)


def _diagonal(sigmas_m: Array) -> Array:
    return np.asarray(np.eye(3) * (sigmas_m**2)[:, None, :])
