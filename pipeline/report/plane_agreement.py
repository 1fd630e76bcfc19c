"""Plane agreement: angles and distances between the two sensors' planes, with the coarse and calibrated mounts."""

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


def plane_agreement_table(
    planes: pd.DataFrame, moments: Mapping[str, Array], coarse: Mounted, mounts: Mapping[str, Mounted]
) -> pd.DataFrame:
    """Return the table ``closing``: one row for each mount and each family with one plane that both sensors see.

    Parameters
    ----------
    planes : table with the laser's planes
    moments : lifted moments of the soundings by family, over all passes
    coarse : the mount with which the moments were made
    mounts : the mounts to compare, by name
    """
    laser = laser_planes(planes)
    rows = []
    for name, mount in mounts.items():
        correction = mount.R_body_from_sensor @ coarse.R_body_from_sensor.T
        for family, lifted in moments.items():
            plane = laser.get((ALL_PASSES, family))
            if plane is None:
                continue
            try:
                sonar = fit_plane(plane_moments(lifted, correction, mount.lever_arm_body_m), plane.normal)
            except DegenerateGeometryError:
                continue
            rows.append(
                {
                    "mount": name,
                    "plane": family,
                    "angle_deg": np.degrees(angle_between(plane.normal, sonar.normal)),
                    "distance_m": float(plane.normal @ sonar.centroid_m - plane.distance_m),
                    "rms_m": sonar.rms_m,
                    "soundings": sonar.count,
                    "laser_points": plane.count,
                }
            )
    return pd.DataFrame(rows, columns=[column.name for column in CLOSING.columns])


def lifted_moments_by_family(faces: pd.DataFrame, sounding_moments: pd.DataFrame) -> dict[str, Array]:
    """Return the lifted moments of each family over all passes, from tables ``faces`` and ``sounding_moments``."""
    family_of_face = dict(zip(faces["face"].tolist(), faces["family"].tolist(), strict=True))
    totals: dict[str, Array] = {}
    for (_, family), moments in sorted(by_family(family_of_face, moments_by_face(sounding_moments)).items()):
        totals[family] = totals[family] + moments if family in totals else moments
    return totals
