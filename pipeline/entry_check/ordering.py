"""Pairs by the order of a file: windows that follow each other as in the run, and from them whole pings.

Exported files keep the order of time. Windows that look alike by chance do not: of n of them about 2 √n stand in order
(the longest increasing subsequence of a random permutation; Logan and Shepp 1977). So where twice as many do, and not
few, these are right, whatever poses the software had.
"""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.run_soundings import RunSoundings

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
LEAST_ORDERED, ORDERED = 30, 4.0  # windows in order; of the root of all
MOST_SERIES = 100  # of windows in order
STRETCH = 0.003  # other rays and another sound speed change distances by this share


@dataclass(frozen=True)
class Windows:
    """Windows that look alike.

    Attributes
    ----------
    run_rows, file_rows
        (w, beams): rows of the soundings and of the file's points; the latter fall if a ping's beams are reversed.
    lag
        Beams from one to the next in a window.
    """

    run_rows: Integers
    file_rows: Integers
    lag: int

    def some(self, rows: NDArray[np.bool_] | Integers) -> "Windows":
        """Return some of the windows."""
        return Windows(self.run_rows[rows], self.file_rows[rows], self.lag)


def in_order(windows: Windows) -> Windows | None:
    """Return the windows that stand in the file as in the run, or backwards; None if they are too few.

    Passes that the file has in another order are one series each: what is left is searched until there is none.
    """
    windows = windows.some(np.argsort(windows.file_rows[:, 0], kind="stable"))
    left, first = np.arange(len(windows.run_rows)), windows.run_rows[:, 0]
    found: list[Integers] = []
    while len(left) >= LEAST_ORDERED and len(found) < MOST_SERIES:
        best = max((longest_rise(values) for values in (first[left], -first[left])), key=len)
        if len(best) < max(LEAST_ORDERED, ORDERED * np.sqrt(len(left))):
            break
        found.append(left[best])
        left = np.delete(left, best)
    return windows.some(np.sort(np.concatenate(found))) if found else None


def longest_rise(values: Integers) -> Integers:
    """Return the places of a longest strictly increasing subsequence (Fredman 1975)."""
    ends: list[int] = []
    places: list[int] = []
    before = np.full(len(values), -1)
    for place, value in enumerate(values.tolist()):
        at = bisect_left(ends, value)
        before[place] = places[at - 1] if at else -1
        ends[at : at + 1], places[at : at + 1] = [value], [place]
    found = []
    place = places[-1] if places else -1
    while place >= 0:
        found.append(place)
        place = int(before[place])
    return np.array(found[::-1], dtype=np.int64)


def whole_pings(
    windows: Windows, soundings: RunSoundings, points_m: Array, rows: Integers, limit_m: float
) -> tuple[Integers, float]:
    """Return pairs (2, m) of all beams of the windows' pings, soundings and points; and which share of the tried is so.

    From a window on, each beam stands one row further in the file, as long as none was taken out. A pair counts if it
    is as far from the window's two ends on both sides. A sounding that the file holds twice has two pairs.

    Parameters
    ----------
    windows
        In order.
    soundings
        The run's.
    points_m, rows
        (n, 3), (n,): the file's points, and the number of each one's row.
    limit_m
        By how much distances may differ.
    """
    start, end, at = windows.run_rows[:, 0], windows.run_rows[:, -1], windows.file_rows[:, 0]
    step = np.sign(windows.file_rows[:, 1] - at)
    first = np.searchsorted(soundings.ping, soundings.ping[start])
    count = np.searchsorted(soundings.ping, soundings.ping[start], side="right") - first
    window = np.repeat(np.arange(len(start)), count)
    own = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)
    beams = soundings.beam[own] - soundings.beam[start[window]]
    other = at[window] + step[window] * (beams // windows.lag)
    good = (beams % windows.lag == 0) & (other >= 0) & (other < len(rows))
    own, other, window = own[good], other[good], window[good]
    good = np.abs(rows[other] - rows[at[window]]) == np.abs(other - at[window])
    x = soundings.points_mbes_m
    for end_own, end_other in ((start, at), (end, windows.file_rows[:, -1])):
        there = np.linalg.norm(x[own] - x[end_own[window]], axis=1)
        here = np.linalg.norm(points_m[other] - points_m[end_other[window]], axis=1)
        good &= np.abs(there - here) <= limit_m + STRETCH * there
    share = float(good.mean()) if len(good) else 0.0
    return np.unique(np.stack([own[good], other[good]]), axis=1), share
