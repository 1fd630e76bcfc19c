"""Read raw instrument files into streams and tables with the same columns for all formats; quality control."""

from dataclasses import dataclass
from typing import Annotated

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
    UNSOUNDED_PASSES,
)
from pipeline.artefacts.schema import RawFiles
from pipeline.artefacts.streams import EMPTY_STREAM, BatchResult, Chunk, Stream
from pipeline.config.pool import Ingest, TargetPlace
from pipeline.config.recording import Recordings
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, utc_text
from pipeline.readers.file_summaries import (
    ChunkSummary,
    Summaries,
    different_milliseconds,
    files_table,
    gaps_table,
    ingest_counts_table,
    refuse_disjoint_times,
    refuse_empty_sensors,
    refuse_times_of_reception,
    thin_sigmas,
)
from pipeline.readers.track_tables import passes_table, pool_frame_table, trajectory_table
from pipeline.readers.unsounded_passes import unsounded_passes_table

_OF_A_SOUNDING = ("sound_speed_m_s", "two_way_time_s")


@dataclass(frozen=True)
class Config:
    """Settings that the stage uses."""

    target_place: TargetPlace
    ingest: Ingest
    recordings: Recordings


@dataclass(frozen=True)
class Inputs:
    """Raw files by sensor."""

    ins: Annotated[Stream, RawFiles("ins")]
    laser: Annotated[Stream, RawFiles("laser")]
    mbes: Annotated[Stream, RawFiles("mbes")]


@dataclass(frozen=True)
class Outputs:
    """Tables and streams that the stage writes."""

    trajectory: Annotated[pd.DataFrame, TRAJECTORY]
    ins_sigmas: Annotated[pd.DataFrame, INS_SIGMAS]
    passes: Annotated[pd.DataFrame, PASSES]
    unsounded_passes: Annotated[pd.DataFrame, UNSOUNDED_PASSES]
    pool_frame: Annotated[pd.DataFrame, POOL_FRAME]
    files: Annotated[pd.DataFrame, FILES]
    gaps: Annotated[pd.DataFrame, GAPS]
    counts: Annotated[pd.DataFrame, INGEST_COUNTS]
    laser_points: Annotated[Stream, LASER_POINTS] = EMPTY_STREAM
    soundings: Annotated[Stream, SOUNDINGS] = EMPTY_STREAM


def prepare(inputs: Inputs, config: Config) -> None:
    """Prepare nothing: chunks are independent of each other."""
    return None


def run_batch(source: str, chunk: Chunk, prepared: None, config: Config) -> BatchResult:
    """Pass on a chunk of laser points or soundings, and summarise it.

    Parameters
    ----------
    source : str
        ins, laser or mbes.
    chunk : Chunk
        Rows of one raw file.
    prepared, config
        Not used.

    Returns
    -------
    BatchResult
        Its partial result is a ChunkSummary, which has all rows of an ins chunk.
    """
    t_ns = np.asarray(chunk.columns["t_ns"], dtype=np.int64) if chunk.columns else np.empty(0, np.int64)
    dropped = dict(chunk.dropped)
    if source == "ins":
        accuracy, sigmas = not chunk.columns, thin_sigmas(chunk.sigmas)
        summary = ChunkSummary(
            count=len(t_ns),
            dropped=dropped,
            epochs_ns=sigmas.get("t_ns", t_ns) if accuracy else t_ns,
            trajectory=dict(chunk.columns),
            sigmas=sigmas,
            accuracy=accuracy,
        )
        return BatchResult({}, summary)
    if source == "laser":
        return BatchResult({"laser_points": chunk.columns}, ChunkSummary(len(t_ns), dropped, _one_a_second(t_ns)))
    speed, way = (np.asarray(chunk.columns[name]) if len(t_ns) else np.empty(0) for name in _OF_A_SOUNDING)
    lowest, highest = (float(speed.min()), float(speed.max())) if len(speed) else (np.inf, -np.inf)
    summary = ChunkSummary(
        len(t_ns),
        dropped,
        np.unique(t_ns),
        lowest_speed_m_s=lowest,
        highest_speed_m_s=highest,
        echoes=different_milliseconds(t_ns, way),
    )
    return BatchResult({"soundings": chunk.columns}, summary)


def combine(prepared: None, partials: dict[str, list[tuple[str, ChunkSummary]]], config: Config) -> Outputs:
    """Join the INS records, find the passes, and write the tables of files, gaps and counts.

    Parameters
    ----------
    prepared
        Not used.
    partials : dict
        By sensor: pairs of a part's name and the summary of one of its chunks.
    config : Config
        Settings.

    Raises
    ------
    RawDataError
        A sensor has no usable record, or no record while the INS recorded, or the soundings have the times of
        reception, or the azimuth of the target cannot be estimated.
    """
    recorded = {name: summaries for name, summaries in partials.items() if name != "mbes" or config.recordings.mbes}
    refuse_empty_sensors(recorded)
    refuse_times_of_reception(partials["mbes"])
    trajectory, repeated = trajectory_table([summary.trajectory for _, summary in partials["ins"] if summary.count])
    ins_t = trajectory["t_ns"].to_numpy()
    epochs = {
        sensor: np.unique(np.concatenate([summary.epochs_ns for _, summary in partials[sensor]]))
        for sensor in ("laser", "mbes")
        if partials[sensor]
    }
    refuse_disjoint_times((ins_t[0], ins_t[-1]), {sensor: (t_ns[0], t_ns[-1]) for sensor, t_ns in epochs.items()})
    calibrated = "mbes" if "mbes" in epochs else "laser"  # no pass extends beyond the epochs of this sensor
    pool_frame, frame = pool_frame_table(trajectory, config.target_place)
    max_gap_ns = round(config.ingest.max_gap_s * NS)
    limits = (max_gap_ns, config.ingest.reversal_m)
    passes = passes_table(trajectory, frame, epochs[calibrated], *limits)
    sigmas, outside = _sigmas(partials["ins"], int(ins_t[0]), int(ins_t[-1]))
    return Outputs(
        trajectory=trajectory,
        ins_sigmas=sigmas,
        passes=passes,
        unsounded_passes=unsounded_passes_table(trajectory, frame, epochs["laser"], passes, *limits),
        pool_frame=pool_frame,
        files=files_table(partials),
        gaps=gaps_table({"ins": ins_t, calibrated: epochs[calibrated]}, max_gap_ns),
        counts=ingest_counts_table(partials, {"ins": repeated}, outside),
    )


def _one_a_second(t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first time (ns) within each second, and the last of all times."""
    if not len(t_ns):
        return t_ns
    ordered = t_ns if np.all(t_ns[1:] >= t_ns[:-1]) else np.sort(t_ns)
    first = np.flatnonzero(np.diff(ordered // NS, prepend=-1))
    return np.append(ordered[first], ordered[-1])


def _sigmas(summaries: Summaries, start: int, end: int) -> tuple[pd.DataFrame, int]:
    """Return the sigmas in the INS's files from ``start`` to ``end`` (ns), and the number of rows outside this time."""
    for name in dict.fromkeys(name for name, summary in summaries if summary.accuracy):
        times = np.concatenate([summary.epochs_ns for part, summary in summaries if part == name])
        if not len(times):
            raise RawDataError(f"{name}: no usable accuracy record; export it again, or take it out of ins.accuracy")
        if times.max() < start or times.min() > end:
            raise RawDataError(
                f"{name}: no time overlap: ins {utc_text(start)} to {utc_text(end)}, "
                f"accuracy {utc_text(int(times.min()))} to {utc_text(int(times.max()))}; give the one of this SBET"
            )
    names = [column.name for column in INS_SIGMAS.columns]
    chunks = [summary.sigmas for _, summary in summaries if summary.sigmas]
    if not chunks:
        return pd.DataFrame(columns=names), 0
    table = pd.DataFrame(thin_sigmas({name: np.concatenate([chunk[name] for chunk in chunks]) for name in names}))
    inside = table["t_ns"].between(start, end)
    return table[inside].reset_index(drop=True), int((~inside).sum())
