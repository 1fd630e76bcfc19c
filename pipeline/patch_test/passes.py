"""Soundings of passes over the bottom, as recorded, and the boat's track: what a patch test is made from."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import scattered
from pipeline.artefacts.streams import Batch, Stream
from pipeline.config.pool import Ingest
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import SonarPlacement
from pipeline.errors import RawDataError
from pipeline.finding.kept_points import MAX_INTERVAL_NS, Columns, level_context, sampled
from pipeline.finding.reading import noise_over_all, read_files
from pipeline.georeference.placement import soundings_in_pool
from pipeline.georeference.pool_context import PoolContext
from pipeline.gps_time import NS
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.geometry.passes import find_passes, pass_of
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import Mounted, mount_of

Array = NDArray[np.float64]
MOST = 600_000  # soundings of the sample, in whole pings


@dataclass(frozen=True)
class PatchPasses:
    """A head's soundings in passes, in order of time, and the track.

    columns: as the reader gives them; number_of_pass (n,); context: the trajectory in a frame x east, y north, z up at
    the first INS record; noise: the errors of the INS; mbes: the head's settings; level_m: z of the water; read: number
    of all soundings.
    """

    columns: Batch
    number_of_pass: NDArray[np.int16]
    context: PoolContext
    noise: PoseNoise
    mbes: SonarPlacement
    level_m: float
    read: int

    def placed(self, mount: Mounted) -> tuple[Array, Array]:
        """Return the soundings (n, 3) in the head's frame and in the level frame, by a mount.

        One that cannot be (it would have to be steered beyond 90°) has NaN.
        """
        at = self.mbes.model_copy(update={"mount": self.mbes.mount.model_copy(update=mount.settings())})
        own, level, possible = soundings_in_pool(self.columns, self.context, at, self.level_m)
        return own, np.where(possible[:, None], level, np.nan)


def read_passes(
    ins: Stream, soundings: Stream, session: SessionConfig, mbes: SonarPlacement, water_height_m: float | None
) -> PatchPasses:
    """Return the passes of one head.

    Parameters
    ----------
    ins, soundings
        Records of the INS, and soundings of the head, as the readers give them.
    session
        The session's settings.
    mbes
        The head's settings.
    water_height_m
        Height of the water in the INS's datum; None: about that of the head.
    """
    records, sigmas, _ = read_files(ins, Stream((), ins.mapper, ins.here))
    context = level_context(records)
    read, sample = sampled(soundings.fold(_drawn, context), MOST)
    if not sample or not len(sample["t_ns"]):
        raise RawDataError(f"mbes: none of {read:,} soundings lies within the time of the INS; look at the clocks")
    context = _with_passes(context, records["azimuth_rad"].to_numpy(), np.unique(sample["t_ns"]))
    number = pass_of(sample["t_ns"], context.starts_ns, context.ends_ns)
    rows = np.flatnonzero(number >= 0)
    heights = context.trajectory.positions_m[:, 2] + _arm_up(context.trajectory, mbes)
    return PatchPasses(
        columns={name: column[rows] for name, column in sample.items() if name != "drawn"},
        number_of_pass=number[rows],
        context=context,
        noise=noise_over_all(session.ins, sigmas, records["t_ns"].to_numpy()),
        mbes=mbes,
        level_m=float(heights.max()) if water_height_m is None else water_height_m - float(records["height_m"].iloc[0]),
        read=read,
    )


def _drawn(batch: Batch, context: PoolContext) -> tuple[int, Columns]:
    """Return the number of a batch's soundings, and the columns of those that the INS covers."""
    t_ns = np.asarray(batch["t_ns"], dtype=np.int64)
    rows = np.flatnonzero(context.trajectory.covers(t_ns, MAX_INTERVAL_NS))
    columns = {name: np.asarray(column)[rows] for name, column in batch.items()}
    return len(t_ns), columns | {"drawn": scattered(t_ns[rows])}


def _with_passes(context: PoolContext, heading_rad: Array, ping_t_ns: NDArray[np.int64]) -> PoolContext:
    """Return the context with the passes: the boat turns back along their direction, or the records have a gap.

    PatchPasses run both ways, so their direction is half the mean of the doubled headings.
    """
    track, limits = context.trajectory, Ingest()
    direction = 0.5 * float(np.angle(np.mean(np.exp(2j * heading_rad))))
    along_m = track.positions_m[:, :2] @ np.array([np.sin(direction), np.cos(direction)])
    passes = find_passes(track.t_ns, along_m, ping_t_ns, round(limits.max_gap_s * NS), limits.reversal_m)
    if not passes:
        raise RawDataError("session.yaml: ins and mbes never ran together for a second; look at the logs")
    starts, ends = (np.array(times, dtype=np.int64) for times in zip(*passes, strict=True))
    return replace(context, starts_ns=starts, ends_ns=ends)


def _arm_up(trajectory: Trajectory, mbes: SonarPlacement) -> Array:
    """Return how far the head lies above the INS, (n,) m."""
    return np.asarray(trajectory.R_frame_from_body[:, 2, :] @ mount_of(mbes.mount).lever_arm_body_m)
