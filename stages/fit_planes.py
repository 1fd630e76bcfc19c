"""Planes of both sensors, by pass, face and family; and moments from which any mount's follow."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.target import (
    FACES,
    LASER_LABELLED,
    PLANES,
    SOUNDING_MOMENTS,
    SOUNDINGS_LABELLED,
    TARGET_POSE,
)
from pipeline.artefacts.poses import trajectory_in_target
from pipeline.artefacts.streams import Batch, Stream, xyz
from pipeline.config.pool import FitPlanes
from pipeline.config.stage_settings import SensorMount
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import Moments, Plane, fit_plane
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.patent.angles import fourth_normal
from pipeline.maths.patent.lifted_moments import SIZE, lift, plane_moments
from pipeline.mount import mount_of

Array = NDArray[np.float64]
Key = tuple[int, int]  # pass, face
ALL_PASSES = -1


@dataclass(frozen=True)
class Config:
    fit_planes: FitPlanes
    mbes: SensorMount | None  # none: the laser is calibrated


@dataclass(frozen=True)
class Inputs:
    faces: Annotated[pd.DataFrame, FACES]
    poses: Annotated[pd.DataFrame, POSES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    laser_labelled: Annotated[Stream, LASER_LABELLED]
    soundings_labelled: Annotated[Stream, SOUNDINGS_LABELLED]


@dataclass(frozen=True)
class Outputs:
    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]


def run(inputs: Inputs, config: Config) -> Outputs:
    trajectory = trajectory_in_target(inputs.poses, inputs.target_pose)
    laser = _merge(inputs.laser_labelled.fold(laser_moments))
    lifted: dict[Key, Array] = {}
    mbes: dict[Key, Moments] = {}
    if config.mbes is not None:
        mount = mount_of(config.mbes.mount)
        lifted = _merge(inputs.soundings_labelled.fold(sounding_moments, trajectory, mount.R_body_from_sensor))
        mbes = {key: plane_moments(m, np.eye(3), mount.lever_arm_body_m) for key, m in lifted.items()}
    rows = [
        row
        for sensor, moments in (("laser", laser), ("mbes", mbes))
        for row in _planes(sensor, moments, inputs.faces, config.fit_planes.min_points)
    ]
    columns = [column.name for column in PLANES.columns]
    return Outputs(pd.DataFrame(rows, columns=columns), _moments_table(lifted))


def _groups(batch: Batch) -> Iterator[tuple[Key, NDArray[np.int64]]]:
    """Row numbers of each (pass, face) in the batch."""
    code = batch["pass"].astype(np.int64) * 65_536 + batch["face"]
    order = np.argsort(code, kind="stable")
    found, starts = np.unique(code[order], return_index=True)
    for value, rows in zip(found.tolist(), np.split(order, starts[1:]), strict=True):
        yield (value >> 16, value & 65_535), rows


def laser_moments(batch: Batch) -> dict[Key, Moments]:
    """Moments of a batch's laser points by pass and face."""
    points = xyz(batch, "target_m")
    return {key: Moments.of(points[rows]) for key, rows in _groups(batch)}


def sounding_moments(batch: Batch, trajectory: Trajectory, R_body_from_mbes: Array) -> dict[Key, Array]:
    """Lifted moments (40, 40) of a batch's soundings by pass and face."""
    points = xyz(batch, "mbes_m") @ R_body_from_mbes.T
    positions, R_target_from_body = trajectory.poses_at(batch["t_ns"])
    features = lift(R_target_from_body, positions, points)
    return {key: features[rows].T @ features[rows] for key, rows in _groups(batch)}


def _merge(partials: Iterator[dict[Key, Any]]) -> dict[Key, Any]:
    total: dict[Key, Any] = {}
    for partial in partials:
        for key, moments in partial.items():
            total[key] = total[key] + moments if key in total else moments
    return dict(sorted(total.items()))


def _planes(sensor: str, moments: dict[Key, Moments], faces: pd.DataFrame, min_points: int) -> Iterator[dict[str, Any]]:
    components = faces[["normal_x_target_1", "normal_y_target_1", "normal_z_target_1"]].to_numpy()
    normals = dict(zip(faces["face"].tolist(), components, strict=True))
    family = dict(zip(faces["face"].tolist(), faces["family"].tolist(), strict=True))
    name = dict(zip(faces["face"].tolist(), faces["name"].tolist(), strict=True))
    one_plane = dict(zip(faces["face"].tolist(), faces["one_plane"].tolist(), strict=True))
    groups: dict[tuple[int, str], tuple[Moments, Array]] = {}

    def add(key: tuple[int, str], moment: Moments, toward: Array) -> None:
        groups[key] = (groups[key][0] + moment if key in groups else moment, toward)

    for (number, face), moment in moments.items():
        for which in (number, ALL_PASSES):
            add((which, name[face]), moment, normals[face])
            if one_plane[face] and family[face] != name[face]:
                add((which, family[face]), moment, normals[face])
    fitted: dict[tuple[int, str], Plane] = {}
    for key, (moment, toward) in sorted(groups.items()):
        if moment.count >= min_points:
            try:
                fitted[key] = fit_plane(moment, toward)
            except DegenerateGeometryError:
                continue  # all on one line: no plane, and no row that could be taken for one
            yield _row(sensor, *key, fitted[key])
    for number in sorted({number for number, _ in fitted}):
        if (number, "P1") in fitted and (number, "P2") in fitted:
            yield _fourth(sensor, number, fitted[(number, "P1")], fitted[(number, "P2")])


def _row(sensor: str, number: int, name: str, plane: Plane) -> dict[str, Any]:
    row: dict[str, Any] = {"sensor": sensor, "pass": number, "plane": name, "distance_m": plane.distance_m}
    for index, axis in enumerate("xyz"):
        row[f"normal_{axis}_target_1"] = plane.normal[index]
        row[f"centroid_{axis}_target_m"] = plane.centroid_m[index]
    return row | {
        "count": plane.count,
        "rms_m": plane.rms_m,
        "eigenvalues_m2": plane.eigenvalues_m2.tolist(),
        "tangents": plane.tangents.ravel().tolist(),
        "covariance": plane.covariance.ravel().tolist(),
    }


def _fourth(sensor: str, number: int, first: Plane, second: Plane) -> dict[str, Any]:
    """P4 = P1 x P2: a direction only; its distance and centroid are those of nothing, so they are not numbers."""
    normal = fourth_normal(first.normal, second.normal)
    row: dict[str, Any] = {"sensor": sensor, "pass": number, "plane": "P4", "distance_m": np.nan, "rms_m": np.nan}
    for index, axis in enumerate("xyz"):
        row[f"normal_{axis}_target_1"] = normal[index]
        row[f"centroid_{axis}_target_m"] = np.nan
    row |= {"count": min(first.count, second.count), "eigenvalues_m2": [], "tangents": [], "covariance": []}
    return row


def _moments_table(lifted: dict[Key, Array]) -> pd.DataFrame:
    rows = [
        {"pass": number, "face": face, "count": round(float(m[-1, -1])), "moments": m.reshape(SIZE * SIZE).tolist()}
        for (number, face), m in lifted.items()
    ]
    return pd.DataFrame(rows, columns=[column.name for column in SOUNDING_MOMENTS.columns])
