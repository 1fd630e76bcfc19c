"""Sessions of a campaign compared in pairs, as ``poolcal diff`` does: how often is a movement reported, how often seen.

Pairs of equal truth give the false alarms. The estimates of the second session, shifted, give what is found.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binom, chi2

from pipeline.maths.detectable_movement import POWER
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.results.movement import SIGNIFICANCE, Movement, movement_between
from pipeline.results.session_estimate import SessionEstimate, session_estimate
from tools.campaigns import Campaign
from tools.session_rows import NAMES, UNITS

Pair = tuple[SessionEstimate, SessionEstimate]
FACTOR = 3.0  # a movement of so many of the sizes that the program says it finds


def pairs_report(campaign: Campaign, table: pd.DataFrame) -> str:
    """Return the results of comparing sessions 0 and 1, 2 and 3, … as they are and with one mount parameter moved.

    All sessions are compared; the alarms among the pairs that ``poolcal diff`` would answer, both accepted, are counted
    apart. So are the alarms by noise alone: if the sessions have no errors of their own, these are the ones that count.
    """
    rows: list[Any] = table.to_dict("records")
    by_noise = _pairs([replace(session, systematic={}) for session in map(_estimate, rows)])
    pairs = _pairs([_estimate(row) for row in rows]) if campaign.drawn else by_noise
    accepted = table["accepted"].to_numpy(dtype=bool).reshape(-1, 2).all(axis=1)
    both = np.flatnonzero(accepted).tolist()
    still = [movement_between(*pair) for pair in pairs]
    statistics = np.array([movement.difference.statistic for movement in still])
    low, high = (float(q) / len(pairs) for q in chi2.ppf([0.005, 0.995], 6 * len(pairs)) / 6)
    lines = [
        f"  compared in {len(pairs)} pairs: mean T / 6 {statistics.mean() / 6:.2f} (99 % band {low:.2f}-{high:.2f}), "
        f"{_alarms(still)}",
        f"  {len(both)} pairs with both accepted: mean T / 6 {statistics[both].mean() / 6:.2f}, "
        f"{_alarms([still[number] for number in both])}",
        f"  by noise alone: {_alarms([movement_between(*pair) for pair in by_noise])}",
    ]
    return "\n".join([*lines, *(_moved(pairs, still, k) for k in range(6))])


def _alarms(movements: list[Movement]) -> str:
    """Return the number of false alarms in words, with the band in which it lies in 99 % of all cases."""
    count, alarms = len(movements), sum(movement.answer == "moved" for movement in movements)
    low, high = binom.ppf([0.005, 0.995], count, SIGNIFICANCE)
    share = 100 * alarms / max(count, 1)
    return f"{alarms} false alarms, {share:.1f} % (level {100 * SIGNIFICANCE:.0f} %: {low:.0f} to {high:.0f})"


def _moved(pairs: list[Pair], still: list[Movement], k: int) -> str:
    """Return in words how often a movement of parameter ``k`` is found, by its size in detectable movements.

    Of the size ``alone`` it is to be found as often as the power says; of the larger size ``surely`` at least so often.
    """
    alone, surely = (
        np.array([getattr(movement.detectable, name)[k] for movement in still]) for name in ("alone", "surely")
    )
    words = []
    for size in (alone, surely, FACTOR * surely):
        moved = [
            movement_between(first, _shifted(second, k, least))
            for (first, second), least in zip(pairs, size.tolist(), strict=True)
        ]
        found, named = 100 * np.mean([(bool(one.moved), k in one.moved) for one in moved], axis=0)
        words.append(f"{np.median(size) / UNITS[k]:.3f}: {found:.1f} % ({named:.1f} % named)")
    unit = "degrees" if k < 3 else "mm"
    return f"  {NAMES[k]} moved alone by (medians, {unit}) {', '.join(words)}; the first is to be {100 * POWER:.0f} %"


def _shifted(session: SessionEstimate, k: int, size: float) -> SessionEstimate:
    """Return the session's estimate as it would be with the mount moved in parameter ``k``, rad or m."""
    move = np.zeros(6)
    move[k] = size
    R = exp_so3(move[:3]) @ session.mount.R_body_from_sensor
    mount = replace(session.mount, R_body_from_sensor=R, lever_arm_m=session.mount.lever_arm_m + move[3:])
    return replace(session, mount=mount)


def _estimate(row: Mapping[str, Any]) -> SessionEstimate:
    estimate = session_estimate(json.loads(row["calibration"]))
    if estimate is None:
        raise ValueError(f"seed {row['seed']}: no result")
    return estimate


def _pairs(sessions: list[SessionEstimate]) -> list[Pair]:
    return list(zip(sessions[::2], sessions[1::2], strict=True))
