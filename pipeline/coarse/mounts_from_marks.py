"""Coarse mounts of the sensors, adjusted from surveyed marks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.coarse.drawing_errors import check_frames
from pipeline.coarse.frames import NEAR_DEG, MarkFrames, frames_of_marks
from pipeline.coarse.mirror_images import check_flat_frames
from pipeline.coarse.session_file import mount_block
from pipeline.config.marks import Marks
from pipeline.errors import ConfigError, NotConvergedError
from pipeline.maths.geometry.rotations import log_so3
from pipeline.maths.survey.data_snooping import SnoopingResult, snoop
from pipeline.maths.survey.frame_adjustment import relative_mount
from pipeline.mount import Mounted

Array = NDArray[np.float64]
FARTHEST_M = 100.0  # largest component of a lever arm that session.yaml accepts


@dataclass(frozen=True)
class MarksAssessment:
    """Coarse mounts, and the adjustment that they come from.

    Attributes
    ----------
    frames
        The marks in use.
    snooped
        The adjustment of the marks and its tests.
    mounts
        By sensor its mount, with covariance (6, 6) in the order of CONVENTIONS.md.
    warnings
        Sentences about doubts that do not stop the program.
    """

    frames: MarkFrames
    snooped: SnoopingResult
    mounts: Mapping[str, tuple[Mounted, Array]]
    warnings: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether every mark agrees with every other, so that none had to be left out."""
        return self.snooped.agrees and not self.snooped.suspects


def assess_marks(marks: Marks, where: str, present: Mapping[str, Mounted]) -> MarksAssessment:
    """Return the coarse mounts that follow from the marks, with the adjustment.

    Parameters
    ----------
    marks
        Marks of the survey and of the drawings.
    where
        The file of the marks, for errors.
    present
        By sensor the mount in session.yaml.

    Raises
    ------
    ConfigError, DegenerateGeometryError
        A drawing or the survey has an error, or the marks do not determine a mount.
    NotConvergedError
        The adjustment does not converge.
    """
    frames = frames_of_marks(marks)
    R_present = {name: mounted.R_body_from_sensor for name, mounted in present.items()}
    try:
        check_frames(frames, where, R_present)
        snooped = snoop(frames.survey, list(frames.by_name.values()))
    except NotConvergedError as error:
        raise NotConvergedError(f"{where}: {error}") from error
    warnings = check_flat_frames(frames, where, R_present) if snooped.agrees else []
    mounts = {}
    for number, name in enumerate(frames.by_name):
        if name != "body":
            R, lever_arm_m, covariance = relative_mount(snooped.last, 0, number)
            if np.abs(lever_arm_m).max() > FARTHEST_M:
                length = float(np.linalg.norm(lever_arm_m))
                raise ConfigError(f"{where}: {name}: lies {length:.0f} m from the INS; give all coordinates in m")
            mounts[name] = (Mounted(R, lever_arm_m), covariance)
            away = float(np.degrees(np.linalg.norm(log_so3(R @ R_present[name].T)))) if name in R_present else 0.0
            if away > NEAR_DEG:
                warnings.append(f"{name}.mount is {away:.0f}° from session.yaml's: see that no axis is turned round")
    return MarksAssessment(frames, snooped, mounts, tuple(warnings))


def mount_blocks(assessment: MarksAssessment, origin: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return by sensor the keys to write into session.yaml; ``origin``: the source of the mounts."""
    return {name: mount_block(mounted, covariance, origin) for name, (mounted, covariance) in assessment.mounts.items()}
