"""Conversion of table rows into vectors, frames, trajectories and planes. The counterpart is ``to_tables``."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.maths.geometry.planes import Plane
from pipeline.maths.geometry.rotations import exp_so3, rotation_from_quaternion
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.patent.lifted_moments import SIZE
from pipeline.maths.target.face import HORIZONTAL_COSINE
from pipeline.maths.target.model import ROLES, TargetFrame

Array = NDArray[np.float64]
Row = Mapping[Any, Any] | pd.Series


def vector_of(row: Row, columns: str) -> Array:
    """Return three columns of a row as a vector (3,); ``columns`` is their name with ``{}`` in place of x, y or z.

    >>> vector_of({"x_m": 1, "y_m": 2, "z_m": 3}, "{}_m")
    array([1., 2., 3.])
    """
    return np.array([row[columns.format(axis)] for axis in "xyz"], dtype=np.float64)


def normal_of(row: Row) -> Array:
    """Return the normal (3,) of a face, plane or surface, target frame."""
    return vector_of(row, "normal_{}_target_1")


def normals_of(table: pd.DataFrame) -> Array:
    """Return the normals (n, 3) of faces, planes or surfaces, target frame."""
    return table[["normal_x_target_1", "normal_y_target_1", "normal_z_target_1"]].to_numpy(dtype=np.float64)


def is_horizontal(faces: pd.DataFrame) -> NDArray[np.bool_]:
    """Return a mask (n,): true for horizontal faces."""
    return np.asarray(faces["normal_z_target_1"].abs() > HORIZONTAL_COSINE)


def rotation_vector_deg(row: Row) -> Array:
    """Return the rotation vector (3,) of a correction of the mount, degrees, body axes."""
    return vector_of(row, "rotation_{}_deg")


def target_frame(target_pose: pd.DataFrame) -> TargetFrame:
    """Return the target frame relative to the pool frame, from the table ``target_pose`` (one row)."""
    row = target_pose.iloc[0]
    R_target_from_pool = np.array(row["R_target_from_pool"], dtype=np.float64).reshape(3, 3)
    return TargetFrame(R_target_from_pool, vector_of(row, "origin_{}_pool_m"))


def trajectory_in_pool(poses: pd.DataFrame) -> Trajectory:
    """Return the trajectory in the pool frame from the table ``poses`` of stage georeference."""
    return Trajectory.build(
        poses["t_ns"].to_numpy(),
        poses[["x_pool_m", "y_pool_m", "z_pool_m"]].to_numpy(),
        rotation_from_quaternion(poses[["qw", "qx", "qy", "qz"]].to_numpy()),
    )


def trajectory_in_target(poses: pd.DataFrame, target_pose: pd.DataFrame) -> Trajectory:
    """Return the trajectory in the target frame: x_target = R_target_from_pool (x_pool - origin)."""
    return target_frame(target_pose).trajectory_from_pool(trajectory_in_pool(poses))


def slow_errors(drift: pd.DataFrame, t_ns: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the shifts δ (n, 3) m and turns ω (n, 3) rad of recorded poses by the table ``drift``, target frame.

    Between two knots they are linear; without knots they are zero.
    """
    if not len(drift):
        return np.zeros((len(t_ns), 3)), np.zeros((len(t_ns), 3))
    knots = drift["t_ns"].to_numpy()
    since, at = ((times - knots[0]).astype(np.float64) for times in (t_ns, knots))
    names = [f"{axis}_target_m" for axis in "xyz"], [f"turn_{axis}_target_deg" for axis in "xyz"]
    shift, turn = (
        np.column_stack([np.interp(since, at, drift[name].to_numpy()) for name in columns]) for columns in names
    )
    return shift, np.radians(turn)


def trajectory_without_drift(trajectory: Trajectory, drift: pd.DataFrame) -> Trajectory:
    """Return a trajectory in the target frame, corrected by the table ``drift``: p + δ, Exp(ω) R."""
    shift, turn = slow_errors(drift, trajectory.t_ns)
    R_target_from_body = exp_so3(turn) @ trajectory.R_frame_from_body
    return Trajectory.build(trajectory.t_ns, trajectory.positions_m + shift, R_target_from_body)


def family_names(faces: pd.DataFrame) -> list[str]:
    """Return the names of the families in order: roles, then other families by their faces, then horizontal ones."""
    horizontal = dict(zip(faces["family"], is_horizontal(faces), strict=True))

    def place(name: str) -> int:
        return ROLES.index(name) if name in ROLES else len(ROLES) + bool(horizontal[name])

    return sorted(dict.fromkeys(faces["family"].tolist()), key=place)


def horizontal_families(faces: pd.DataFrame) -> set[str]:
    """Return the names of the families of horizontal faces."""
    return set(faces.loc[is_horizontal(faces), "family"])


def planes_of_sensor(planes: pd.DataFrame, sensor: str) -> dict[tuple[int, str], Plane]:
    """Return the planes of one sensor by (pass, name), without P4."""
    rows = planes[(planes["sensor"] == sensor) & (planes["plane"] != "P4")]
    return {
        (int(row["pass"]), str(row["plane"])): Plane(
            normal=normal_of(row),
            distance_m=float(row["distance_m"]),
            centroid_m=vector_of(row, "centroid_{}_target_m"),
            count=int(row["count"]),
            rms_m=float(row["rms_m"]),
            eigenvalues_m2=np.array(row["eigenvalues_m2"], dtype=np.float64),
            tangents=np.array(row["tangents"], dtype=np.float64).reshape(2, 3),
            covariance=np.array(row["covariance"], dtype=np.float64).reshape(3, 3),
        )
        for row in rows.to_dict("records")
    }


def laser_planes(planes: pd.DataFrame) -> dict[tuple[int, str], Plane]:
    """Return the planes of the laser by (pass, name), without P4."""
    return planes_of_sensor(planes, "laser")


def moments_by_face(sounding_moments: pd.DataFrame) -> dict[tuple[int, int], Array]:
    """Return the lifted moments (40, 40) of the soundings by (pass, face)."""
    keys = zip(sounding_moments["pass"].tolist(), sounding_moments["face"].tolist(), strict=True)
    return {
        key: np.array(moments, dtype=np.float64).reshape(SIZE, SIZE)
        for key, moments in zip(keys, sounding_moments["moments"], strict=True)
    }
