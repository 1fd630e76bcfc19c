"""Mirror-imaged drawings of marks. Marks in one plane do not show the error; the session's mount may show it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pipeline.coarse.frames import NEAR_DEG, Array, MarkFrames
from pipeline.errors import ConfigError
from pipeline.maths.geometry.rotations import log_so3
from pipeline.maths.survey.data_snooping import global_limit
from pipeline.maths.survey.frame_adjustment import adjust_frames
from pipeline.maths.survey.frames import MarkSurvey, RigidFrame

AXES = "xyz"
FAR_DEG = 90.0  # a mount farther than this from the session's mount is turned over
MIRRORED = "mirror-imaged (left-handed, or one axis with the wrong sign)"


@dataclass(frozen=True)
class AxisFlip:
    """Largest angle, in degrees, between mounts from marks and the session's, as drawn and with one axis reversed.

    Attributes
    ----------
    as_drawn_deg
        The angle with the drawing as it stands.
    axis
        The axis of the drawing whose reversal brings the mounts nearest to the session's.
    reversed_deg
        The angle with that axis reversed.
    """

    as_drawn_deg: float
    axis: str
    reversed_deg: float

    @property
    def explains(self) -> bool:
        """Whether the mounts are right with the axis reversed."""
        return self.reversed_deg < NEAR_DEG


def mirrored(frame: RigidFrame, axis: int) -> RigidFrame:
    """Return the frame with the sign of one of its drawing's axes changed."""
    return replace(frame, drawing_m=frame.drawing_m * np.where(np.arange(3) == axis, -1.0, 1.0))


def is_flat(survey: MarkSurvey, frame: RigidFrame) -> bool:
    """Return whether all marks lie so nearly in one plane that a mirror image would not show.

    The mirror image is the drawing with its distances h from that plane changed in sign. It raises Ω, the weighted sum
    of squared residuals, by no more than 4 Σ h² / σ².
    """
    variance = float(np.trace(survey.covariance[frame.marks] + frame.covariance, axis1=1, axis2=2).mean()) / 3
    thickness = np.linalg.svd(frame.drawing_m - frame.drawing_m.mean(axis=0), compute_uv=False)[-1]
    return bool(4 * thickness**2 / variance <= global_limit(3 * len(frame.marks) - 6))


def nearest_flip(frames: MarkFrames, name: str, R_present: Mapping[str, Array]) -> AxisFlip | None:
    """Return the axis of a drawing whose reversal brings the mounts nearest to the session's, with the angles.

    Return None if the session has no mount of the sensor (for the body's drawing: of any sensor).

    Parameters
    ----------
    frames
        The marks in use.
    name
        The frame whose drawing is tried.
    R_present
        By sensor R_body_from_sensor (3, 3) of the session's mount.
    """
    sensors = [sensor for sensor in R_present if sensor in frames.by_name and name in ("body", sensor)]
    if not sensors:
        return None

    def R_survey_from(frame: RigidFrame) -> Array:
        return adjust_frames(frames.survey, [frame]).poses[0].R_survey_from_frame

    as_drawn = {frame: R_survey_from(frames.by_name[frame]) for frame in ("body", *sensors)}

    def largest_angle_deg(R: Mapping[str, Array]) -> float:
        turns = [log_so3(R["body"].T @ R[sensor] @ R_present[sensor].T) for sensor in sensors]
        return max(float(np.degrees(np.linalg.norm(turn))) for turn in turns)

    flips = [
        (largest_angle_deg(as_drawn | {name: R_survey_from(mirrored(frames.by_name[name], axis))}), AXES[axis])
        for axis in range(3)
    ]
    nearest = min(flips)
    return AxisFlip(largest_angle_deg(as_drawn), nearest[1], nearest[0])


def axis_hint(flip: AxisFlip | None) -> str:
    """Return a hint, in brackets, that names the reversed axis of a drawing if the session's mount shows it."""
    if flip is None or not flip.explains:
        return " (any one of them turned makes it right-handed)"
    return f" (with the sign of {flip.axis} changed the mount is {flip.reversed_deg:.1f}° from session.yaml's)"


def check_flat_frames(frames: MarkFrames, where: str, R_present: Mapping[str, Array]) -> list[str]:
    """Return a warning for each frame whose marks lie in one plane: its mirror image, turned over, fits as well.

    Parameters
    ----------
    frames
        The marks in use.
    where
        The file of the marks, for errors.
    R_present
        By sensor R_body_from_sensor (3, 3) of the session's mount.

    Raises
    ------
    ConfigError
        The session's mount shows that the drawing is a mirror image.
    """
    warnings = []
    for name, frame in frames.by_name.items():
        if frame.axes is not None or not is_flat(frames.survey, frame):
            continue
        flip = nearest_flip(frames, name, R_present)
        if flip is not None and flip.as_drawn_deg > FAR_DEG and flip.explains:
            raise ConfigError(
                f"{where}: {name}.marks: the drawing is {MIRRORED}: as it stands the mount is "
                f"{flip.as_drawn_deg:.0f}° from session.yaml's; check its axes{axis_hint(flip)}"
            )
        seems = flip is not None and flip.as_drawn_deg > NEAR_DEG and flip.explains
        axis = axis_hint(flip) if seems else ""
        warnings.append(f"{name}.marks lie in one plane: a mirror-imaged drawing would not show{axis}")
    return warnings
