"""Conversion of vectors, planes and faces into table rows. The counterpart is ``from_tables``."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.target import SOUNDING_MOMENTS
from pipeline.maths.geometry.planes import Plane
from pipeline.maths.geometry.rotations import quaternion_from_rotation
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.patent.lifted_moments import SIZE
from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]


def xyz_columns(columns: str, vector: Sequence[Any] | Array) -> dict[str, Any]:
    """Return a vector (3,) as three columns of a row; ``columns`` is their name with ``{}`` in place of x, y or z.

    >>> xyz_columns("{}_m", [1, 2, 3])
    {'x_m': 1, 'y_m': 2, 'z_m': 3}
    """
    return {columns.format(axis): vector[index] for index, axis in enumerate("xyz")}


def normal_columns(normal: Array) -> dict[str, Any]:
    """Return the columns of a normal (3,), target frame."""
    return xyz_columns("normal_{}_target_1", normal)


def mount_correction_columns(rotation_vector_rad: Array, lever_arm_m: Array) -> dict[str, float]:
    """Return the columns of a correction of the mount: rotation vector (3,) and lever arm (3,), body axes."""
    degrees = xyz_columns("rotation_{}_deg", [float(np.degrees(angle)) for angle in rotation_vector_rad])
    return degrees | xyz_columns("lever_arm_{}_m", [float(length) for length in lever_arm_m])


def poses_table(trajectory: Trajectory) -> pd.DataFrame:
    """Return the table ``poses`` of a trajectory in the pool frame."""
    quaternion = quaternion_from_rotation(trajectory.R_frame_from_body)
    poses = pd.DataFrame({"t_ns": trajectory.t_ns} | xyz_columns("{}_pool_m", trajectory.positions_m.T))
    for index, axis in enumerate("wxyz"):
        poses[f"q{axis}"] = quaternion[:, index]
    return poses


def plane_row(sensor: str, number: int, name: str, plane: Plane) -> dict[str, Any]:
    """Return the row of a fitted plane in the table ``planes``.

    Parameters
    ----------
    sensor
        "laser" or "mbes".
    number
        Number of the pass.
    name
        Name of the face or the family.
    plane
        The fitted plane, target frame.
    """
    row: dict[str, Any] = {"sensor": sensor, "pass": number, "plane": name, "distance_m": plane.distance_m}
    row |= normal_columns(plane.normal) | xyz_columns("centroid_{}_target_m", plane.centroid_m)
    return row | {
        "count": plane.count,
        "rms_m": plane.rms_m,
        "eigenvalues_m2": plane.eigenvalues_m2.tolist(),
        "tangents": plane.tangents.ravel().tolist(),
        "covariance": plane.covariance.ravel().tolist(),
    }


def direction_row(sensor: str, number: int, normal: Array, count: int) -> dict[str, Any]:
    """Return the row of P4 = P1 x P2 in the table ``planes``.

    P4 is only a direction. No point lies on it, so its distance, its RMS and its centroid are NaN.

    Parameters
    ----------
    sensor
        "laser" or "mbes".
    number
        Number of the pass.
    normal
        The direction (3,), target frame.
    count
        The smaller of the point counts of P1 and P2.
    """
    row: dict[str, Any] = {"sensor": sensor, "pass": number, "plane": "P4", "distance_m": np.nan, "rms_m": np.nan}
    row |= normal_columns(normal) | xyz_columns("centroid_{}_target_m", np.full(3, np.nan))
    return row | {"count": count, "eigenvalues_m2": [], "tangents": [], "covariance": []}


def moments_table(moments: Mapping[tuple[int, int], Array]) -> pd.DataFrame:
    """Return the table ``sounding_moments`` of lifted moments (40, 40) by (pass, face)."""
    rows = [
        {"pass": number, "face": face, "count": round(float(m[-1, -1])), "moments": m.reshape(SIZE * SIZE).tolist()}
        for (number, face), m in moments.items()
    ]
    return pd.DataFrame(rows, columns=[column.name for column in SOUNDING_MOMENTS.columns])


def faces_table(model: TargetModel) -> pd.DataFrame:
    """Return the table ``faces``: one row for each face of the target by design."""
    one_plane = {family.name: family.one_plane for family in model.families}
    rows = []
    for number, face in enumerate(model.faces):
        row = {"face": number, "name": face.name, "family": face.family, "distance_m": face.distance_m}
        row |= {"sense": face.sense, "offset_m": face.offset_m, "one_plane": one_plane[face.family]}
        row |= normal_columns(face.normal)
        rows.append(row | {"vertices_target_m": face.vertices_m.ravel().tolist()})
    return pd.DataFrame(rows)
