"""A sample of the laser's points round the boat, placed by the INS, in one reading.

A point is kept if the number that its time is scattered to lies below a limit, which falls by a tenth whenever too
many are kept. So the sample does not depend on how many workers read the files, all stretches of the session have the
same share, and the memory is the same for any session. Where the files say how many points they have, the limit begins
so low that not many more than are kept leave the reader; where they do not, each part finds its own limit, and the
least is that of all. Points are placed when the sample is complete.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.sampling import ALL, scattered
from pipeline.artefacts.streams import Part, point_array
from pipeline.config.stage_settings import LaserPlacement
from pipeline.errors import RawDataError
from pipeline.georeference.placement import laser_in_pool
from pipeline.georeference.pool_context import PoolContext
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import Mounted
from pipeline.readers.crs import LASER_FRAME
from pipeline.readers.las import LasPart

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]
Drawn = tuple[int, int, Columns]  # number of points, the largest number that was drawn and kept, the kept points
MOST = 500_000  # points of the sample
DRAWN = 2 * MOST  # points that leave the reader, near the boat or not, if the files say how many there are
FARTHEST_M = 50.0  # of a point from the INS
MAX_INTERVAL_NS = 100_000_000  # between two INS records, for a point between them to be placed
EVERYWHERE = (np.full(3, -np.inf), np.full(3, np.inf))


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


def kept_points(drawn: Iterable[Drawn], context: PoolContext, laser: LaserPlacement) -> KeptPoints:
    """Return the sample of a session's laser points; an error if the INS covers none of them.

    Parameters
    ----------
    drawn
        The :func:`drawn_points` of each part of the laser's files, in order.
    context
        The trajectory.
    laser
        The laser's mount and frame.
    """
    limits = [ALL]

    def near() -> Iterator[tuple[int, Columns]]:
        for count, limit, columns in drawn:
            limits.append(limit)
            if columns:
                yield count, _near(columns, context, laser)

    read, _, sample = sampled(near(), MOST)
    sample = _below(sample, min(limits)) if sample else sample  # all parts have the same share
    if not sample or not len(sample["t_ns"]):
        raise RawDataError(
            f"laser: none of {read:,} points lies within {FARTHEST_M:g} m of the boat while the INS recorded; "
            "check laser.mount, laser.frame and the clocks: poolcal check looks into them"
        )
    own, level = laser_in_pool(sample["t_ns"], point_array(sample, "m"), context, laser)
    return KeptPoints(sample["t_ns"], own, level, read, context)


def drawn_points(part: Part, limit: int) -> Drawn:
    """Return the number of a part's points, the limit, and columns of those that drew no larger number.

    These are at most ``DRAWN``: with more the limit falls. The columns are those of the reader, and ``drawn``.
    """
    return sampled(_drawn(replace(part, limit=limit) if isinstance(part, LasPart) else part, limit), DRAWN)


def _drawn(part: Part, limit: int) -> Iterator[tuple[int, Columns]]:
    for chunk in part.chunks():
        drawn = scattered(np.asarray(chunk.columns["t_ns"], dtype=np.int64))
        yield len(drawn) + chunk.undrawn, _below(dict(chunk.columns) | {"drawn": drawn}, limit)


def sampled(batches: Iterable[tuple[int, Columns]], most: int) -> Drawn:
    """Return the number of all points, the limit, and the columns of a sample of at most so many, in order of time.

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
            limit -= limit // 10
            pieces = [_below(one, limit) for one in pieces]
            number = sum(len(one["drawn"]) for one in pieces)
    if not pieces:
        return read, limit, {}
    together = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    order = np.argsort(together["t_ns"], kind="stable")
    return read, limit, {name: column[order] for name, column in together.items()}


def first_limit(parts: Sequence[Part]) -> int:
    """Return the limit by which at most ``DRAWN`` points leave the reader, if LAS files say how many they have."""
    claimed, limit = sum(part.stop - part.start for part in parts if isinstance(part, LasPart)), ALL
    while claimed > DRAWN:
        claimed, limit = claimed - claimed // 10, limit - limit // 10
    return limit


def _near(columns: Columns, context: PoolContext, laser: LaserPlacement) -> Columns:
    """Return the columns of points near the boat, at times that the INS covers."""
    t_ns, points = columns["t_ns"], point_array(columns, "m")
    rows = np.flatnonzero(context.trajectory.covers(t_ns, MAX_INTERVAL_NS))
    own = points[rows] if laser.frame == LASER_FRAME else laser_in_pool(t_ns[rows], points[rows], context, laser)[0]
    near = rows[np.einsum("ni,ni->n", own, own) <= FARTHEST_M**2]
    return {name: column[near] for name, column in columns.items()}


def _below(piece: Columns, limit: int) -> Columns:
    if limit == ALL:
        return piece
    rows = np.flatnonzero(piece["drawn"] <= np.uint64(limit))
    return {name: column[rows] for name, column in piece.items()}
