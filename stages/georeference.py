"""Place the points in the pool frame, and drop the points that are far from the target.

Attitude is interpolated on the rotation group. Positions are converted through ECEF.
"""

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
from pipeline.artefacts.streams import EMPTY_STREAM, BatchResult, Chunk, Stream, point_array
from pipeline.artefacts.to_tables import poses_table, xyz_columns
from pipeline.artefacts.water_levels import uncovered, water_levels
from pipeline.config.pool import Georeference
from pipeline.config.stage_settings import LaserPlacement, SonarPlacement
from pipeline.config.target import Target
from pipeline.errors import RawDataError
from pipeline.georeference.placement import laser_in_pool, soundings_in_pool
from pipeline.georeference.pool_context import PoolContext
from pipeline.gps_time import NS
from pipeline.maths.geometry.passes import FARTHEST_PASS_M, pass_of
from pipeline.target.design import target_of


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses."""

    target: Target
    georeference: Georeference
    laser: LaserPlacement
    mbes: SonarPlacement | None  # None: the laser is calibrated


@dataclass(frozen=True)
class Inputs:
    """Tables and streams that the stage reads."""

    trajectory: Annotated[pd.DataFrame, TRAJECTORY]
    passes: Annotated[pd.DataFrame, PASSES]
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    laser_points: Annotated[Stream, LASER_POINTS]
    soundings: Annotated[Stream, SOUNDINGS]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    poses: Annotated[pd.DataFrame, POSES]
    counts: Annotated[pd.DataFrame, GEOREFERENCE_COUNTS]
    laser_pool: Annotated[Stream, LASER_POOL] = EMPTY_STREAM
    soundings_pool: Annotated[Stream, SOUNDINGS_POOL] = EMPTY_STREAM


@dataclass(frozen=True)
class Prepared:
    """The poses of the INS in the pool frame, with the passes and the box; heights (p,) of the water in each pass."""

    context: PoolContext
    levels_m: NDArray[np.float64]


def prepare(inputs: Inputs, config: Config) -> Prepared:
    """Return the poses of the INS in the pool frame, with the passes and the box round the target.

    Raises
    ------
    RawDataError
        Readings of the water do not cover a pass at the target.
    """
    low, high = target_of(config.target).bounds()
    margin = config.georeference.box_margin_m
    context = PoolContext.of(inputs.trajectory, inputs.passes, inputs.pool_frame, (low - margin, high + margin))
    by_time = config.target.water_by_time
    if by_time is not None and by_time.readings is not None:
        near = inputs.passes[inputs.passes["distance_m"].abs() <= FARTHEST_PASS_M]
        if words := uncovered(by_time.readings, near["start_ns"].tolist(), near["end_ns"].tolist()):
            raise RawDataError(words)
    levels_m, _ = water_levels(config.target, context.trajectory, context.starts_ns, context.ends_ns)
    return Prepared(context, levels_m)


def run_batch(source: str, chunk: Chunk, prepared: Prepared, config: Config) -> BatchResult:
    """Place the points of one chunk in the pool frame, and keep the points within the box round the target."""
    columns, context = chunk.columns, prepared.context
    t_ns = columns["t_ns"]
    number = pass_of(t_ns, context.starts_ns, context.ends_ns)
    covered = context.trajectory.covers(t_ns, round(config.georeference.max_ins_interval_s * NS))
    counts = {"outside every pass": int((number < 0).sum()), "hole in the INS": int(((number >= 0) & ~covered).sum())}
    rows = np.flatnonzero((number >= 0) & covered)
    if len(rows) < len(t_ns):
        columns = {name: values[rows] for name, values in columns.items()}
        t_ns, number = columns["t_ns"], number[rows]
    if source == "laser_points":
        sensor, pool = laser_in_pool(t_ns, point_array(columns, "m"), context, config.laser)
        inside = np.ones(len(t_ns), dtype=bool)
    elif config.mbes is not None:
        sensor, pool, inside = soundings_in_pool(columns, context, config.mbes, prepared.levels_m[number])
        counts["angle impossible with the given sound speed"] = int((~inside).sum())
    else:
        raise TypeError("soundings without a sonar")
    possible = int(inside.sum())
    for values, low, high in zip(pool.T, context.box_low_m, context.box_high_m, strict=True):
        inside &= (values >= low) & (values <= high)
    near = np.flatnonzero(inside)
    counts |= {"outside the box round the target": possible - len(near), "used": len(near)}
    kept: dict[str, NDArray[Any]] = {"t_ns": t_ns[near], "pass": number[near]}
    if source == "soundings":
        kept |= {name: columns[name][near] for name in ("ping", "beam")}
    frame, stream = ("laser", "laser_pool") if source == "laser_points" else ("mbes", "soundings_pool")
    kept |= xyz_columns(f"{{}}_{frame}_m", sensor[near].T) | xyz_columns("{}_pool_m", pool[near].T)
    return BatchResult({stream: kept}, counts)


def combine(prepared: Prepared, partials: dict[str, list[tuple[str, dict[str, int]]]], config: Config) -> Outputs:
    """Return the poses and the sums of the counts.

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
    return Outputs(poses=poses_table(prepared.context.trajectory), counts=counts)
