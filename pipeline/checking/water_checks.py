"""Checks of the water's level: whether it changes between passes, and whether the pool's file says how."""

from collections.abc import Iterator, Sequence

import numpy as np

from pipeline.checking.findings import Finding
from pipeline.checking.track import Leg
from pipeline.config.pool import PoolConfig
from pipeline.config.water_level import BY_INS, Readings
from pipeline.georeference.water_levels import readings_at, uncovered
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
    good = [leg for leg in legs if leg.good]
    changes, margin_m = pool.target.water_level_changes, pool.segment.water_margin_m
    if not good or changes == BY_INS:
        return
    if isinstance(changes, tuple):
        yield from _of_readings(good, changes, margin_m)
        return
    low, high = (choose(good, key=lambda leg: leg.height_m) for choose in (min, max))
    rise_m = high.height_m - low.height_m
    if rise_m > margin_m:
        yield Finding(
            "water",
            f"the boat lies {rise_m:.2f} m higher in the pass of {utc_text(high.start_ns)} than in that of "
            f"{utc_text(low.start_ns)}: the water rose or fell, or the INS's height wandered. If "
            "the heights are sure (RTK fixed), write target.water_level_changes: ins, or name a file of readings there",
            "look",
        )


def _of_readings(good: Sequence[Leg], readings: Readings, margin_m: float) -> Iterator[Finding]:
    if words := uncovered(readings, [(leg.start_ns, leg.end_ns) for leg in good]):
        yield Finding("water", words)
        return
    read_m = readings_at(readings, np.array([(leg.start_ns + leg.end_ns) // 2 for leg in good]))
    apart_m = read_m - [leg.height_m for leg in good]
    if np.ptp(apart_m) > margin_m:
        first, last = sorted((int(np.argmin(apart_m)), int(np.argmax(apart_m))))
        boat_m = good[last].height_m - good[first].height_m
        yield Finding(
            "water",
            f"from the pass of {utc_text(good[first].start_ns)} to that of {utc_text(good[last].start_ns)} the water "
            f"changes by {read_m[last] - read_m[first]:+.2f} m by target.water_level_changes, and the boat's height by "
            f"{boat_m:+.2f} m: look at the times of the readings (UTC), their sign, and the INS's height",
            "look",
        )
