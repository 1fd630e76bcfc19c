"""Passes, which are maximal intervals without a gap and without along-track reversal; the direction of the track."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Times = NDArray[np.int64]
Interval = tuple[int, int]

FARTHEST_PASS_M = 30.0  # from the target's front: farther off the boat does not pass the target


def split_at_gaps(t_ns: Times, max_gap_ns: int) -> list[Interval]:
    """Return the first and last time of each stretch of ascending times without a gap above ``max_gap_ns``.

    >>> split_at_gaps(np.array([0, 1, 2, 10, 11]), 5)
    [(0, 2), (10, 11)]
    """
    if len(t_ns) == 0:
        return []
    ends = np.flatnonzero(np.diff(t_ns) > max_gap_ns)
    starts = np.concatenate([[0], ends + 1])
    return [(int(t_ns[s]), int(t_ns[e])) for s, e in zip(starts, np.append(ends, len(t_ns) - 1), strict=True)]


def reversals(t_ns: Times, along_m: Array, hysteresis_m: float) -> list[int]:
    """Return the times at which the boat turns back along the track.

    A turn is an extreme of the along-track coordinate from which the boat moves back by more than the hysteresis.

    Parameters
    ----------
    t_ns
        Times (n,), ascending.
    along_m
        Along-track coordinate (n,).
    hysteresis_m
        Smallest distance back from an extreme that makes the extreme a turn.

    >>> reversals(np.arange(7) * 1_000_000_000, np.array([0.0, 1, 2, 3, 2, 1, 0]), 1.5)
    [3000000000]
    """
    turns: list[int] = []
    if len(t_ns) == 0:
        return turns
    stride = max(1, len(t_ns) // max(1, int((t_ns[-1] - t_ns[0]) // 100_000_000)))  # 10 Hz is enough for a turn
    times, values = t_ns[::stride].tolist(), along_m[::stride].tolist()
    high = low = values[0]
    high_t = low_t = times[0]
    direction = 0
    for t, value in zip(times, values, strict=True):
        if value > high:
            high, high_t = value, t
        if value < low:
            low, low_t = value, t
        if direction >= 0 and high - value > hysteresis_m:
            if direction > 0:
                turns.append(int(high_t))
            direction, low, low_t = -1, value, t
        elif direction <= 0 and value - low > hysteresis_m:
            if direction < 0:
                turns.append(int(low_t))
            direction, high, high_t = 1, value, t
        if direction > 0:
            low, low_t = value, t
        elif direction < 0:
            high, high_t = value, t
    return turns


def find_passes(
    ins_t_ns: Times,
    along_m: Array,
    ping_t_ns: Times,
    max_gap_ns: int,
    reversal_m: float,
    shortest_ns: int = 1_000_000_000,
) -> list[Interval]:
    """Return the intervals in which INS and soundings run without a gap and the boat does not turn back.

    Parameters
    ----------
    ins_t_ns
        Times (n,) of the INS records, ascending.
    along_m
        Along-track coordinate (n,) at these times.
    ping_t_ns
        Times of the pings, ascending.
    max_gap_ns
        Longest gap allowed between INS records, and between pings.
    reversal_m
        Smallest distance back along the track that ends a pass.
    shortest_ns
        Shortest pass.

    Returns
    -------
    First and last time of each pass; ascending, disjoint.
    """
    pings = split_at_gaps(ping_t_ns, max_gap_ns)
    passes: list[Interval] = []
    for start, end in split_at_gaps(ins_t_ns, max_gap_ns):
        rows = slice(int(np.searchsorted(ins_t_ns, start)), int(np.searchsorted(ins_t_ns, end, side="right")))
        cuts = [start, *reversals(ins_t_ns[rows], along_m[rows], reversal_m), end]
        for leg_start, leg_end in pairwise(cuts):
            for ping_start, ping_end in pings:
                first, last = max(leg_start, ping_start), min(leg_end, ping_end)
                if last - first >= shortest_ns:
                    passes.append((first, last))
    return passes


def pass_of(t_ns: Times, starts_ns: Times, ends_ns: Times) -> NDArray[np.int16]:
    """Return the number of the pass in which each time (n,) lies, -1 for none.

    Parameters
    ----------
    t_ns
        Times (n,).
    starts_ns, ends_ns
        First and last time of each pass, ascending.
    """
    if len(starts_ns) == 0:
        return np.full(len(t_ns), -1, dtype=np.int16)
    index = np.searchsorted(starts_ns, t_ns, side="right") - 1
    inside = (index >= 0) & (t_ns <= ends_ns[np.maximum(index, 0)])
    return np.where(inside, index, -1).astype(np.int16)


def abeam(
    east_m: Array, north_m: Array, azimuth_rad: Array, within_m: float = 20.0, to_port: bool = False
) -> NDArray[np.bool_]:
    """Return a mask (n,): true where the target lies to starboard (or to port), within 45° of abeam, and near.

    Near means: less than ``within_m`` away across the heading.

    Parameters
    ----------
    east_m, north_m
        Position (n,) of the INS from the target's origin.
    azimuth_rad
        Heading (n,), clockwise from true north.
    within_m
        Largest distance across the heading.
    to_port
        Whether the target is to lie to port.
    """
    starboard = -(east_m * np.cos(azimuth_rad) - north_m * np.sin(azimuth_rad))
    ahead = -(east_m * np.sin(azimuth_rad) + north_m * np.cos(azimuth_rad))
    across = -starboard if to_port else starboard
    return np.asarray((across > 0) & (across < within_m) & (np.abs(ahead) < across))


def estimate_azimuth(east_m: Array, north_m: Array, azimuth_rad: Array, within_m: float = 20.0) -> float | None:
    """Return the direction (rad) of the target's +y axis: the mean heading while the target is :func:`abeam`.

    That is while it lies to starboard; if it never does, the opposite of the mean heading while it lies to port.

    Parameters
    ----------
    east_m, north_m
        Position (n,) of the INS from the target's origin.
    azimuth_rad
        Heading (n,), clockwise from true north.
    within_m
        Largest distance of the target across the heading.

    Returns
    -------
    The direction, clockwise from true north; None if the target was never abeam.
    """
    for to_port in (False, True):
        near = abeam(east_m, north_m, azimuth_rad, within_m, to_port)
        if near.any():
            along = azimuth_rad[near] + np.pi * to_port
            return float(np.arctan2(np.sin(along).mean(), np.cos(along).mean()))
    return None
