"""The planes found, laser's and sonar's (with the coarse mount), cut out where the faces are; with their normals."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.target import FACES, PLANES
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import family_names, planes_of_sensor
from pipeline.maths.geometry.planes import Plane
from pipeline.run.results import Tables
from stages.views.recording import GREY, SONAR

SHOWN = {"laser": GREY, "mbes": SONAR}


def log(recording: Any, tables: Tables) -> None:
    import rerun as rr

    faces, planes = tables.table(FACES), tables.table(PLANES)
    for sensor, colour in SHOWN.items():
        found = planes_of_sensor(planes, sensor)
        for family in family_names(faces):
            plane = found.get((ALL_PASSES, family))
            if plane is None:
                continue
            cut = cut_out(faces, family, plane)
            starts = np.cumsum([0, *(len(one) for one in cut[:-1])])
            triangles = np.concatenate([_fan(one, int(start)) for one, start in zip(cut, starts, strict=True)])
            points = np.concatenate(cut).astype(np.float32)
            patch = rr.Mesh3D(vertex_positions=points, triangle_indices=triangles, albedo_factor=(*colour, 110))
            recording.log(f"planes/{sensor}/{family}", patch, static=True)
            arrow = rr.Arrows3D(origins=[plane.centroid_m], vectors=[plane.normal], radii=0.02, colors=colour)
            recording.log(f"planes/{sensor}/{family}/normal", arrow, static=True)
            tip = plane.centroid_m + plane.normal  # a label has its point's colour, on grey: white can be read
            name = rr.Points3D([tip], radii=0.001, colors=(255, 255, 255), labels=family)
            recording.log(f"planes/{sensor}/{family}/normal/name", name, static=True)


def cut_out(faces: pd.DataFrame, family: str, plane: Plane) -> list[np.ndarray]:
    """The family's faces by design, their corners moved along the plane's normal onto it."""
    corners = [np.reshape(one, (-1, 3)) for one in faces.loc[faces["family"] == family, "vertices_target_m"]]
    return [one + np.outer(plane.distance_m - one @ plane.normal, plane.normal) for one in corners]


def _fan(polygon: np.ndarray, start: int) -> np.ndarray:
    """Triangles of a convex polygon whose first corner is number ``start``."""
    return np.array([(start, start + k, start + k + 1) for k in range(1, len(polygon) - 1)], dtype=np.uint32)
