"""Where the target is, and which points lie on which of its faces."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import GEOREFERENCE_COUNTS, LASER_POOL, POOL_FRAME, POSES, SOUNDINGS_POOL
from pipeline.artefacts.catalogue.target import (
    FACES,
    LASER_LABELLED,
    PROVISIONAL_MOUNT,
    SEGMENT_COUNTS,
    SOUNDINGS_LABELLED,
    TARGET_POSE,
)
from pipeline.artefacts.counts import counts_table
from pipeline.artefacts.poses import trajectory_in_pool
from pipeline.artefacts.sampling import Voxels, every_nth, points_above, voxel_means, voxel_sums
from pipeline.artefacts.streams import EMPTY, Batch, Chunk, Piece, Stream, xyz
from pipeline.config.pool import Segment
from pipeline.config.stage_settings import SensorMount, SonarBeams
from pipeline.config.target import Target
from pipeline.errors import RawDataError
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.target.labelling import Beams, Labels, hidden_in_part, label_points, near_planes
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.design import target_of
from pipeline.target.laser_search import LaserPoses, find_laser
from pipeline.target.mount_search import FoundMount, SoundingSample, find_mount
from pipeline.target.pose_search import VOXEL_M, FoundTarget, LaserSample, find_target
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
SOUNDING_SAMPLE = 8_000  # soundings to search with
LASER_SAMPLE = 2_000_000  # laser points, of which voxels are then made
RAW_SAMPLE = 50_000  # of these taken singly


@dataclass(frozen=True)
class Config:
    target: Target
    segment: Segment
    laser: SensorMount
    mbes: SonarBeams | None  # none: the laser is calibrated


@dataclass(frozen=True)
class Inputs:
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    poses: Annotated[pd.DataFrame, POSES]
    counts: Annotated[pd.DataFrame, GEOREFERENCE_COUNTS]
    laser_pool: Annotated[Stream, LASER_POOL]
    soundings_pool: Annotated[Stream, SOUNDINGS_POOL]


@dataclass(frozen=True)
class Outputs:
    faces: Annotated[pd.DataFrame, FACES]
    target_pose: Annotated[pd.DataFrame, TARGET_POSE]
    provisional_mount: Annotated[pd.DataFrame, PROVISIONAL_MOUNT]
    counts: Annotated[pd.DataFrame, SEGMENT_COUNTS]
    laser_labelled: Annotated[Stream, LASER_LABELLED] = EMPTY
    soundings_labelled: Annotated[Stream, SOUNDINGS_LABELLED] = EMPTY


@dataclass(frozen=True)
class Prepared:
    model: TargetModel
    target: FoundTarget
    mount: FoundMount
    trajectory: Trajectory  # in the target frame
    surface: ClosestSurface


def prepare(inputs: Inputs, config: Config) -> Prepared:
    model = target_of(config.target)
    lowest = config.target.water_level_m - model.half_period_m / 2
    dry = _laser_sample(inputs, lowest)
    if len(dry.voxel_means_m) < 50:
        raise RawDataError(
            f"laser: {len(dry.voxel_means_m)} places seen above the water near the target, at least 50 are needed; "
            "check target.origin, target.water_level_m and laser.mount; poolcal check tells which of them"
        )
    known = not bool(inputs.pool_frame["azimuth_estimated"].iloc[0])
    target = find_target(dry, model, config.segment, known)
    in_pool = trajectory_in_pool(inputs.poses)
    if config.mbes is None:
        poses = _laser_poses(inputs, in_pool, lowest)
        target, mount = find_laser(poses, target, model, mount_of(config.laser.mount), config.segment)
    trajectory = in_pool.moved(target.R_target_from_pool, -target.R_target_from_pool @ target.origin_pool_m)
    if config.mbes is not None:
        coarse = mount_of(config.mbes.mount)
        soundings = _sounding_sample(inputs, trajectory)
        given = (coarse.R_body_from_sensor, coarse.lever_arm_body_m, config.mbes, config.segment)
        mount = find_mount(soundings, model, *given)
    return Prepared(model, target, mount, trajectory, ClosestSurface(model))


def _used(inputs: Inputs, source: str) -> float:
    counts = inputs.counts
    return float(counts[(counts["source"] == source) & (counts["reason"] == "used")]["count"].sum())


def _laser_sample(inputs: Inputs, lowest_m: float) -> LaserSample:
    """The laser's points, at most about two million: as voxels, and at most about fifty thousand as they are."""
    single: list[NDArray[np.float64]] = []

    def voxels() -> Iterator[Voxels]:
        for sums, points in inputs.laser_pool.fold(_thinned, _used(inputs, "laser_points"), lowest_m):
            single.append(points)
            yield sums

    return LaserSample(voxel_means(voxels()), np.concatenate(single))


def _thinned(batch: Batch, rows: float, lowest_m: float) -> tuple[Voxels, NDArray[np.float64]]:
    some = every_nth(batch, rows / LASER_SAMPLE)
    few = every_nth(some, rows / RAW_SAMPLE)  # the same hash: a part of these
    return voxel_sums(points_above(some, "pool_m", lowest_m), VOXEL_M), points_above(few, "pool_m", lowest_m)


def _laser_poses(inputs: Inputs, trajectory: Trajectory, lowest_m: float) -> LaserPoses:
    """At most about fifty thousand of the points, as the scanner has them."""
    pieces = list(inputs.laser_pool.fold(_placed, _used(inputs, "laser_points") / RAW_SAMPLE, lowest_m))
    t_ns, points = (np.concatenate([piece[k] for piece in pieces]) for k in range(2))
    return LaserPoses(*trajectory.poses_at(t_ns), points)


def _placed(batch: Batch, one_in: float, lowest_m: float) -> tuple[NDArray[np.int64], Array]:
    some = every_nth(batch, one_in)
    dry = some["z_pool_m"] >= lowest_m
    return some["t_ns"][dry], xyz(some, "laser_m", dry)


def _sounding_sample(inputs: Inputs, trajectory: Trajectory) -> SoundingSample:
    pieces = list(inputs.soundings_pool.fold(every_nth, _used(inputs, "soundings") / SOUNDING_SAMPLE))
    t_ns = np.concatenate([piece["t_ns"] for piece in pieces])
    points = np.column_stack([np.concatenate([piece[f"{axis}_mbes_m"] for piece in pieces]) for axis in "xyz"])
    return SoundingSample(*trajectory.poses_at(t_ns), points)


def run_batch(source: str, chunk: Chunk, prepared: Prepared, config: Config) -> Piece:
    if source == "laser_pool":
        return _label_laser(chunk.columns, prepared, config)
    if config.mbes is None:
        raise TypeError("soundings without a sonar")
    return _label_soundings(chunk.columns, prepared, config, config.mbes)


def _label_laser(batch: Batch, prepared: Prepared, config: Config) -> Piece:
    model, segment = prepared.model, config.segment
    gate, grazing = prepared.target.gate_m, np.radians(segment.min_grazing_deg)
    coarse = mount_of(config.laser.mount)
    lever = coarse.lever_arm_body_m
    if config.mbes is None:
        R_body_from_laser, lever = prepared.mount.on(coarse)
        points = prepared.trajectory.place(batch["t_ns"], xyz(batch, "laser_m") @ R_body_from_laser.T + lever)
    else:
        pool = xyz(batch, "pool_m")
        points = (prepared.target.R_target_from_pool @ (pool - prepared.target.origin_pool_m).T).T
    heights = (model.water_level_m + segment.water_margin_m, np.inf)
    dry = points[:, 2] > model.water_level_m + segment.water_margin_m / 2
    near, planes = near_planes(model, points, gate, dry, "dry")
    points, t_ns = points[near], batch["t_ns"][near]
    rays = points - prepared.trajectory.carried(t_ns, lever)
    ranges = np.sqrt(np.einsum("ni,ni->n", rays, rays))
    rays /= ranges[:, None]
    labels = label_points(model, points, Beams(rays, ranges), gate, segment.margin_m, grazing, planes, heights)
    on = np.flatnonzero(labels.face >= 0)
    rows = near[on]
    columns = {"t_ns": t_ns[on], "pass": batch["pass"][rows], "face": labels.face[on]}
    for index, axis in enumerate("xyz"):
        columns[f"{axis}_laser_m"], columns[f"{axis}_target_m"] = batch[f"{axis}_laser_m"][rows], points[on, index]
    columns["cos_incidence"] = labels.cos_incidence[on]
    counts = _counts("below or near the water line", dry, "near an edge", near, labels)
    return Piece({"laser_labelled": columns}, counts)


def _label_soundings(batch: Batch, prepared: Prepared, config: Config, mbes: SonarBeams) -> Piece:
    model, segment, mount = prepared.model, config.segment, prepared.mount
    R_body_from_mbes, lever = mount.on(mount_of(mbes.mount))
    sensor = xyz(batch, "mbes_m")
    points = prepared.trajectory.place(batch["t_ns"], sensor @ R_body_from_mbes.T + lever)
    heights = (-np.inf, model.water_level_m - segment.water_margin_m)
    wet = points[:, 2] < model.water_level_m - segment.water_margin_m / 2
    near, planes = near_planes(model, points, mount.gate_m, wet, "wet")
    _, R_target_from_body = prepared.trajectory.poses_at(batch["t_ns"][near])
    beams = beams_in_target(R_target_from_body, R_body_from_mbes, sensor[near], mbes)
    grazing = np.radians(segment.min_grazing_deg)
    labels = label_points(model, points[near], beams, mount.gate_m, segment.margin_m, grazing, planes, heights)
    on = np.flatnonzero(labels.face >= 0)
    origins = prepared.trajectory.carried(batch["t_ns"][near[on]], lever)
    met = partial(prepared.surface.first_met, origins)
    hidden = hidden_in_part(model, labels.face[on], beams.corners(on), met)
    on = on[~hidden]
    rows = near[on]
    names = ("t_ns", "pass", "ping", "beam", "x_mbes_m", "y_mbes_m", "z_mbes_m")
    columns = {name: batch[name][rows] for name in names} | {"face": labels.face[on]}
    counts = _counts("above or near the water line", wet, "footprint near an edge", near, labels)
    counts |= {"footprint partly on another face": int(hidden.sum()), "used": len(on)}
    return Piece({"soundings_labelled": columns}, counts)


def _counts(
    other_side: str, own_side: NDArray[np.bool_], edge: str, near: NDArray[np.int64], labels: Labels
) -> dict[str, int]:
    """Why points got no label, and how many have one."""
    return {
        other_side: int((~own_side).sum()),
        "off every face": int(own_side.sum()) - len(near) + int(labels.off_surface.sum()),
        edge: int(labels.near_edge.sum()),
        "ray too flat": int(labels.grazing.sum()),
        "used": int((labels.face >= 0).sum()),
    }


def combine(prepared: Prepared, partials: dict[str, list[tuple[str, dict[str, int]]]], config: Config) -> Outputs:
    counts = counts_table(partials)
    for source, sensor in (("laser_pool", "laser"), ("soundings_pool", "mbes")):
        if sensor == "mbes" and config.mbes is None:
            continue
        of_source = counts[counts["source"] == source].set_index("reason")["count"]
        if not of_source["used"]:
            why = ", ".join(f"{number} {reason}" for reason, number in of_source.items() if number and reason != "used")
            limits = f"{config.segment.search_mount_deg:g}° and {config.segment.search_mount_m:g} m"
            mount = f"the coarse mount by more than {limits}, " if sensor == "mbes" else ""
            raise RawDataError(
                f"{sensor}: no point on the target's faces ({why}); target.origin, target.azimuth_deg (of +y) "
                f"or {config.target.shape} may be wrong, {mount}or a clock (UTC is 18 s behind GPS time); "
                "poolcal check tells which"
            )
    return Outputs(_faces(prepared.model), _target_pose(prepared.target), _mount(prepared.mount), counts)


def _faces(model: TargetModel) -> pd.DataFrame:
    rows: list[dict[str, Any]] = []
    one_plane = {family.name: family.one_plane for family in model.families}
    for number, face in enumerate(model.faces):
        row = {"face": number, "name": face.name, "family": face.family, "distance_m": face.distance_m}
        row |= {"sense": face.sense, "offset_m": face.offset_m, "one_plane": one_plane[face.family]}
        row |= {f"normal_{axis}_target_1": face.normal[index] for index, axis in enumerate("xyz")}
        rows.append(row | {"vertices_target_m": face.vertices_m.ravel().tolist()})
    return pd.DataFrame(rows)


def _target_pose(found: FoundTarget) -> pd.DataFrame:
    sigma, tilt_sigma = np.sqrt(np.diag(found.pose.covariance)), np.sqrt(np.diag(found.tilt.covariance))
    row = {
        "R_target_from_pool": found.R_target_from_pool.ravel().tolist(),
        "azimuth_correction_deg": np.degrees(found.azimuth_correction_rad),
        # The correction turns the points onto the model: the target itself is tilted the other way.
        "tilt_x_deg": -np.degrees(found.tilt.parameters[0]),
        "tilt_y_deg": -np.degrees(found.tilt.parameters[1]),
        "sigma_azimuth_deg": np.degrees(sigma[0]),
        "sigma_tilt_x_deg": np.degrees(tilt_sigma[0]),
        "sigma_tilt_y_deg": np.degrees(tilt_sigma[1]),
        "rms_m": found.pose.rms_m,
        "points": found.pose.count,
        "agreement_m2": found.agreement_m2,
        "rival_agreement_m2": found.rival_agreement_m2,
        "rival": found.rival,
        "ambiguous": found.ambiguous,
        "gate_m": found.gate_m,
        "within": found.within,
    }
    for index, axis in enumerate("xyz"):
        row |= {f"origin_{axis}_pool_m": found.origin_pool_m[index], f"sigma_{axis}_m": sigma[1 + index]}
    return pd.DataFrame([row])


def _mount(found: FoundMount) -> pd.DataFrame:
    row = {
        "scale_m": found.scale_m,
        "gate_m": found.gate_m,
        "score": found.score,
        "rival_score": found.rival_score,
        "ambiguous": found.ambiguous,
        "within": found.within,
    }
    for index, axis in enumerate("xyz"):
        row |= {
            f"rotation_{axis}_deg": np.degrees(found.rotation_vector_rad[index]),
            f"lever_arm_{axis}_m": found.lever_arm_correction_m[index],
        }
    return pd.DataFrame([row])
