"""Parts that the three searches share: the planes of the faces, labels while a pose is refined, and the final gate."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.target.beams import Beams
from pipeline.maths.target.labelling import LabelSettings, label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.registration import FacePlanes, Labeller, Refinement

Array = NDArray[np.float64]
SCORE_REACH_M = 0.06  # reach of the final score
REFINEMENT_GATE_M = 0.08  # gate while the pose or the mount is still being refined
GATE_SCALES = 5  # the final gate, in robust scales of what was labelled


def planes_of_faces(model: TargetModel) -> FacePlanes:
    """Return the planes of the target's faces."""
    normals = np.array([face.normal for face in model.faces])
    return FacePlanes(normals, np.array([face.distance_m for face in model.faces]))


def dry_labeller(model: TargetModel, settings: Segment) -> Labeller:
    """Return the function that labels the laser's points above the water, while their rays are unknown."""
    limits = LabelSettings(REFINEMENT_GATE_M, settings.margin_m, min_grazing_rad=0.0, seen="dry")

    def label(_: Array, points: Array) -> NDArray[np.int16]:
        above = points[:, 2] > model.water_level_m + settings.water_margin_m
        labels = label_points(model, points, Beams.head_on(len(points)), limits)
        return np.where(above, labels.face, -1).astype(np.int16)

    return label


def gate_of(refined: Refinement, settings: Segment) -> float:
    """Return the distance from a face up to which points are labelled: so wide that the noise is not cut into."""
    return max(settings.gate_m, GATE_SCALES * refined.scale_m) if np.isfinite(refined.scale_m) else settings.gate_m
