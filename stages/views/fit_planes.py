"""Stage fit_planes: outlines of the planes of laser and sonar (with the coarse mount) on the faces, their normals."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.target import FACES, PLANES
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import family_names, planes_of_sensor
from pipeline.maths.geometry.planes import Plane
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from stages.views.recording import GREY, SONAR

SHOWN = {"laser": GREY, "mbes": SONAR}
LINE_M = 0.012  # radius of an outline


def log(recording: Any, tables: Tables) -> None:
    """Log the planes of both sensors as outlines of what each can see, with their normals and names."""
    import rerun as rr

    faces, planes = tables.table(FACES), tables.table(PLANES)
    water_level_m = read_settings(tables.run).pool.target.water_level_m
    laser = planes_of_sensor(planes, "laser")
    for sensor, colour in SHOWN.items():
        fitted = planes_of_sensor(planes, sensor)
        for family in family_names(faces):
            plane = fitted.get((ALL_PASSES, family))
            if plane is None:
                continue
            parts = [part_of(face, water_level_m, sensor) for face in faces_on_plane(faces, family, plane)]
            outlines = [np.vstack([part, part[:1]]).astype(np.float32) for part in parts if len(part)]
            strips = rr.LineStrips3D(outlines, radii=LINE_M, colors=colour)
            recording.log(f"planes/{sensor}/{family}", strips, static=True)
            arrow = rr.Arrows3D(origins=[plane.centroid_m], vectors=[plane.normal], radii=0.02, colors=colour)
            recording.log(f"planes/{sensor}/{family}/normal", arrow, static=True)
            words = family if sensor == "laser" else _name(family, plane, laser.get((ALL_PASSES, family)))
            tip = plane.centroid_m + plane.normal  # a label has the colour of its point, and a grey ground
            name = rr.Points3D([tip], radii=0.001, colors=(255, 255, 255), labels=words)
            recording.log(f"planes/{sensor}/{family}/normal/name", name, static=True)


def _name(family: str, plane: Plane, laser: Plane | None) -> str:
    """Return the family's name, and how far the sonar's plane lies from the laser's, along its normal."""
    if laser is None:
        return family
    off_m = float(laser.normal @ plane.centroid_m) - laser.distance_m
    return f"{family}: {1000 * off_m:+.0f} mm"


def part_of(polygon: np.ndarray, water_level_m: float, sensor: str) -> np.ndarray:
    """Return the corners (m, 3) of the part of a convex polygon that a sensor sees: below or above the water.

    Each edge that crosses the water's surface is cut there (Sutherland and Hodgman's rule, for one plane).

    Parameters
    ----------
    polygon
        Corners (n, 3), target frame.
    water_level_m
        Height of the water in the target frame.
    sensor
        "mbes" sees what is below the water, "laser" what is above.
    """
    over = (polygon[:, 2] - water_level_m) * (-1.0 if sensor == "mbes" else 1.0)
    kept: list[np.ndarray] = []
    for k in range(len(polygon)):
        here, following = over[k], over[(k + 1) % len(polygon)]
        if here >= 0:
            kept.append(polygon[k])
        if here * following < 0:
            kept.append(polygon[k] + here / (here - following) * (polygon[(k + 1) % len(polygon)] - polygon[k]))
    return np.array(kept).reshape(-1, 3)


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

