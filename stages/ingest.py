"""Raw instrument files -> canonical streams and tables, with quality control."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import (
    FILES,
    GAPS,
    INGEST_COUNTS,
    INS_SIGMAS,
    LASER_POINTS,
    PASSES,
    POOL_FRAME,
    SOUNDINGS,
    TRAJECTORY,
)
from pipeline.artefacts.schema import Raw
from pipeline.artefacts.streams import EMPTY, Chunk, Piece, Stream
from pipeline.config.pool import Ingest, TargetPlace
from pipeline.config.recording import Recordings
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, utc_text
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.maths.geometry.passes import estimate_azimuth, find_passes, pass_of
from pipeline.readers.file_summaries import Seen, counts_of, files_of, gaps_between, refuse_apart, refuse_empty, thinned

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Config:
    target_place: TargetPlace
    ingest: Ingest
    recordings: Recordings


@dataclass(frozen=True)
class Inputs:
    ins: Annotated[Stream, Raw("ins")]
    laser: Annotated[Stream, Raw("laser")]
    mbes: Annotated[Stream, Raw("mbes")]


@dataclass(frozen=True)
class Outputs:
    trajectory: Annotated[pd.DataFrame, TRAJECTORY]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    passes: Annotated[pd.DataFrame, PASSES]
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    files: Annotated[pd.DataFrame, FILES]
    gaps: Annotated[pd.DataFrame, GAPS]
    counts: Annotated[pd.DataFrame, INGEST_COUNTS]
    laser_points: Annotated[Stream, LASER_POINTS] = EMPTY
    soundings: Annotated[Stream, SOUNDINGS] = EMPTY


def prepare(inputs: Inputs, config: Config) -> None:
    return None


def run_batch(source: str, chunk: Chunk, prepared: None, config: Config) -> Piece:
    t_ns = np.asarray(chunk.columns["t_ns"], dtype=np.int64) if chunk.columns else np.empty(0, np.int64)
    dropped = dict(chunk.dropped)
    if source == "ins":
        accuracy, sigmas = not chunk.columns, thinned(chunk.sigmas)
        epochs = sigmas.get("t_ns", t_ns) if accuracy else t_ns
        return Piece({}, Seen(len(t_ns), dropped, epochs, dict(chunk.columns), sigmas, accuracy))
    if source == "laser":
        return Piece({"laser_points": chunk.columns}, Seen(len(t_ns), dropped, _seconds(t_ns), {}))
    speed = np.asarray(chunk.columns["sound_speed_m_s"]) if len(t_ns) else np.empty(0)
    lowest, highest = (float(speed.min()), float(speed.max())) if len(speed) else (np.inf, -np.inf)
    seen = Seen(
        len(t_ns), dropped, np.unique(t_ns), {}, lowest_speed_m_s=lowest, highest_speed_m_s=highest
    )
    return Piece({"soundings": chunk.columns}, seen)


def combine(prepared: None, partials: dict[str, list[tuple[str, Seen]]], config: Config) -> Outputs:
    refuse_empty({sensor: seen for sensor, seen in partials.items() if sensor != "mbes" or config.recordings.mbes})
    trajectory, backwards = _trajectory([seen.trajectory for _, seen in partials["ins"] if seen.count])
    ins_t = trajectory["t_ns"].to_numpy()
    epochs = {
        sensor: np.unique(np.concatenate([seen.epochs_ns for _, seen in partials[sensor]]))
        for sensor in ("laser", "mbes")
        if partials[sensor]
    }
    refuse_apart((ins_t[0], ins_t[-1]), {sensor: (t_ns[0], t_ns[-1]) for sensor, t_ns in epochs.items()})
    sounded = "mbes" if "mbes" in epochs else "laser"  # by what passes are told
    pool_frame, frame = _pool_frame(trajectory, config.target_place)
    max_gap_ns = round(config.ingest.max_gap_s * NS)
    sigmas, outside = _sigmas(partials["ins"], int(ins_t[0]), int(ins_t[-1]))
    counts = counts_of(partials, {"ins": backwards}, outside)
    return Outputs(
        trajectory=trajectory,
        ins_sigmas=sigmas,
        passes=_passes(trajectory, frame, epochs[sounded], max_gap_ns, config.ingest.reversal_m),
        pool_frame=pool_frame,
        files=files_of(partials),
        gaps=gaps_between({"ins": ins_t, sounded: epochs[sounded]}, max_gap_ns),
        counts=counts,
    )


def _seconds(t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first moment of each second in which there is one, and the last of all."""
    if not len(t_ns):
        return t_ns
    ordered = np.sort(t_ns)
    first = np.flatnonzero(np.diff(ordered // NS, prepend=-1))
    return np.append(ordered[first], ordered[-1])


def _trajectory(chunks: list[Columns]) -> tuple[pd.DataFrame, int]:
    """All INS records in order of time; of equal times the first; how many that left out."""
    chunks = sorted(chunks, key=lambda columns: int(columns["t_ns"][0]))
    table = pd.DataFrame(
        {c.name: np.concatenate([columns[c.name] for columns in chunks]) for c in TRAJECTORY.columns}
    )
    order = np.argsort(table["t_ns"].to_numpy(), kind="stable")
    table = table.iloc[order]
    keep = np.diff(table["t_ns"].to_numpy(), prepend=np.iinfo(np.int64).min // 2) > 0
    return table[keep].reset_index(drop=True), int((~keep).sum())


def _sigmas(pieces: list[tuple[str, Seen]], start: int, end: int) -> tuple[pd.DataFrame, int]:
    """What the INS states of its accuracy while it ran, in order of time; and how many rows lie outside."""
    for name in dict.fromkeys(name for name, seen in pieces if seen.accuracy):
        times = np.concatenate([seen.epochs_ns for other, seen in pieces if other == name])
        if not len(times):
            raise RawDataError(f"{name}: no usable accuracy record; export it again, or take it out of ins.accuracy")
        if times.max() < start or times.min() > end:
            raise RawDataError(
                f"{name}: no time overlap: ins {utc_text(start)} to {utc_text(end)}, "
                f"accuracy {utc_text(int(times.min()))} to {utc_text(int(times.max()))}; give the one of this SBET"
            )
    names = [column.name for column in INS_SIGMAS.columns]
    told = [seen.sigmas for _, seen in pieces if seen.sigmas]
    if not told:
        return pd.DataFrame(columns=names), 0
    table = pd.DataFrame(thinned({name: np.concatenate([one[name] for one in told]) for name in names}))
    inside = table["t_ns"].between(start, end)
    return table[inside].reset_index(drop=True), int((~inside).sum())


def _pool_frame(trajectory: pd.DataFrame, target: TargetPlace) -> tuple[pd.DataFrame, PoolFrame]:
    origin = target.origin
    place = (np.radians(origin.latitude_deg), np.radians(origin.longitude_deg), origin.height_m)
    azimuth = target.azimuth_deg
    if azimuth is None:
        level = PoolFrame.at(*place, 0.0)
        geodetic = (trajectory[name].to_numpy() for name in ("latitude_rad", "longitude_rad", "height_m"))
        points = level.points_from_ecef(ecef_from_geodetic(*geodetic))
        estimate = estimate_azimuth(points[:, 0], points[:, 1], trajectory["azimuth_rad"].to_numpy())
        if estimate is None:
            raise RawDataError(
                "target.azimuth_deg is not given and the boat never had target.origin within 20 m to starboard; "
                "give azimuth_deg, or check target.origin"
            )
        azimuth = float(np.degrees(estimate))
    table = pd.DataFrame(
        {
            "latitude_deg": [origin.latitude_deg],
            "longitude_deg": [origin.longitude_deg],
            "height_m": [origin.height_m],
            "azimuth_deg": [azimuth],
            "azimuth_estimated": [target.azimuth_deg is None],
        }
    )
    return table, PoolFrame.at(*place, float(np.radians(azimuth)))


def _passes(
    trajectory: pd.DataFrame, frame: PoolFrame, pings: NDArray[np.int64], max_gap_ns: int, reversal_m: float
) -> pd.DataFrame:
    t_ns = trajectory["t_ns"].to_numpy()
    geodetic = (trajectory[name].to_numpy() for name in ("latitude_rad", "longitude_rad", "height_m"))
    points = frame.points_from_ecef(ecef_from_geodetic(*geodetic))
    passes = find_passes(t_ns, points[:, 1], pings, max_gap_ns, reversal_m)
    if not passes:
        raise RawDataError(
            "session.yaml: ins and mbes never ran together for a second without a gap above "
            f"{max_gap_ns / NS:g} s; check the logs, or raise ingest.max_gap_s"
        )
    starts, ends = (np.array(column, dtype=np.int64) for column in zip(*passes, strict=True))
    number = pass_of(t_ns, starts, ends)
    rows = []
    for k, (start, end) in enumerate(passes):
        inside = number == k
        along, athwart = points[inside, 1], np.abs(points[inside, 0])
        abeam = np.abs(along) <= athwart
        seconds = (end - start) / NS
        heading = trajectory["azimuth_rad"].to_numpy()[inside]
        mean = np.arctan2(np.sin(heading).mean(), np.cos(heading).mean()) if inside.any() else np.nan
        swing = np.sqrt(np.mean(np.angle(np.exp(1j * (heading - mean))) ** 2)) if inside.any() else np.nan
        rows.append(
            {
                "pass": k,
                "start_ns": start,
                "end_ns": end,
                "duration_s": seconds,
                "length_m": float(along[-1] - along[0]) if inside.any() else np.nan,
                "speed_m_s": abs(float(along[-1] - along[0])) / seconds if inside.any() else np.nan,
                "azimuth_deg": float(np.degrees(mean)),
                "heading_swing_deg": float(np.degrees(swing)),
                "distance_m": float(np.median(athwart[abeam] if abeam.any() else athwart)) if inside.any() else np.nan,
            }
        )
    return pd.DataFrame(rows)
