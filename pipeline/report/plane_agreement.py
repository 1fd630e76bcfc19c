"""How the sonar's planes close with the laser's: before the calibration and after it, by each method."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.results import CLOSING
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes, moments_by_face
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import angle_between, fit_plane
from pipeline.maths.patent.lifted_moments import by_family, plane_moments
from pipeline.mount import Mounted

Array = NDArray[np.float64]


def closing_table(
    faces: pd.DataFrame,
    planes: pd.DataFrame,
    sounding_moments: pd.DataFrame,
    coarse: Mounted,
    mounts: Mapping[str, Mounted],
) -> pd.DataFrame:
    """One row a mount and a family in one plane that both sensors see; ``mounts``: totals by name."""
    laser = laser_planes(planes)
    rows = []
    for mount, placed in mounts.items():
        correction = placed.R_body_from_sensor @ coarse.R_body_from_sensor.T
        for family, lifted in families_of(faces, sounding_moments).items():
            plane = laser.get((ALL_PASSES, family))
            if plane is None:
                continue
            try:
                sonar = fit_plane(plane_moments(lifted, correction, placed.lever_arm_body_m), plane.normal)
            except DegenerateGeometryError:
                continue
            rows.append(
                {
                    "mount": mount,
                    "plane": family,
                    "angle_deg": np.degrees(angle_between(plane.normal, sonar.normal)),
                    "distance_m": float(plane.normal @ sonar.centroid_m - plane.distance_m),
                    "rms_m": sonar.rms_m,
                    "soundings": sonar.count,
                    "laser_points": plane.count,
                }
            )
    return pd.DataFrame(rows, columns=[column.name for column in CLOSING.columns])


def families_of(faces: pd.DataFrame, sounding_moments: pd.DataFrame) -> dict[str, Array]:
    """Lifted moments of each family over all passes."""
    family = dict(zip(faces["face"].tolist(), faces["family"].tolist(), strict=True))
    total: dict[str, Array] = {}
    for (_, name), moments in sorted(by_family(family, moments_by_face(sounding_moments)).items()):
        total[name] = total[name] + moments if name in total else moments
    return total
