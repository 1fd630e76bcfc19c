"""Marks of a survey, and the rigid frames that are placed in it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
STARBOARD, FORWARD = 0, 1  # the axes of the body that may run through two marks


@dataclass(frozen=True)
class MarkSurvey:
    """Marks in survey axes, z up: at_m (m, 3), covariance (m, 3, 3) m²; the marks are independent of each other."""

    at_m: Array
    covariance: Array


@dataclass(frozen=True)
class FrameAxis:
    """An axis of a frame that runs through two of its marks, and the INS's reading of the attitude about the axis.

    Parameters
    ----------
    along
        STARBOARD or FORWARD.
    first, second
        Numbers of the marks within the frame; the axis runs from the first to the second.
    angle_rad, sigma_rad
        The reading and its sigma: roll for FORWARD, pitch for STARBOARD.
    """

    along: int
    first: int
    second: int
    angle_rad: float
    sigma_rad: float


@dataclass(frozen=True)
class RigidFrame:
    """A rigid frame and its marks.

    Parameters
    ----------
    marks
        Numbers (k,) of the marks in the survey.
    drawing_m, covariance
        Places (k, 3) of the marks and their covariance (k, 3, 3) m² by the drawing, in the frame's own axes.
    axes
        Definition of the frame by axes. With it only the first mark, the origin, has a place in the drawing: zero.
    """

    marks: Integers
    drawing_m: Array
    covariance: Array
    axes: FrameAxis | None = None

    @property
    def points(self) -> int:
        """Return the number of marks that have residuals: all, or for a frame with axes only the origin."""
        return len(self.marks) if self.axes is None else 1

    def without(self, place: int) -> "RigidFrame":
        """Return the frame without its mark number ``place``."""
        kept = np.delete(np.arange(len(self.marks)), place)
        return replace(self, marks=self.marks[kept], drawing_m=self.drawing_m[kept], covariance=self.covariance[kept])


@dataclass(frozen=True)
class FramePose:
    """R_survey_from_frame (3, 3), and the frame's origin in the survey (3,) m."""

    R_survey_from_frame: Array
    origin_m: Array

    def updated(self, step: Array) -> "FramePose":
        """Return the pose after a step (6,): rotation vector η in survey axes, shift of the origin (m)."""
        return FramePose(exp_so3(step[:3]) @ self.R_survey_from_frame, self.origin_m + step[3:])
