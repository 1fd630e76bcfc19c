"""Conversion of the tables of stage fit_planes into the observations of the patent's steps."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import is_horizontal, laser_planes, moments_by_face, normal_of
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.patent.angles import PassPlanes
from pipeline.maths.patent.lifted_moments import by_family
from pipeline.maths.patent.literal_planes import SessionPlanes
from pipeline.maths.patent.offsets import DryFace, OffsetObservations, PassOffsets, WetFace
from pipeline.maths.target.model import ROLES

Array = NDArray[np.float64]


def angle_passes(
    faces: pd.DataFrame, planes: pd.DataFrame, sounding_moments: pd.DataFrame, min_points: int
) -> list[PassPlanes]:
    """Return the passes in which both sensors see P1, P2 and P3, each with the laser's normals of that pass.

    Parameters
    ----------
    faces, planes, sounding_moments
        Tables of stages segment and fit_planes.
    min_points
        Smallest number of soundings on each of these families.

    Raises
    ------
    DegenerateGeometryError
        The target has no faces with one of these roles.
    """
    laser = laser_planes(planes)
    laser_p4 = planes[(planes["sensor"] == "laser") & (planes["plane"] == "P4")]
    fourth = {int(row["pass"]): normal_of(row) for row in laser_p4.to_dict("records")}
    families = _moments_by_family(faces, sounding_moments)
    passes = []
    for number in sorted({number for number, _ in families}):
        lifted = {role: families[(number, role)] for role in ROLES if (number, role) in families}
        complete = len(lifted) == 3 and all(m[-1, -1] >= min_points for m in lifted.values())
        if complete and number in fourth and (number, "P3") in laser:
            normals = {role: laser[(number, role)].normal for role in ROLES} | {"P4": fourth[number]}
            passes.append(PassPlanes(number, lifted, normals))
    return passes


def session_planes(
    faces: pd.DataFrame, planes: pd.DataFrame, sounding_moments: pd.DataFrame, min_points: int
) -> SessionPlanes:
    """Return both sensors' points on P1, P2 and P3 over all passes, as the literal form takes them.

    Parameters
    ----------
    faces, planes, sounding_moments
        Tables of stages segment and fit_planes.
    min_points
        Smallest number of soundings on each of these families.

    Raises
    ------
    DegenerateGeometryError
        The target has no faces with one of these roles, or a sensor has too few points on one of them.
    """
    lifted: dict[str, Array] = {}
    for (_, family), moments in sorted(_moments_by_family(faces, sounding_moments).items()):
        lifted[family] = lifted[family] + moments if family in lifted else moments
    laser = laser_planes(planes)
    for role in ROLES:
        for sensor, seen in (
            ("laser", (ALL_PASSES, role) in laser),
            ("sonar", role in lifted and lifted[role][-1, -1] >= min_points),
        ):
            if not seen:
                raise DegenerateGeometryError(f"the {sensor} has fewer than {min_points} points on {role}")
    return SessionPlanes({role: lifted[role] for role in ROLES}, {role: laser[(ALL_PASSES, role)] for role in ROLES})


def _moments_by_family(faces: pd.DataFrame, sounding_moments: pd.DataFrame) -> dict[tuple[int, str], Array]:
    """Return the lifted moments by (pass, family); refuse a target without the roles of the patent."""
    missing = sorted(set(ROLES) - set(faces["family"]))
    if missing:
        raise DegenerateGeometryError(
            f"the patent's steps need faces with the roles P1, P2, P3; this target has none with {', '.join(missing)}"
        )
    family_of_face = dict(zip(faces["face"].tolist(), faces["family"].tolist(), strict=True))
    return by_family(family_of_face, moments_by_face(sounding_moments))


def offset_observations(
    passes: list[PassPlanes],
    faces: pd.DataFrame,
    planes: pd.DataFrame,
    sounding_moments: pd.DataFrame,
    min_points: int,
) -> OffsetObservations:
    """Return the passes with the laser's planes P1 and P2, and the horizontal faces over all passes.

    Parameters
    ----------
    passes
        Passes of :func:`angle_passes`.
    faces, planes, sounding_moments
        Tables of stages segment and fit_planes.
    min_points
        Smallest number of points on a horizontal face.
    """
    laser = laser_planes(planes)
    of_passes = [PassOffsets(one, laser[(one.number, "P2")], laser[(one.number, "P1")]) for one in passes]
    total: dict[int, Array] = {}
    for (_, face), lifted in moments_by_face(sounding_moments).items():
        total[face] = total[face] + lifted if face in total else lifted
    dry, wet = [], []
    for row in faces[is_horizontal(faces)].to_dict("records"):
        design = float(row["distance_m"] * normal_of(row)[2])
        plane = laser.get((ALL_PASSES, row["name"]))
        if plane is not None and plane.count >= min_points:
            dry.append(DryFace(row["name"], float(plane.centroid_m[2]), design, plane.count))
        moments = total.get(int(row["face"]))
        if moments is not None and moments[-1, -1] >= min_points:
            wet.append(WetFace(row["name"], moments, design))
    return OffsetObservations(of_passes, dry, wet)
