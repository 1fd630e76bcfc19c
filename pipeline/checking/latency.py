"""Small offsets of a clock, as the adjustment finds them in a sample of the session.

With a wrong clock the target's planes sway with the boat. The adjustment frees each of its held parameters by itself
(table ``freed``); where one of the two latencies stands out, and explains more than any other parameter would, that
clock is off.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from pipeline.checking.findings import Finding
from pipeline.mount import WITHIN_95

SIGMAS, LEAST_S = 4.0, 0.005  # far enough from zero, and worth a word
SAME = 3.0  # sigmas within which two offsets are one, of the INS


def latencies(freed: pd.DataFrame) -> Iterator[Finding]:
    """Sensors whose clock is clearly off; both by the same: the INS's."""
    held = freed[~freed["estimated"] & np.isfinite(freed["value"])].to_dict("records")
    off = {str(one["unknown"]): abs(one["value"]) / np.hypot(one["sigma"], one["considered"]) for one in held}
    if not off or not max(off, key=lambda name: off[name]).endswith("_latency"):
        return
    found = {
        sensor: (float(one["value"]), float(one["sigma"]))
        for sensor in ("laser", "mbes")
        for one in held
        if one["unknown"] == f"{sensor}_latency" and off[one["unknown"]] > SIGMAS and abs(one["value"]) > LEAST_S
    }
    if len(found) == 2:
        (one, its), (other, others) = found.values()
        if abs(one - other) < SAME * np.hypot(its, others):
            both = (one / its**2 + other / others**2) / (1 / its**2 + 1 / others**2)
            sigma = 1 / np.hypot(1 / its, 1 / others)
            yield Finding(
                "latency",
                f"ins: its clock is {_said(-both)} both sensors' ({_between(-both, sigma)}), as the target's planes "
                f"sway with the boat: find what delays it, and add its amount, about {-both:+.3f} s, to ins.latency_s",
            )
            return
    for sensor, (seconds, sigma) in found.items():
        yield Finding(
            "latency",
            f"{sensor}: its clock is {_said(seconds)} the INS's ({_between(seconds, sigma)}), as the target's planes "
            f"sway with the boat: find what delays it; for its amount run with adjust.free: [{sensor}_latency], which "
            f"uses all the points, and add what that finds to {sensor}.latency_s",
        )


def _between(seconds: float, sigma: float) -> str:
    """From the sample alone, 95 %.

    >>> _between(-0.0204, 0.001)
    '18.4 to 22.4 ms, 95 %'
    """
    low, high = sorted(abs(1000 * seconds) + side * 1000 * WITHIN_95 * sigma for side in (-1, 1))
    return f"{low:.1f} to {high:.1f} ms, 95 %"


def _said(ahead_s: float) -> str:
    """
    >>> _said(-0.0204)
    '20 ms behind'
    """
    return f"{abs(1000 * ahead_s):.0f} ms {'ahead of' if ahead_s > 0 else 'behind'}"
