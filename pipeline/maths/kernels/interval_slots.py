"""Loops shared by the sums of both sensors: the slot of each point, its robust weight, what it adds to its slot.

A *slot* holds the sums of one interval, the points of one surface between two INS records
(:mod:`pipeline.maths.adjustment.interval_sums`). Slots are in the order in which their first points come.
"""

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import arrays, compiled

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NUMBERS, WRITTEN = arrays(int64, 1), arrays(int64, 1, written=True)
N_MOVED = 3  # features on which a pose error acts


@compiled((NUMBERS, NUMBERS, NUMBERS, int64, WRITTEN, arrays(float64, 1, written=True), WRITTEN, WRITTEN, WRITTEN))
def slots_of(
    t_ns: Integers, surface: Integers, record_ns: Integers, surfaces: int, record: Integers, share: Array,
    slot: Integers, slot_record: Integers, slot_surface: Integers,
) -> int:  # fmt: skip
    """Write the record before each point, its share of the interval and its slot; return the number of slots.

    Parameters
    ----------
    t_ns, surface : (n,) arrays
        Times of the points, ascending, and numbers of their surfaces.
    record_ns : (r,) array
        Times of the INS's records.
    surfaces : int
        Number of surfaces.
    record, share, slot : (n,) arrays
        Written: last record before each point (at most r - 2), its place from there to the next, 0 to 1, its slot.
    slot_record, slot_surface : (n,) arrays
        Written for each slot.
    """
    last = np.full(surfaces, -1)
    k, found = 0, 0
    if len(t_ns):
        k = min(max(np.searchsorted(record_ns, t_ns[0], side="right") - 1, 0), len(record_ns) - 2)
    for i in range(len(t_ns)):
        while k < len(record_ns) - 2 and record_ns[k + 1] <= t_ns[i]:
            k += 1
        record[i] = k
        share[i] = (t_ns[i] - record_ns[k]) / (record_ns[k + 1] - record_ns[k])
        s = surface[i]
        if last[s] < 0 or slot_record[last[s]] != k:
            slot_record[found], slot_surface[found] = k, s
            last[s] = found
            found += 1
        slot[i] = last[s]
    return found


@compiled()
def robust_weight(normalised: float, k0: float, k1: float) -> float:
    """Return the weight of IGG III, :func:`pipeline.maths.adjustment.robust_weights.igg3_weights`."""
    size = abs(normalised)
    if size <= k0:
        return 1.0
    if size >= k1:
        return 0.0
    return k0 / size * ((k1 - size) / (k1 - k0)) ** 2


@compiled()
def add_point(
    q: Array, v: float, s: float, w: float, normal: Array, swept: Array, swept_twice: Array, right: Array,
    right_swept: Array,
) -> None:  # fmt: skip
    """Add a point to the sums of its slot: of products of features the lower triangle alone."""
    for row in range(len(q)):
        wq = w * q[row]
        right[row] += wq * v
        for column in range(row + 1):
            normal[row, column] += wq * q[column]
    for row in range(N_MOVED):
        once = s * w * q[row]
        right_swept[row] += once * v
        for column in range(row, len(q)):
            swept[row, column] += once * q[column]
        for column in range(row, N_MOVED):
            swept_twice[row, column] += s * once * q[column]


@compiled()
def mirror(normal: Array, swept: Array, swept_twice: Array) -> None:
    """Write the other triangles of the sums of a slot."""
    for row in range(len(normal)):
        for column in range(row):
            normal[column, row] = normal[row, column]
    for row in range(N_MOVED):
        for column in range(row):
            swept[row, column] = swept[column, row]
            swept_twice[row, column] = swept_twice[column, row]
