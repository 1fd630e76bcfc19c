"""From fit_planes' tables back to what the patent's steps take."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import Plane
from pipeline.maths.patent.angles import PassPlanes
from pipeline.maths.patent.lifted_moments import SIZE
from pipeline.maths.patent.offsets import DryFace, PassOffsets, WetFace, by_family
from pipeline.maths.target.model import LEVEL

Array = NDArray[np.float64]
ALL_PASSES = -1


def laser_planes(planes: pd.DataFrame) -> dict[tuple[int, str], Plane]:
    """The laser's planes by (pass, name), P4 left out."""
    return planes_of(planes, "laser")


def planes_of(planes: pd.DataFrame, sensor: str) -> dict[tuple[int, str], Plane]:
    """One sensor's."""
    rows = planes[(planes["sensor"] == sensor) & (planes["plane"] != "P4")]
    found = {}
    for row in rows.to_dict("records"):
        found[(int(row["pass"]), str(row["plane"]))] = Plane(
            normal=np.array([row[f"normal_{axis}_target_1"] for axis in "xyz"]),
            distance_m=float(row["distance_m"]),
            centroid_m=np.array([row[f"centroid_{axis}_target_m"] for axis in "xyz"]),
            count=int(row["count"]),
            rms_m=float(row["rms_m"]),
            eigenvalues_m2=np.array(row["eigenvalues_m2"], dtype=np.float64),
            tangents=np.array(row["tangents"], dtype=np.float64).reshape(2, 3),
            covariance=np.array(row["covariance"], dtype=np.float64).reshape(3, 3),
        )
    return found


def lifted_moments(sounding_moments: pd.DataFrame) -> dict[tuple[int, int], Array]:
    """Lifted moments (40, 40) by (pass, face)."""
    keys = zip(sounding_moments["pass"].tolist(), sounding_moments["face"].tolist(), strict=True)
    return {
        key: np.array(moments, dtype=np.float64).reshape(SIZE, SIZE)
        for key, moments in zip(keys, sounding_moments["moments"], strict=True)
    }


def angle_passes(
    faces: pd.DataFrame, planes: pd.DataFrame, sounding_moments: pd.DataFrame, min_points: int
) -> list[PassPlanes]:
    """Passes in which both sensors have all of P1, P2, P3: with the laser's normals of the same pass.

    Raises
    ------
    DegenerateGeometryError
        The target has not all of these.
    """
    missing = sorted({"P1", "P2", "P3"} - set(faces["family"]))
    if missing:
        raise DegenerateGeometryError(
            f"the patent's steps need faces with the roles P1, P2, P3; this target has none with {', '.join(missing)}"
        )
    laser = laser_planes(planes)
    laser_p4 = planes[(planes["sensor"] == "laser") & (planes["plane"] == "P4")]
    fourth = {
        int(row["pass"]): np.array([row[f"normal_{axis}_target_1"] for axis in "xyz"])
        for row in laser_p4.to_dict("records")
    }
    families = _families(faces, sounding_moments)
    found = []
    for number in sorted({number for number, _ in families}):
        lifted = {f: families[(number, f)] for f in ("P1", "P2", "P3") if (number, f) in families}
        complete = len(lifted) == 3 and all(m[-1, -1] >= min_points for m in lifted.values())
        if complete and number in fourth and (number, "P3") in laser:
            normals = {f: laser[(number, f)].normal for f in ("P1", "P2", "P3")} | {"P4": fourth[number]}
            found.append(PassPlanes(number, lifted, normals))
    return found


def offset_passes(passes: list[PassPlanes], planes: pd.DataFrame) -> list[PassOffsets]:
    """The same passes with the laser's planes P1 and P2."""
    laser = laser_planes(planes)
    return [PassOffsets(one, laser[(one.number, "P2")], laser[(one.number, "P1")]) for one in passes]


def _families(faces: pd.DataFrame, sounding_moments: pd.DataFrame) -> Mapping[tuple[int, str], Array]:
    return by_family(
        dict(zip(faces["face"].tolist(), faces["family"].tolist(), strict=True)), lifted_moments(sounding_moments)
    )


def horizontal_faces(
    faces: pd.DataFrame, planes: pd.DataFrame, sounding_moments: pd.DataFrame, min_points: int
) -> tuple[list[DryFace], list[WetFace]]:
    """Horizontal faces that the laser and the sonar see with at least ``min_points``, over all passes."""
    laser = laser_planes(planes)
    total: dict[int, Array] = {}
    for (_, face), lifted in lifted_moments(sounding_moments).items():
        total[face] = total[face] + lifted if face in total else lifted
    dry, wet = [], []
    for row in faces[faces["normal_z_target_1"].abs() > LEVEL].to_dict("records"):
        design = float(row["distance_m"] * row["normal_z_target_1"])
        plane = laser.get((ALL_PASSES, row["name"]))
        if plane is not None and plane.count >= min_points:
            dry.append(DryFace(row["name"], float(plane.centroid_m[2]), design, plane.count))
        seen = total.get(int(row["face"]))
        if seen is not None and seen[-1, -1] >= min_points:
            wet.append(WetFace(row["name"], seen, design))
    return dry, wet
