"""A sample of a session's soundings, placed by a calibrated mount along a trajectory without drift, in one reading."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import scattered
from pipeline.artefacts.streams import Batch, Stream
from pipeline.config.stage_settings import SonarPlacement
from pipeline.finding.kept_points import MAX_INTERVAL_NS, Columns, sampled
from pipeline.georeference.placement import soundings_in_pool
from pipeline.georeference.pool_context import PoolContext
from pipeline.maths.geometry.passes import pass_of

Array = NDArray[np.float64]
MOST = 2_000_000  # soundings of the sample; it has whole pings


@dataclass(frozen=True)
class KeptSoundings:
    """The sample, in order of time: number of the pass (n,), points (n, 3) in the frame of the trajectory."""

    number_of_pass: NDArray[np.int16]
    points_m: Array
    read: int


def kept_soundings(stream: Stream, context: PoolContext, mbes: SonarPlacement, level_m: float) -> KeptSoundings:
    """Return the sample of a session's soundings in its passes; ``level_m``: z of the water in that frame."""
    read, _, sample = sampled(stream.fold(_placed, context, mbes, level_m), MOST)
    if not sample:
        return KeptSoundings(np.empty(0, dtype=np.int16), np.empty((0, 3)), read)
    return KeptSoundings(sample["pass"], sample["points_m"], read)


def _placed(batch: Batch, context: PoolContext, mbes: SonarPlacement, level_m: float) -> tuple[int, Columns]:
    """Return the number of a batch's soundings, and columns of those in passes, under the water."""
    t_ns = np.asarray(batch["t_ns"], dtype=np.int64)
    number = pass_of(t_ns, context.starts_ns, context.ends_ns)
    rows = np.flatnonzero(context.trajectory.covers(t_ns, MAX_INTERVAL_NS) & (number >= 0))
    columns = {name: np.asarray(column)[rows] for name, column in batch.items()}
    _, points, possible = soundings_in_pool(columns, context, mbes, level_m)
    use = np.flatnonzero(possible & (points[:, 2] < level_m))
    times = t_ns[rows[use]]
    return len(t_ns), {
        "t_ns": times, "pass": number[rows[use]], "points_m": points[use], "drawn": scattered(times),
    }  # fmt: skip
