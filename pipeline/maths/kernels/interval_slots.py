"""Loops shared by the sums of both sensors, first part: the slot of each point.

A *slot* holds the sums of one interval, the points of one surface between two INS records
(:mod:`pipeline.maths.adjustment.interval_sums`). Slots are in the order in which their first points come.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import LINE, NUMBERS, compiled

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@compiled((NUMBERS, NUMBERS, NUMBERS, NUMBERS, LINE, NUMBERS, NUMBERS, NUMBERS, NUMBERS))
def slots_of(
    t_ns: Integers, surface: Integers, record_ns: Integers, record: Integers, share: Array, slot: Integers,
    slot_record: Integers, slot_surface: Integers, last: Integers,
) -> int:  # fmt: skip
    """Write the record before each point, its share of the interval and its slot; return the number of slots.

    Parameters
    ----------
    t_ns, surface : (n,) arrays
        Times of the points, ascending, and numbers of their surfaces.
    record_ns : (r,) array
        Times of the INS's records.
    record, share, slot : (n,) arrays
        Written: last record before each point (at most r - 2), its place from there to the next, 0 to 1, its slot.
    slot_record, slot_surface : (n,) arrays
        Written for each slot.
    last : (s,) array
        Scratch memory for each surface.
    """
    last[:] = -1
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
