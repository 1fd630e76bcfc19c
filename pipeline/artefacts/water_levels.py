"""The water's level in each pass, against the target: what is above it the laser sees, what is below it the sonar.

A pass takes a minute or two, in which a tide of a metre an hour changes by a centimetre or two. So each pass has one
level, which does not hang on the other passes. With ``target.water_by_time``

* ``ins_above_water_m``: the mean height of the INS in the pass, less its height above the water, for the boat floats;
* ``readings``: ``target.water_level_m``, which is the level at the first reading, and what the water rose since then.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.config.target import Target
from pipeline.config.water_by_time import Readings, utc_of
from pipeline.gps_time import NS, gps_ns_from_unix_utc, utc_text
from pipeline.maths.geometry.trajectory import Trajectory

Array = NDArray[np.float64]
Times = NDArray[np.int64]
NEAR_M = 0.3  # target.water_level_m may lie so far outside the levels by the INS's height


def water_levels(target: Target, trajectory: Trajectory, starts_ns: Times, ends_ns: Times) -> tuple[Array, Array]:
    """Return the heights (p,) m of the water and of the INS in each pass, in the trajectory's frame.

    Parameters
    ----------
    target
        The target's settings.
    trajectory
        The body's poses.
    starts_ns, ends_ns
        First and last time (p,) of each pass.
    """
    ins_m, by_time = _means(trajectory, trajectory.positions_m[:, 2], starts_ns, ends_ns), target.water_by_time
    if by_time is None:
        return np.full(len(starts_ns), target.water_level_m), ins_m
    if by_time.ins_above_water_m is not None:
        return ins_m - by_time.ins_above_water_m, ins_m
    assert by_time.readings is not None
    rise_m = readings_at(by_time.readings, trajectory.t_ns) - by_time.readings[0][1]
    return target.water_level_m + _means(trajectory, rise_m, starts_ns, ends_ns), ins_m


def _means(trajectory: Trajectory, heights_m: Array, starts_ns: Times, ends_ns: Times) -> Array:
    """Return the means (p,) of heights at the poses of each pass; the nearest pose's where a pass has none."""
    t_ns = trajectory.t_ns
    first, last = np.searchsorted(t_ns, starts_ns), np.searchsorted(t_ns, ends_ns, side="right")
    last = np.maximum(last, np.minimum(first + 1, len(t_ns)))
    rows = zip(np.minimum(first, last - 1).tolist(), last.tolist(), strict=True)
    return np.array([heights_m[low:high].mean() for low, high in rows])


def read_ns(readings: Readings) -> Times:
    """Return the times (r,) of readings, GPS ns."""
    times = [utc_of(time) for time, _ in readings]
    whole_s = np.array([int(time.timestamp()) for time in times])
    return gps_ns_from_unix_utc(whole_s, np.array([1000 * time.microsecond for time in times]))


def readings_at(readings: Readings, t_ns: Times) -> Array:
    """Return the heights (n,) m at these times, between the readings; before the first and after the last: theirs."""
    times_ns = read_ns(readings)
    heights_m = np.array([height_m for _, height_m in readings])
    return np.asarray(np.interp((t_ns - times_ns[0]) / NS, (times_ns - times_ns[0]) / NS, heights_m))


def contradiction(
    target: Target, levels_m: Array, ins_m: Array, names: Sequence[str], margin_m: float
) -> tuple[str, ...]:
    """Return in words what speaks against the levels (p,) of passes with these names; empty if nothing does.

    Parameters
    ----------
    target
        The target's settings.
    levels_m, ins_m
        Heights (p,) of the water and of the INS, from :func:`water_levels`.
    names
        The passes in words.
    margin_m
        By so much the water may rise otherwise than the boat.
    """
    by_time = target.water_by_time
    if by_time is None or not len(levels_m):
        return ()
    if by_time.readings is None:
        low_m, high_m = float(levels_m.min()), float(levels_m.max())
        if low_m - NEAR_M <= target.water_level_m <= high_m + NEAR_M:
            return ()
        return (
            f"by target.water_by_time.ins_above_water_m the water stands at {low_m:+.2f} to {high_m:+.2f} m, and "
            f"target.water_level_m says {target.water_level_m:+.2f} m: measure the height of the INS above the water",
        )
    apart_m = levels_m - ins_m
    if np.ptp(apart_m) <= margin_m:
        return ()
    first, last = sorted((int(np.argmin(apart_m)), int(np.argmax(apart_m))))
    return (
        f"from {names[first]} to {names[last]} the water rises by {levels_m[last] - levels_m[first]:+.2f} m by "
        f"target.water_by_time.readings, and the boat by {ins_m[last] - ins_m[first]:+.2f} m: look at the readings' "
        "times (UTC), their sign (upward) and unit (m), and at the INS's height",
    )


def uncovered(readings: Readings, starts_ns: Sequence[int], ends_ns: Sequence[int]) -> str:
    """Return in words the first pass that the readings do not cover, to a minute, by its first and last time; or ""."""
    first_ns, last_ns = (int(time) for time in read_ns(readings)[[0, -1]])
    for start_ns, end_ns in zip(starts_ns, ends_ns, strict=True):
        if start_ns < first_ns - 60 * NS or end_ns > last_ns + 60 * NS:
            return (
                f"target.water_by_time.readings, from {utc_text(first_ns)} to {utc_text(last_ns)}, do not cover the "
                f"pass from {utc_text(start_ns)} to {utc_text(end_ns)}; add readings, or give ins_above_water_m"
            )
    return ""
