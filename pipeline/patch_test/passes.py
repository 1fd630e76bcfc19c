"""Soundings of passes over the bottom, as recorded, and the boat's track: what a patch test is made from."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.ins_drift import drift_prior
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
from pipeline.maths.adjustment.drift_likelihood import DriftPrior
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.geometry.passes import find_passes, pass_of
from pipeline.mount import Mounted, mount_of

Array = NDArray[np.float64]
MOST = 1_500_000  # soundings of the sample, in whole pings
NEAR_M, DEEPEST_M = 0.3, 20.0  # the sonar lies so far above the water (heave, an error of the height), or below it
BLOCK = 200_000  # soundings that are placed at a time
COLUMNS = ("t_ns", "two_way_time_s", "angle_rad", "transmit_tilt_rad", "sound_speed_m_s")  # that place a sounding


@dataclass(frozen=True)
class PatchPasses:
    """A head's soundings in passes, in order of time, and the track.

    columns: as the reader gives them; number_of_pass (n,); context: the trajectory in a frame x east, y north, z up at
    the first INS record; noise: the errors of the INS; drift: how well the figures of its drift are known; mbes: the
    head's settings; level_m: z of the water; read: number of all soundings.
    """

    columns: Batch
    number_of_pass: NDArray[np.int16]
    context: PoolContext
    noise: PoseNoise
    drift: DriftPrior
    mbes: SonarPlacement
    level_m: float
    read: int

    def placed(self, mount: Mounted) -> tuple[Array, Array]:
        """Return the soundings (n, 3) in the head's frame and in the level frame, by a mount.

        One that cannot be (it would have to be steered beyond 90°) has NaN.
        """
        at = self.mbes.model_copy(update={"mount": self.mbes.mount.model_copy(update=mount.settings())})
        own, level = np.empty((2, len(self.number_of_pass), 3))
        for start in range(0, len(own), BLOCK):
            rows = slice(start, start + BLOCK)
            block = {name: column[rows] for name, column in self.columns.items()}
            own[rows], level[rows], possible = soundings_in_pool(block, self.context, at, self.level_m)
            level[rows][~possible] = np.nan
        return own, level


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
    read, _, sample = sampled(soundings.fold(_drawn, context), MOST)
    if not sample or not len(sample["t_ns"]):
        raise RawDataError(
            f"mbes: none of {read:,} soundings lies within the time of the INS, between records no more than "
            f"{MAX_INTERVAL_NS / NS:g} s apart; look at the clocks"
        )
    context = with_passes(context, np.unique(sample["t_ns"]))
    number = pass_of(sample["t_ns"], context.starts_ns, context.ends_ns)
    rows = np.flatnonzero(number >= 0)
    return PatchPasses(
        columns={name: column[rows] for name, column in sample.items() if name != "drawn"},
        number_of_pass=number[rows],
        context=context,
        noise=noise_over_all(session.ins, sigmas, records["t_ns"].to_numpy()),
        drift=drift_prior(session.ins.drift_within),
        mbes=mbes,
        level_m=_level_m(context, mbes, float(records["height_m"].iloc[0]), water_height_m),
        read=read,
    )


def _drawn(batch: Batch, context: PoolContext) -> tuple[int, Columns]:
    """Return the number of a batch's soundings, and the columns of those that the INS covers."""
    t_ns = np.asarray(batch["t_ns"], dtype=np.int64)
    rows = np.flatnonzero(context.trajectory.covers(t_ns, MAX_INTERVAL_NS))
    columns = {name: np.asarray(batch[name])[rows] for name in COLUMNS}
    return len(t_ns), columns | {"drawn": scattered(t_ns[rows])}


def with_passes(context: PoolContext, ping_t_ns: NDArray[np.int64]) -> PoolContext:
    """Return the context with the passes: the boat turns back along their direction, or the records have a gap.

    Passes lead both ways, so their direction is half the mean of the doubled directions of the boat's steps of a
    second, as long as the sonar pings; a step counts by its length.
    """
    track, limits = context.trajectory, Ingest()
    seconds = np.arange(ping_t_ns[0], ping_t_ns[-1], NS)
    at = np.unique(np.minimum(np.searchsorted(track.t_ns, seconds), len(track.t_ns) - 1))
    step = np.diff(track.positions_m[at, :2], axis=0) @ np.array([1.0, 1.0j])
    doubled = np.sum(step**2 / np.maximum(np.abs(step), np.finfo(float).tiny))
    direction = np.exp(0.5j * np.angle(doubled))
    along_m = track.positions_m[:, :2] @ np.array([direction.real, direction.imag])
    passes = find_passes(track.t_ns, along_m, ping_t_ns, round(limits.max_gap_s * NS), limits.reversal_m)
    if not passes:
        raise RawDataError("session.yaml: ins and mbes never ran together for a second; look at the logs")
    starts, ends = (np.array(times, dtype=np.int64) for times in zip(*passes, strict=True))
    return replace(context, starts_ns=starts, ends_ns=ends)


def _level_m(context: PoolContext, mbes: SonarPlacement, first_m: float, water_height_m: float | None) -> float:
    """Return z of the water: as given, or the sonar's highest place; first_m: height of the INS's first record."""
    arm_up_m = context.trajectory.R_frame_from_body[:, 2, :] @ mount_of(mbes.mount).lever_arm_body_m
    highest_m = float((context.trajectory.positions_m[:, 2] + arm_up_m).max())
    if water_height_m is None:
        return highest_m
    above_m = water_height_m - first_m - highest_m
    if not -NEAR_M < above_m < DEEPEST_M:
        where = f"{-above_m:.1f} m below" if above_m < 0 else f"{above_m:.1f} m above"
        raise RawDataError(
            f"--water-height {water_height_m:g}: lies {where} the sonar; give the height of the water in the INS's "
            "datum, not a depth"
        )
    return highest_m + above_m
