"""Check of the water's level by time: the boat floats, so its height must rise and fall with the water."""

import pandas as pd

from pipeline.artefacts.water_levels import contradiction
from pipeline.config.target import Target
from pipeline.report.reason_codes import ReasonCode, Statement


def water_contradicted(
    water_levels: pd.DataFrame, cells: pd.DataFrame, target: Target, margin_m: float
) -> list[Statement]:
    """Return a warning if the boat's height, or target.water_level_m, contradicts target.water_by_time.

    Parameters
    ----------
    water_levels, cells
        The tables; passes without points on the target do not count.
    target
        The target's settings.
    margin_m
        By so much the water may rise otherwise than the boat.
    """
    rows = water_levels[water_levels["pass"].isin(cells["pass"])]
    names = [f"pass {number}" for number in rows["pass"]]
    levels_m, ins_m = rows["level_m"].to_numpy(), rows["ins_m"].to_numpy()
    return [
        Statement(ReasonCode.WATER_CONTRADICTED, words)
        for words in contradiction(target, levels_m, ins_m, names, margin_m)
    ]
