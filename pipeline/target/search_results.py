"""Results of the searches: the pose of the target, and the provisional mount of the sensor that is calibrated."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.target.model import TargetFrame
from pipeline.maths.target.registration import Refinement
from pipeline.mount import Mounted
from pipeline.target.rivals import BestRival

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LocatedTarget:
    """The pose of the target in the laser's points.

    Parameters
    ----------
    frame
        Rotation from the pool frame into the target frame, and the target's origin in the pool frame.
    azimuth_correction_rad
        True azimuth minus the configured one, clockwise.
    pose
        Fit of the azimuth and the origin.
    tilt
        Fit of a small rotation and a shift of the points, starting from that pose.
    rival
        The best rival, and whether it agrees with the points nearly as well, or better.
    gate_m
        Distance from a face up to which points are labelled.
    within
        Whether the pose lies within the limits of the search.
    pose_sigmas
        A-priori sigmas (4,) of the azimuth (rad) and the origin (m).
    """

    frame: TargetFrame
    azimuth_correction_rad: float
    pose: Refinement
    tilt: Refinement
    rival: BestRival
    gate_m: float
    within: bool
    pose_sigmas: Array


@dataclass(frozen=True)
class ProvisionalMount:
    """The mount for labelling, as a correction of the coarse mount.

    Parameters
    ----------
    rotation_vector_rad, lever_arm_correction_m
        Correction, (3,) each, body axes.
    scale_m
        Robust scale of the residuals.
    gate_m
        Distance from a face up to which points are labelled.
    score, rival_score
        Quality of this mount, and of the best rival.
    ambiguous
        Whether the rival is nearly as good.
    within
        Whether the correction lies within the limits of the search.
    label_change
        Share of the labels that the last provisional adjustment changed; NaN: none has corrected mount and trajectory.
    """

    rotation_vector_rad: Array
    lever_arm_correction_m: Array
    scale_m: float
    gate_m: float
    score: float
    rival_score: float
    ambiguous: bool
    within: bool
    label_change: float = float("nan")

    def total(self, coarse: Mounted) -> Mounted:
        """Return the coarse mount with the correction applied."""
        R_body_from_sensor = exp_so3(self.rotation_vector_rad) @ coarse.R_body_from_sensor
        return Mounted(R_body_from_sensor, coarse.lever_arm_body_m + self.lever_arm_correction_m)
