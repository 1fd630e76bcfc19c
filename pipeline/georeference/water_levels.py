"""The water's level in each pass, against the target: what is above it the laser sees, what is below it the sonar.

A pass takes a minute or two, in which a tide of a metre an hour changes by a centimetre or two. So each pass has one
level: ``target.water_level_m``, and the change against the other passes. The changes are means over the pass of the
readings, or of the INS's height: the boat floats. Of a target that was found ``water_level_m`` is where the laser's
points end, the lowest level of all; of another it is the mean over the passes.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipeline.config.target import Target
from pipeline.config.water_level import BY_INS, Readings, utc_of
from pipeline.errors import RawDataError
from pipeline.georeference.pool_context import PoolContext
from pipeline.gps_time import NS, gps_ns_from_unix_utc, utc_text

Array = NDArray[np.float64]


def water_levels(target: Target, context: PoolContext) -> Array:
    """Return the height (p,) m of the water in each pass, against the target.

    Raises
    ------
    RawDataError
        The readings do not cover a pass.
    """
    count, changes = len(context.starts_ns), target.water_level_changes
    if changes is None or not count:
        return np.full(count, target.water_level_m)
    t_ns = context.trajectory.t_ns
    if isinstance(changes, str):
        heights_m = context.trajectory.positions_m[:, 2]
    else:
        passes = zip(context.starts_ns.tolist(), context.ends_ns.tolist(), strict=True)
        if words := uncovered(changes, passes):
            raise RawDataError(words)
        heights_m = readings_at(changes, t_ns)
    first, last = np.searchsorted(t_ns, context.starts_ns), np.searchsorted(t_ns, context.ends_ns, side="right")
    means = np.array([heights_m[low:high].mean() for low, high in zip(first.tolist(), last.tolist(), strict=True)])
    found = target.kind == "faces" and target.found
    return np.asarray(target.water_level_m + means - (means.min() if found else means.mean()))


def read_ns(readings: Readings) -> NDArray[np.int64]:
    """Return the times (r,) of readings, GPS ns."""
    times = [utc_of(time) for time, _ in readings]
    whole_s = np.array([int(time.timestamp()) for time in times])
    return gps_ns_from_unix_utc(whole_s, np.array([1000 * time.microsecond for time in times]))


def readings_at(readings: Readings, t_ns: NDArray[np.int64]) -> Array:
    """Return the heights (n,) m at these times, between the readings."""
    times_ns = read_ns(readings)
    heights_m = np.array([height_m for _, height_m in readings])
    return np.asarray(np.interp((t_ns - times_ns[0]) / NS, (times_ns - times_ns[0]) / NS, heights_m))


def uncovered(readings: Readings, passes: Iterable[tuple[int, int]]) -> str:
    """Return in words the first of these passes, by its first and last time, that the readings do not cover; or ""."""
    first_ns, last_ns = (int(time) for time in read_ns(readings)[[0, -1]])
    for start_ns, end_ns in passes:
        if not first_ns <= start_ns <= end_ns <= last_ns:
            return (
                f"target.water_level_changes: the readings, from {utc_text(first_ns)} to {utc_text(last_ns)}, do not "
                f"cover the pass from {utc_text(start_ns)} to {utc_text(end_ns)}; add readings, or write: "
                f"water_level_changes: {BY_INS}"
            )
    return ""
