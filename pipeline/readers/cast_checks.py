"""Checks of a recorded cast: the choice of its usable rows, and the refusal of a cast that cannot be used."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.faults import FOOT_M
from pipeline.errors import RawDataError
from pipeline.maths.sonar.cast_profile import ascending, largest_difference, one_way

Array = NDArray[np.float64]
DEEPEST_M = 200.0
MIN_WATER_SPEED_M_S, MAX_WATER_SPEED_M_S = 1300.0, 1700.0
MAX_DIFFERENCE_M_S = 2.0  # between the speeds on the probe's way down and on its way up
JUMP_M_S, WITHIN_M = 10.0, 0.5  # a larger step of speed between two rows nearer than this shows a bubble, or air


@dataclass(frozen=True)
class UsableRows:
    """Ascending depths [m], their sound speeds [m/s], and the counts of rows left out, by reason."""

    depth_m: Array
    speed_m_s: Array
    left_out: Counter[str]


def usable_rows(rows: Array, name: str) -> UsableRows:
    """Return the usable rows of a cast, one for each depth; ``rows`` (n, 2): recorded depths [m] and speeds [m/s].

    Raises
    ------
    RawDataError
        Fewer than two depths can be used, most depths are negative, speeds are not in m/s, speeds jump from row to row,
        or the speeds on the way down and on the way up differ.
    """
    left_out: Counter[str] = Counter()

    def keep(good: NDArray[np.bool_], reason: str) -> None:
        nonlocal rows
        if not np.all(good):
            left_out[reason] += int(np.count_nonzero(~good))
            rows = rows[good]

    keep(np.all(np.isfinite(rows), axis=1), "no depth or no speed")
    if not len(rows):
        raise RawDataError(f"{name}: has no row of a depth and a sound speed; export it again")
    if np.mean(rows[:, 0] < 0) > 0.5:
        raise RawDataError(f"{name}: its depths are negative ({rows[:, 0].min():g}); give metres, positive downward")
    _refuse_other_speeds(rows[:, 1], name)
    keep(
        (rows[:, 1] >= MIN_WATER_SPEED_M_S) & (rows[:, 1] <= MAX_WATER_SPEED_M_S),
        "in air, or a speed that no water has",
    )
    keep(rows[:, 0] >= 0, "above the surface")
    keep(rows[:, 0] <= DEEPEST_M, f"deeper than {DEEPEST_M:g} m")
    if len(rows):
        used = one_way(rows[:, 0])
        _refuse_different_way_up(rows, used, name)
        keep(np.isin(np.arange(len(rows)), used), "on the way up")
    depth, speed = ascending(*rows.T)
    if len(depth) < 2:
        raise RawDataError(
            f"{name}: the number of its depths that can be used is {len(depth)}, and a cast needs two; export all of it"
        )
    if len(depth) < len(rows):
        left_out["of a depth that is there already: their mean is used"] = len(rows) - len(depth)
    _refuse_jumps(depth, speed, name)
    return UsableRows(depth, speed, left_out)


def _refuse_other_speeds(speed: Array, name: str) -> None:
    median = float(np.median(speed))
    if MIN_WATER_SPEED_M_S <= median <= MAX_WATER_SPEED_M_S:
        return
    is_feet = MIN_WATER_SPEED_M_S <= median * FOOT_M <= MAX_WATER_SPEED_M_S
    cause = "feet a second, it seems" if is_feet else "water has 1300 to 1700 m/s"
    raise RawDataError(
        f"{name}: its sound speeds are near {median:.6g}: {cause}; export depth in metres and sound speed in m/s"
    )


def _refuse_different_way_up(rows: Array, used: NDArray[np.int64], name: str) -> None:
    way_up = np.setdiff1d(np.arange(len(rows)), used)
    if len(way_up) < 2:
        return
    difference, depth = largest_difference(ascending(*rows[used].T), ascending(*rows[way_up].T))
    if difference > MAX_DIFFERENCE_M_S:
        raise RawDataError(
            f"{name}: the ways down and up differ by {difference:.1f} m/s at {depth:.2f} m: the water changed, or the "
            "probe lags; leave in the file the one to be used"
        )


def _refuse_jumps(depth: Array, speed: Array, name: str) -> None:
    step = np.where(np.diff(depth) < WITHIN_M, np.abs(np.diff(speed)), 0.0)
    worst = int(np.argmax(step))
    if step[worst] > JUMP_M_S:
        raise RawDataError(
            f"{name}: the sound speed jumps from {speed[worst]:.1f} m/s at {depth[worst]:.2f} m to "
            f"{speed[worst + 1]:.1f} at {depth[worst + 1]:.2f} m: the probe was partly in air, or in a bubble; take "
            "such rows out"
        )
