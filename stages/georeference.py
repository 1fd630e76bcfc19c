"""Points into the pool frame: attitude on the rotation group, through ECEF; points far off the target are dropped."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import (
    GEOREFERENCE_COUNTS,
    LASER_POINTS,
    LASER_POOL,
    PASSES,
    POOL_FRAME,
    POSES,
    SOUNDINGS,
    SOUNDINGS_POOL,
    TRAJECTORY,
)
from pipeline.artefacts.counts import by_reason, counts_table, why_none_used
from pipeline.artefacts.streams import EMPTY_STREAM, Batch, BatchResult, Chunk, Stream, point_array
from pipeline.artefacts.to_tables import poses_table, xyz_columns
from pipeline.config.pool import Georeference
from pipeline.config.stage_settings import LaserPlacement, SonarPlacement
from pipeline.config.target import Target
from pipeline.errors import RawDataError
from pipeline.gps_time import NS
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.geometry.passes import pass_of
from pipeline.maths.geometry.trajectory import GeodeticPoses, Trajectory, poses_in_pool
from pipeline.maths.sonar.ray_tracing import Cast
from pipeline.maths.sonar.soundings import points_in_mbes, refracted_points
from pipeline.mount import mount_of
from pipeline.target.design import target_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Config:
    target: Target
    georeference: Georeference
    laser: LaserPlacement
    mbes: SonarPlacement | None  # none: the laser is calibrated


@dataclass(frozen=True)
class Inputs:
    trajectory: Annotated[pd.DataFrame, TRAJECTORY]
    passes: Annotated[pd.DataFrame, PASSES]
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    laser_points: Annotated[Stream, LASER_POINTS]
    soundings: Annotated[Stream, SOUNDINGS]


@dataclass(frozen=True)
class Outputs:
    poses: Annotated[pd.DataFrame, POSES]
    counts: Annotated[pd.DataFrame, GEOREFERENCE_COUNTS]
    laser_pool: Annotated[Stream, LASER_POOL] = EMPTY_STREAM
    soundings_pool: Annotated[Stream, SOUNDINGS_POOL] = EMPTY_STREAM


@dataclass(frozen=True)
class Prepared:
    """The pool frame, the trajectory in it, the passes, and the box round the target (pool frame)."""

    frame: PoolFrame
    trajectory: Trajectory
    starts_ns: NDArray[np.int64]
    ends_ns: NDArray[np.int64]
    box_low_m: Array
    box_high_m: Array


def prepare(inputs: Inputs, config: Config) -> Prepared:
    """Turn the INS records into poses in the pool frame."""
    origin = inputs.pool_frame.iloc[0]
    frame = PoolFrame.at(
        np.radians(origin["latitude_deg"]),
        np.radians(origin["longitude_deg"]),
        float(origin["height_m"]),
        np.radians(origin["azimuth_deg"]),
    )
    names = ("latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")
    ins = GeodeticPoses(**{name: inputs.trajectory[name].to_numpy() for name in names})
    positions, R_pool_from_body = poses_in_pool(frame, ins)
    low, high = target_of(config.target).bounds()
    margin = config.georeference.box_margin_m
    return Prepared(
        frame=frame,
        trajectory=Trajectory.build(inputs.trajectory["t_ns"].to_numpy(), positions, R_pool_from_body),
        starts_ns=inputs.passes["start_ns"].to_numpy(),
        ends_ns=inputs.passes["end_ns"].to_numpy(),
        box_low_m=low - margin,
        box_high_m=high + margin,
    )


def run_batch(source: str, chunk: Chunk, prepared: Prepared, config: Config) -> BatchResult:
    """Place the points of one chunk in the pool frame, and keep those within the box round the target."""
    columns = chunk.columns
    t_ns = columns["t_ns"]
    number = pass_of(t_ns, prepared.starts_ns, prepared.ends_ns)
    covered = prepared.trajectory.covers(t_ns, round(config.georeference.max_ins_interval_s * NS))
    counts = {"outside every pass": int((number < 0).sum()), "hole in the INS": int(((number >= 0) & ~covered).sum())}
    rows = np.flatnonzero((number >= 0) & covered)
    if len(rows) < len(t_ns):
        columns = {name: values[rows] for name, values in columns.items()}
        t_ns, number = columns["t_ns"], number[rows]
    if source == "laser_points":
        sensor, pool = _laser(t_ns, point_array(columns, "m"), prepared, config)
        inside = np.ones(len(t_ns), dtype=bool)
    elif config.mbes is not None:
        sensor, pool, inside = _soundings(columns, prepared, config.mbes, config.target.water_level_m)
        counts["angle impossible with the given sound speed"] = int((~inside).sum())
    else:
        raise TypeError("soundings without a sonar")
    possible = int(inside.sum())
    for values, low, high in zip(pool.T, prepared.box_low_m, prepared.box_high_m, strict=True):
        inside &= (values >= low) & (values <= high)
    near = np.flatnonzero(inside)
    counts |= {"outside the box round the target": possible - len(near), "used": len(near)}
    kept: dict[str, NDArray[Any]] = {"t_ns": t_ns[near], "pass": number[near]}
    if source == "soundings":
        kept |= {name: columns[name][near] for name in ("ping", "beam")}
    frame, stream = ("laser", "laser_pool") if source == "laser_points" else ("mbes", "soundings_pool")
    kept |= xyz_columns(f"{{}}_{frame}_m", sensor[near].T) | xyz_columns("{}_pool_m", pool[near].T)
    return BatchResult({stream: kept}, counts)


def _laser(t_ns: NDArray[np.int64], points: Array, prepared: Prepared, config: Config) -> tuple[Array, Array]:
    """Return points in the scanner's frame and in the pool frame, whichever of the two the files hold."""
    mount = mount_of(config.laser.mount)
    if config.laser.frame == "laser":
        body = (mount.R_body_from_sensor @ points.T).T + mount.lever_arm_body_m
        return points, prepared.trajectory.points_from_body(t_ns, body)
    pool = prepared.frame.points_from_ecef(points)
    positions, R_pool_from_body = prepared.trajectory.poses_at(t_ns)
    body = np.einsum("nji,nj->ni", R_pool_from_body, pool - positions)
    return (body - mount.lever_arm_body_m) @ mount.R_body_from_sensor, pool


def _soundings(
    columns: Batch, prepared: Prepared, mbes: SonarPlacement, water_level_m: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return soundings in the mbes frame and in the pool frame, and which of them are possible."""
    t_ns, recorded_m_s = columns["t_ns"], columns["sound_speed_m_s"]
    sensor, possible = points_in_mbes(
        columns["two_way_time_s"],
        columns["angle_rad"],
        columns["transmit_tilt_rad"],
        recorded_m_s,
        true_sound_speed_m_s=mbes.sound_speed_m_s,
        projector_offset_m=None if mbes.projector_offset_m is None else np.array(mbes.projector_offset_m),
    )
    mount = mount_of(mbes.mount)
    if mbes.svp is not None:
        # The rays are bent by the cast; its depths are below the water's surface.
        positions, R_pool_from_body = prepared.trajectory.poses_at(t_ns)
        head = positions + R_pool_from_body @ mount.lever_arm_body_m
        sensor = refracted_points(
            sensor,
            recorded_m_s if mbes.sound_speed_m_s is None else np.full(len(t_ns), mbes.sound_speed_m_s),
            R_pool_from_body @ mount.R_body_from_sensor,
            water_level_m - head[:, 2],
            Cast(*np.array(mbes.svp, dtype=np.float64).T),
        )
    body = sensor @ mount.R_body_from_sensor.T + mount.lever_arm_body_m
    return sensor, prepared.trajectory.points_from_body(t_ns, body), possible


def combine(prepared: Prepared, partials: dict[str, list[tuple[str, dict[str, int]]]], config: Config) -> Outputs:
    """Sum the counts, and write the poses.

    Raises
    ------
    RawDataError
        A sensor has no point within the box round the target.
    """
    counts = counts_table(partials)
    for source, sensor in (("laser_points", "laser"), ("soundings", "mbes")):
        if sensor == "mbes" and config.mbes is None:
            continue
        reasons = why_none_used(counts, source)
        if reasons is not None:
            of_source = by_reason(counts, source)
            if of_source["hole in the INS"] > of_source.sum() / 2:
                raise RawDataError(
                    f"{sensor}: no point could be placed ({reasons}): INS records lie more than "
                    f"{config.georeference.max_ins_interval_s:g} s apart; log the INS faster, 100 Hz or more"
                )
            placing = "laser.frame" if sensor == "laser" and config.laser.frame != "laser" else f"{sensor}.mount"
            raise RawDataError(
                f"{sensor}: no point within {config.georeference.box_margin_m:g} m of the target ({reasons}); "
                f"check target.origin, target.azimuth_deg and {placing}: poolcal check tells which sign, clock or "
                "height would bring points there"
            )
    return Outputs(poses=poses_table(prepared.trajectory), counts=counts)
