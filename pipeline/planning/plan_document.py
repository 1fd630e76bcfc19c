"""The assessment of a plan as plain values, for the YAML file that ``poolcal plan`` writes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.mount import mount_of
from pipeline.planning.assessment import Accuracy, PlanAssessment
from pipeline.planning.setting import PredictionSetting

Array = NDArray[np.float64]


def plan_document(assessment: PlanAssessment) -> dict[str, Any]:
    """Return the whole assessment of a plan as plain values."""
    document: dict[str, Any] = {"given": _plain_accuracy(assessment.setting, assessment.given)}
    document |= {"gaps": assessment.gaps, "weakest": assessment.weakest, "remedy": assessment.remedy}
    if assessment.better is not None:
        document["better"] = _plain_accuracy(assessment.setting, assessment.better)
    return document


def _plain_accuracy(setting: PredictionSetting, accuracy: Accuracy) -> dict[str, Any]:
    mounted = mount_of(setting.mbes.mount)
    known = not accuracy.solution.deficiency
    sigma = np.sqrt(np.diag(accuracy.random))
    return {
        "passes": [
            planned.model_dump(mode="json", exclude_none=True)
            | {"seconds": round(seconds, 1), "points": _points_by_face(setting, points)}
            for planned, seconds, points in accuracy.each()
        ],
        "sigma_mount": mounted.sigmas(accuracy.random) if known else None,
        "sigma_mount_total": mounted.sigmas(accuracy.total) if known else None,
        "correlation": (accuracy.random / np.outer(sigma, sigma)).tolist() if known else None,
        "condition": accuracy.solution.condition if known else None,
    }


def _points_by_face(setting: PredictionSetting, points: dict[str, Array]) -> dict[str, dict[str, int]]:
    """Return the number of points by sensor and name of face. Faces without points are left out."""
    return {
        sensor: {face.name: round(float(n)) for face, n in zip(setting.model.faces, count, strict=True) if n}
        for sensor, count in points.items()
    }
