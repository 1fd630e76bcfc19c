"""Checks of the water's level: whether it changes between passes, and whether the pool's file says how."""

from collections.abc import Iterator, Sequence

import numpy as np

from pipeline.artefacts.water_levels import contradiction, readings_at, uncovered
from pipeline.checking.findings import Finding
from pipeline.checking.track import Leg
from pipeline.config.pool import PoolConfig
from pipeline.gps_time import utc_text


def water_findings(legs: Sequence[Leg], pool: PoolConfig) -> Iterator[Finding]:
    """Yield findings about the water's level in the good passes.

    A floating boat rises with the tide, and in a lock. Near the water's line points would be taken for the other
    medium's. Changes up to segment.water_margin_m do no harm.

    Parameters
    ----------
    legs : Sequence[Leg]
        The passes.
    pool : PoolConfig
        The pool's settings.
    """
    good, target, margin_m = [leg for leg in legs if leg.good], pool.target, pool.segment.water_margin_m
    if not good:
        return
    if target.water_by_time is None:
        yield from _of_the_boat(good, margin_m)
        return
    readings, boat_m = target.water_by_time.readings, np.array([leg.height_m for leg in good])
    if readings is None:
        levels_m = boat_m - target.water_by_time.ins_above_water_m
    elif words := uncovered(readings, [leg.start_ns for leg in good], [leg.end_ns for leg in good]):
        yield Finding("water", words)
        return
    else:
        middles_ns = np.array([(leg.start_ns + leg.end_ns) // 2 for leg in good])
        levels_m = target.water_level_m + readings_at(readings, middles_ns) - readings[0][1]
    names = [f"the pass of {utc_text(leg.start_ns)}" for leg in good]
    for words in contradiction(target, levels_m, boat_m, names, margin_m):
        yield Finding("water", words, "look")


def _of_the_boat(good: Sequence[Leg], margin_m: float) -> Iterator[Finding]:
    low, high = (choose(good, key=lambda leg: leg.height_m) for choose in (min, max))
    rise_m = high.height_m - low.height_m
    if rise_m > margin_m:
        yield Finding(
            "water",
            f"the boat lies {rise_m:.2f} m higher in the pass of {utc_text(high.start_ns)} than in that of "
            f"{utc_text(low.start_ns)}: the water rose or fell, or the INS's height wandered. Say in "
            "target.water_by_time how: ins_above_water_m if the heights are sure (RTK fixed), or readings",
            "look",
        )
