"""What a calibration of the laser owes to its coarse mount: values that rest on it, and values that contradict it.

The coarse mount is an observation of all six mount parameters, so that each is estimated and has a sigma. A value is
good enough if its total sigma is within the verdict's limit, and if it is better than the coarse mount.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import limits_by_setting
from pipeline.maths.mount_parameters import MOUNT_NAMES, MOUNT_WORDS, PARAMETERS
from pipeline.report.cause_words import size_words
from pipeline.report.reason_codes import ReasonCode, Statement
from pipeline.report.suspected_causes import significance_limit

REMEDY = (
    "a surveyed target (laser_fit.origin_sigma_m, azimuth_sigma_deg), more passes at other distances, or a less "
    "drifting INS would determine more"
)


@dataclass(frozen=True)
class ShareOfCoarseMount:
    """Mount parameters that are not good enough, each with its total sigma (degrees or m).

    above_limit: above the verdict's limit; unimproved: not clearly better than the coarse mount, on which they rest.
    """

    above_limit: Mapping[str, float]
    unimproved: Mapping[str, float]

    @property
    def held(self) -> dict[str, float]:
        """Those that are not good enough, in the order of reports."""
        both = {**self.above_limit, **self.unimproved}
        return {name: both[name] for name, *_ in PARAMETERS if name in both}

    @property
    def advice(self) -> str:
        """Which values are not good enough and why, and what would help; empty if all are."""
        parts = []
        if self.above_limit:
            parts.append(f"{_with_sigmas(self.above_limit)} above the verdict's limits")
        if self.unimproved:
            words = _with_sigmas(self.unimproved)
            parts.append(f"{words} not clearly better than the coarse mount, on which much of the value rests")
        return "; ".join([*parts, REMEDY]) if parts else ""


def _with_sigmas(values: Mapping[str, float]) -> str:
    units = {name: unit for name, _, _, unit in PARAMETERS}
    return ", ".join(
        f"{name} (±{sigma:.3f}°)" if units[name] == "deg" else f"{name} (±{1000 * sigma:.0f} mm)"
        for name, sigma in values.items()
    )


def share_of_coarse_mount(
    sigmas: Mapping[str, float] | None,
    estimate: pd.DataFrame,
    freed: pd.DataFrame,
    limits: VerdictLimits,
    hold_share: float,
) -> ShareOfCoarseMount:
    """Return which mount parameters are not good enough; none without a result.

    Parameters
    ----------
    sigmas : total sigmas by setting, degrees and m; None if there is no result
    estimate : table of the estimates, with the total sigmas about the body's axes
    freed : table of the single-parameter tests, with the coarse sigmas
    limits : limits of the total sigmas
    hold_share : largest share of its coarse sigma that is clearly better
    """
    above_limit, unimproved = {}, {}
    if sigmas is not None:
        total = estimate.set_index("unknown")["sigma_total"]
        coarse = freed.set_index("unknown")["considered"]
        largest = limits_by_setting(limits)
        for name, place, key, _ in PARAMETERS:
            parameter = MOUNT_NAMES[place]
            if not sigmas[key] <= largest[key]:
                above_limit[name] = sigmas[key]
            if not total[parameter] <= hold_share * coarse[parameter]:
                unimproved[name] = sigmas[key]
    return ShareOfCoarseMount(above_limit, unimproved)


def contradicted_coarse_mount(freed: pd.DataFrame, level: float) -> Iterator[Statement]:
    """Yield a reason if the points contradict the coarse mount: a value without its observation is far from it.

    One wrong value can make others look wrong. The one farthest off, in sigmas, comes first.

    Parameters
    ----------
    freed : table of the single-parameter tests
    level : level of all these tests together
    """
    limit = significance_limit(freed, level)
    rows = freed[freed["unknown"].isin(MOUNT_NAMES) & ~freed["estimated"]].to_dict("records")
    off = [row for row in rows if abs(row["value"]) > limit * row["expected"]]
    wrong = sorted(off, key=lambda row: -abs(row["value"]) / row["expected"])
    if not wrong:
        return
    first, *others = wrong
    place, times = MOUNT_NAMES.index(first["unknown"]), abs(first["value"]) / first["expected"]
    if place < 3:
        size = size_words(np.degrees(first["value"]), np.degrees(first["sigma"]), "°")
        move = f"turned by {size} about body {'xyz'[place]} ({MOUNT_WORDS[place]})"
    else:
        move = f"moved by {size_words(1e3 * first['value'], 1e3 * first['sigma'], 'mm')} along body {'xyz'[place - 3]}"
    names = ", ".join(MOUNT_WORDS[MOUNT_NAMES.index(row["unknown"])] for row in others)
    also = f"; beyond the limit of {limit:.1f} as well: {names}" if others else ""
    words = (
        f"the points contradict the coarse mount: by them it should be {move}, {times:.1f} times what its sigma and "
        f"noise allow{also}; what rests on it is wrong, too: check it, or state how uncertain it is "
        "(laser_fit.coarse_sigma_deg, coarse_sigma_m, or laser.mount_covariance)"
    )
    yield Statement(ReasonCode.COARSE_MOUNT_CONTRADICTED, words)
