"""Planes of both sensors by pass, face and family, and lifted moments, which give the planes for any mount."""

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
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import normals_of, trajectory_in_target
from pipeline.artefacts.streams import Batch, Stream, point_array
from pipeline.artefacts.to_tables import direction_row, moments_table, plane_row
from pipeline.config.pool import FitPlanes
from pipeline.config.stage_settings import SensorMount
from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import Plane, PlaneMoments, fit_plane
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.patent.angles import fourth_normal
from pipeline.maths.patent.lifted_moments import lift, plane_moments
from pipeline.mount import mount_of

Array = NDArray[np.float64]
Key = tuple[int, int]  # pass, face
NamedKey = tuple[int, str]  # pass, name of a face or a family
BLOCK = 16_384  # number of soundings that are lifted at a time: 5 MB


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses."""

    fit_planes: FitPlanes
    mbes: SensorMount | None  # None: the laser is calibrated


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads."""

    faces: Annotated[pd.DataFrame, FACES]
    poses: Annotated[pd.DataFrame, POSES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    laser_labelled: Annotated[Stream, LASER_LABELLED]
    soundings_labelled: Annotated[Stream, SOUNDINGS_LABELLED]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    planes: Annotated[pd.DataFrame, PLANES]
    sounding_moments: Annotated[pd.DataFrame, SOUNDING_MOMENTS]


def run(inputs: Inputs, config: Config) -> Outputs:
    """Fit the planes of both sensors, and return them with the lifted moments of the soundings."""
    trajectory = trajectory_in_target(inputs.poses, inputs.target_pose)
    laser = _merge(inputs.laser_labelled.fold(laser_moments))
    lifted: dict[Key, Array] = {}
    mbes: dict[Key, PlaneMoments] = {}
    if config.mbes is not None:
        mount = mount_of(config.mbes.mount)
        lifted = _merge(inputs.soundings_labelled.fold(sounding_moments, trajectory, mount.R_body_from_sensor))
        mbes = {key: plane_moments(m, np.eye(3), mount.lever_arm_body_m) for key, m in lifted.items()}
    rows = [
        row
        for sensor, moments in (("laser", laser), ("mbes", mbes))
        for row in _plane_rows(sensor, moments, inputs.faces, config.fit_planes.min_points)
    ]
    columns = [column.name for column in PLANES.columns]
    return Outputs(pd.DataFrame(rows, columns=columns), moments_table(lifted))


def _rows_by_key(batch: Batch) -> Iterator[tuple[Key, NDArray[np.int64]]]:
    """Yield each key (pass, face) of the batch with the numbers of its rows, (n,)."""
    code = batch["pass"].astype(np.int64) * 65_536 + batch["face"]
    order = np.argsort(code, kind="stable")
    codes, starts = np.unique(code[order], return_index=True)
    for value, rows in zip(codes.tolist(), np.split(order, starts[1:]), strict=True):
        yield (value >> 16, value & 65_535), rows


def laser_moments(batch: Batch) -> dict[Key, PlaneMoments]:
    """Return the moments of a batch's laser points by pass and face."""
    points = point_array(batch, "target_m")
    return {key: PlaneMoments.of(points[rows]) for key, rows in _rows_by_key(batch)}


def sounding_moments(batch: Batch, trajectory: Trajectory, R_body_from_mbes: Array) -> dict[Key, Array]:
    """Return the lifted moments (40, 40) of a batch's soundings by pass and face.

    Parameters
    ----------
    batch
        Soundings in the mbes frame.
    trajectory
        Poses of the body in the target frame.
    R_body_from_mbes
        Coarse rotation (3, 3) of the sonar.
    """
    points = point_array(batch, "mbes_m") @ R_body_from_mbes.T
    moments: dict[Key, Array] = {}
    for key, of_key in _rows_by_key(batch):
        for start in range(0, len(of_key), BLOCK):
            rows = of_key[start : start + BLOCK]
            positions, R_target_from_body = trajectory.poses_at(batch["t_ns"][rows])
            lifted = lift(R_target_from_body, positions, points[rows])
            moments[key] = moments.get(key, 0.0) + lifted.T @ lifted
    return moments


def _merge(partials: Iterator[dict[Key, Any]]) -> dict[Key, Any]:
    total: dict[Key, Any] = {}
    for partial in partials:
        for key, moments in partial.items():
            total[key] = total[key] + moments if key in total else moments
    return dict(sorted(total.items()))


def _plane_rows(
    sensor: str, moments: dict[Key, PlaneMoments], faces: pd.DataFrame, min_points: int
) -> Iterator[dict[str, Any]]:
    """Yield one sensor's rows: by face, by family in one plane, and the direction P4; by pass and for all passes."""
    fitted: dict[NamedKey, Plane] = {}
    for key, (of_plane, toward) in sorted(_moments_by_name(moments, faces).items()):
        if of_plane.count >= min_points:
            try:
                fitted[key] = fit_plane(of_plane, toward)
            except DegenerateGeometryError:
                continue  # the points lie on one line: no plane, and no row
            yield plane_row(sensor, *key, fitted[key])
    for number in sorted({number for number, _ in fitted}):
        if (number, "P1") in fitted and (number, "P2") in fitted:
            first, second = fitted[(number, "P1")], fitted[(number, "P2")]
            normal = fourth_normal(first.normal, second.normal)
            yield direction_row(sensor, number, normal, min(first.count, second.count))


def _moments_by_name(
    moments: dict[Key, PlaneMoments], faces: pd.DataFrame
) -> dict[NamedKey, tuple[PlaneMoments, Array]]:
    """Return each plane's moments by pass and name, with the normal by design, which fixes the sign of the plane's."""
    normals = dict(zip(faces["face"].tolist(), normals_of(faces), strict=True))
    rows = {row["face"]: row for row in faces[["face", "name", "family", "one_plane"]].to_dict("records")}
    total: dict[NamedKey, tuple[PlaneMoments, Array]] = {}
    for (number, face), of_face in moments.items():
        row = rows[face]
        names = [row["name"]]
        if row["one_plane"] and row["family"] != row["name"]:
            names.append(row["family"])
        for key in [(each, name) for each in (number, ALL_PASSES) for name in names]:
            total[key] = (total[key][0] + of_face if key in total else of_face, normals[face])
    return total
