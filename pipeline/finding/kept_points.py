"""A sample of the laser's points round the boat, placed by the INS, in one reading.

A point is kept if the number that its time is scattered to lies below a limit, which falls by half whenever too many
are kept. So the sample does not depend on how the files are divided or how many workers read them, all stretches of the
session have their share, and the memory is the same for any session. Where the files say how many points they have, the
limit begins so low that not many more than are kept are placed.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch, Part, Stream, point_array
from pipeline.config.stage_settings import LaserPlacement
from pipeline.errors import RawDataError
from pipeline.georeference.placement import laser_in_pool
from pipeline.georeference.pool_context import PoolContext
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import Mounted
from pipeline.readers.las import LasPart

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]
MOST = 750_000  # points of the sample
PLACED = 4 * MOST  # points that are placed, near the boat or not, if the files say how many there are
FARTHEST_M = 50.0  # of a point from the INS
MAX_INTERVAL_NS = 100_000_000  # between two INS records, for a point between them to be placed
EVERYWHERE = (np.full(3, -np.inf), np.full(3, np.inf))
ALL = 2**64 - 1


@dataclass(frozen=True)
class KeptPoints:
    """The sample, in order of time.

    t_ns (n,); own_m (n, 3): points in the scanner's frame; level_m (n, 3): in the context's frame, x east, y north,
    z up at the first INS record; read: number of all points; context: the frame and the trajectory in it.
    """

    t_ns: Integers
    own_m: Array
    level_m: Array
    read: int
    context: PoolContext

    def __len__(self) -> int:
        return len(self.t_ns)

    def along(self, trajectory: Trajectory, mount: Mounted) -> "KeptPoints":
        """Return the points as the laser saw them from another trajectory in the same frame."""
        level_m = trajectory.points_from_sensor(
            self.t_ns, self.own_m, mount.R_body_from_sensor, mount.lever_arm_body_m
        )
        return replace(self, level_m=level_m, context=replace(self.context, trajectory=trajectory))


def level_context(ins: pd.DataFrame) -> PoolContext:
    """Return the trajectory in a frame whose origin is the INS's first place, y to the north; all of it is one pass."""
    first = ins.iloc[0]
    place = {
        "latitude_deg": [np.degrees(first["latitude_rad"])],
        "longitude_deg": [np.degrees(first["longitude_rad"])],
        "height_m": [first["height_m"]],
        "azimuth_deg": [0.0],
    }
    t_ns = ins["t_ns"].to_numpy()
    one_pass = pd.DataFrame({"start_ns": t_ns[:1], "end_ns": t_ns[-1:]})
    return PoolContext.of(ins, one_pass, pd.DataFrame(place), EVERYWHERE)


def kept_points(stream: Stream, context: PoolContext, laser: LaserPlacement) -> KeptPoints:
    """Return the sample of a session's laser points; an error if the INS covers none of them."""
    limit = first_limit(stream.parts)
    read, sample = sampled(stream.fold(_placed, context, laser, limit), MOST)
    if not sample or not len(sample["t_ns"]):
        raise RawDataError(
            f"laser: none of {read:,} points lies within {FARTHEST_M:g} m of the boat while the INS recorded; "
            "check laser.mount, laser.frame and the clocks: poolcal check looks into them"
        )
    return KeptPoints(sample["t_ns"], sample["own_m"], sample["level_m"], read, context)


def sampled(batches: Iterable[tuple[int, Columns]], most: int) -> tuple[int, dict[str, NDArray[Any]]]:
    """Return the number of all points, and the columns of a sample of at most so many, in order of time.

    Parameters
    ----------
    batches
        For each batch the number of its points, and columns of those that may be used, with ``t_ns`` and ``drawn``: the
        number to which the time is :func:`scattered`.
    most
        Largest number of points of the sample.
    """
    limit, read, number = ALL, 0, 0
    pieces: list[Columns] = []
    for count, piece in batches:
        read += count
        pieces.append(_below(piece, limit))
        number += len(pieces[-1]["drawn"])
        while number > most:
            limit //= 2
            pieces = [_below(one, limit) for one in pieces]
            number = sum(len(one["drawn"]) for one in pieces)
    if not pieces:
        return read, {}
    together = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    order = np.argsort(together["t_ns"], kind="stable")
    return read, {name: column[order] for name, column in together.items()}


def first_limit(parts: Sequence[Part]) -> int:
    """Return the limit by which at most ``PLACED`` points are placed, as far as LAS files say how many they have."""
    claimed, limit = sum(part.stop - part.start for part in parts if isinstance(part, LasPart)), ALL
    while claimed > PLACED:
        claimed, limit = claimed // 2, limit // 2
    return limit


def _placed(
    batch: Batch, context: PoolContext, laser: LaserPlacement, limit: int
) -> tuple[int, dict[str, NDArray[np.generic]]]:
    """Return the number of a batch's points, and those near the boat, placed, with the number each has drawn."""
    t_ns = np.asarray(batch["t_ns"], dtype=np.int64)
    drawn = scattered(t_ns)
    rows = np.flatnonzero((drawn <= np.uint64(limit)) & context.trajectory.covers(t_ns, MAX_INTERVAL_NS))
    times, points = t_ns[rows], point_array(batch, "m", rows)
    own, level = laser_in_pool(times, points, context, laser)
    near = np.flatnonzero(np.einsum("ni,ni->n", own, own) <= FARTHEST_M**2)
    return len(t_ns), {
        "t_ns": times[near],
        "own_m": own[near],
        "level_m": level[near],
        "drawn": drawn[rows[near]],
    }


def _below(piece: Columns, limit: int) -> Columns:
    if limit == ALL:
        return piece
    rows = np.flatnonzero(piece["drawn"] <= np.uint64(limit))
    return {name: column[rows] for name, column in piece.items()}


def scattered(t_ns: Integers) -> NDArray[np.uint64]:
    """Return numbers (n,) of 64 bits, as if drawn at random, that depend on the times (n,) alone.

    Steele et al. 2014, "Fast splittable pseudorandom number generators": the finalizer of SplitMix64.
    """
    x = t_ns.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        x = (x ^ (x >> np.uint64(shift))) * np.uint64(factor)
    return np.asarray(x ^ (x >> np.uint64(31)))
