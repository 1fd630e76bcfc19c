"""Functions that the three searches share: planes of the faces, labels during a refinement, and the final gate."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import LabelSettings, label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.registration import FacePlanes, Labeller, Refinement

Array = NDArray[np.float64]
SCORE_REACH_M = 0.06  # m: points farther from the surface count nothing in the final score
REFINEMENT_GATE_M = 0.08  # gate while the pose or the mount is still being refined
GATE_SCALES = 5  # the final gate, in robust scales of the labelled points' distances


def planes_of_faces(model: TargetModel) -> FacePlanes:
    """Return the planes of the target's faces."""
    normals = np.array([face.normal for face in model.faces])
    return FacePlanes(normals, np.array([face.distance_m for face in model.faces]))


def dry_labeller(model: TargetModel, settings: Segment) -> Labeller:
    """Return a function that labels the laser's points above the water without knowing their rays."""
    limits = LabelSettings(REFINEMENT_GATE_M, settings.margin_m, min_grazing_rad=0.0, seen="dry")

    def label(_: Array, points: Array) -> NDArray[np.int16]:
        above = points[:, 2] > model.water_level_m + settings.water_margin_m
        labels = label_points(model, points, TargetBeams.head_on(len(points)), limits)
        return np.where(above, labels.face, -1).astype(np.int16)

    return label


def gate_of(refined: Refinement, settings: Segment) -> float:
    """Return the gate (m) for labelling: the configured one, or five robust scales of the noise if that is more."""
    return max(settings.gate_m, GATE_SCALES * refined.scale_m) if np.isfinite(refined.scale_m) else settings.gate_m
