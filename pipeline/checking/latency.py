"""Small offsets of the sensors' clocks, estimated by the adjustment of a sample of the session.

With a wrong clock the target's planes sway with the boat. The adjustment makes a single-parameter test of each of its
fixed parameters (table ``freed``). If a latency has the largest statistic of all, each latency that differs clearly
from zero is a finding.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from pipeline.checking.findings import Finding
from pipeline.mount import WITHIN_95

SIGMAS, LEAST_S = 4.0, 0.005  # least statistic (in sigmas) and least size of a latency that counts
SAME = 3.0  # two offsets that differ by fewer sigmas are one offset of the INS's clock


def latency_findings(freed: pd.DataFrame) -> Iterator[Finding]:
    """Yield a finding for each sensor whose clock is clearly off; if both are off equally, one for the INS's clock.

    ``freed`` is the adjustment's table of single-parameter tests.
    """
    fixed = freed[~freed["estimated"] & np.isfinite(freed["value"])].to_dict("records")
    statistic = {str(row["unknown"]): abs(row["value"]) / row["expected"] for row in fixed}
    if not statistic or not max(statistic, key=lambda name: statistic[name]).endswith("_latency"):
        return
    latencies = {
        sensor: (float(row["value"]), float(row["sigma"]))
        for sensor in ("laser", "mbes")
        for row in fixed
        if row["unknown"] == f"{sensor}_latency" and statistic[row["unknown"]] > SIGMAS and abs(row["value"]) > LEAST_S
    }
    if len(latencies) == 2:
        (laser, laser_sigma), (mbes, mbes_sigma) = latencies.values()
        if abs(laser - mbes) < SAME * np.hypot(laser_sigma, mbes_sigma):
            both = (laser / laser_sigma**2 + mbes / mbes_sigma**2) / (1 / laser_sigma**2 + 1 / mbes_sigma**2)
            sigma = 1 / np.hypot(1 / laser_sigma, 1 / mbes_sigma)
            yield Finding(
                "latency",
                f"ins: its clock is {_offset(-both)} both sensors' ({_between(-both, sigma)}), as the target's planes "
                f"sway with the boat: find what delays it, and add its amount, about {-both:+.3f} s, to ins.latency_s",
            )
            return
    for sensor, (seconds, sigma) in latencies.items():
        name, setting = f"{sensor}_latency", f"{sensor}.latency_s"
        yield Finding(
            "latency",
            f"{sensor}: its clock is {_offset(seconds)} the INS's ({_between(seconds, sigma)}), as the target's planes "
            f"sway with the boat: find what delays it; for its amount run with adjust.free: [{name}], which "
            f"uses all the points, and add what that finds to {setting}",
        )


def _between(seconds: float, sigma: float) -> str:
    """Return the 95 % interval of a clock's offset as text, from the random sigma alone.

    >>> _between(-0.0204, 0.001)
    '18.4 to 22.4 ms, 95 %'
    """
    low, high = sorted(abs(1000 * seconds) + side * 1000 * WITHIN_95 * sigma for side in (-1, 1))
    return f"{low:.1f} to {high:.1f} ms, 95 %"


def _offset(ahead_s: float) -> str:
    """Return the amount and the direction of a clock's offset as text.

    >>> _offset(-0.0204)
    '20 ms behind'
    """
    return f"{abs(1000 * ahead_s):.0f} ms {'ahead of' if ahead_s > 0 else 'behind'}"
