"""Stage fit_planes: the planes of laser and sonar (with the coarse mount), cut to the faces, and their normals."""

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
    """Log the planes of both sensors with their normals."""
    import rerun as rr

    faces, planes = tables.table(FACES), tables.table(PLANES)
    for sensor, colour in SHOWN.items():
        fitted = planes_of_sensor(planes, sensor)
        for family in family_names(faces):
            plane = fitted.get((ALL_PASSES, family))
            if plane is None:
                continue
            polygons = faces_on_plane(faces, family, plane)
            starts = np.cumsum([0, *(len(polygon) for polygon in polygons[:-1])])
            triangles = np.concatenate([_fan(*pair) for pair in zip(polygons, starts.tolist(), strict=True)])
            points = np.concatenate(polygons).astype(np.float32)
            patch = rr.Mesh3D(vertex_positions=points, triangle_indices=triangles, albedo_factor=(*colour, 110))
            recording.log(f"planes/{sensor}/{family}", patch, static=True)
            arrow = rr.Arrows3D(origins=[plane.centroid_m], vectors=[plane.normal], radii=0.02, colors=colour)
            recording.log(f"planes/{sensor}/{family}/normal", arrow, static=True)
            tip = plane.centroid_m + plane.normal  # a label has the colour of its point, and a grey ground
            name = rr.Points3D([tip], radii=0.001, colors=(255, 255, 255), labels=family)
            recording.log(f"planes/{sensor}/{family}/normal/name", name, static=True)


def faces_on_plane(faces: pd.DataFrame, family: str, plane: Plane) -> list[np.ndarray]:
    """Return the corners (n, 3) of each of a family's faces by design, moved along a plane's normal onto this plane.

    Parameters
    ----------
    faces
        The artefact ``faces``.
    family
        The family's name.
    plane
        The plane, target frame.
    """
    corners = [np.reshape(outline, (-1, 3)) for outline in faces.loc[faces["family"] == family, "vertices_target_m"]]
    return [points + np.outer(plane.distance_m - points @ plane.normal, plane.normal) for points in corners]


def _fan(polygon: np.ndarray, start: int) -> np.ndarray:
    """Return the triangles of a convex polygon whose first corner has the number ``start``."""
    return np.array([(start, start + k, start + k + 1) for k in range(1, len(polygon) - 1)], dtype=np.uint32)
