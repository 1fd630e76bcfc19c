"""The geometry of a session's passes: its gaps, and the further passes that would help."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.config.plan import WAVE_SHARES, LaserFigures, MbesFigures, Pass, Plan
from pipeline.maths.adjustment.solution import Solution
from pipeline.planning.observability import Coverage, geometry_advice
from pipeline.planning.setting import PredictionSetting

Array = NDArray[np.float64]


def sailed_plan(files: pd.DataFrame) -> Plan:
    """Return a plan with the rates of a session's files (table ``files``), for the prediction of further passes."""
    rates = files.groupby("sensor")["rate_hz"].median()
    usual = Plan(passes=(Pass(distance_m=1.0),))
    return usual.model_copy(
        update={
            "ins_rate_hz": max(10.0, _measured(rates["ins"], usual.ins_rate_hz)),
            "laser": LaserFigures(point_rate_hz=_measured(rates["laser"], usual.laser.point_rate_hz)),
            "mbes": MbesFigures(
                ping_rate_hz=float(np.clip(_measured(rates["mbes"], usual.mbes.ping_rate_hz), 0.1, 200.0))
            ),
        }
    )


def geometry_table(
    setting: PredictionSetting,
    passes: pd.DataFrame,
    soundings: Mapping[str, int],
    normal: Array,
    solution: Solution,
    rough: bool,
) -> pd.DataFrame:
    """Return table ``geometry``: the gaps in the geometry of the passes, and the remedy.

    Further passes of a rough wall see the same bumps again: then no remedy is told.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    passes : DataFrame
        Rows of table passes, for the passes with soundings.
    soundings : mapping of int
        Number of soundings by family.
    normal : (u, u) array
        Normal matrix of all parameters.
    solution : Solution
        The session's solution.
    rough : bool
        Whether the walls were found to be rough.
    """
    usual, tied = setting.plan.passes[0], setting.model.tied_families
    coverage = Coverage(
        distances_m=[float(distance) for distance in passes["distance_m"] if np.isfinite(distance)],
        soundings={family: count for family, count in soundings.items() if family in tied},
        level={family.name for family in setting.model.families if family.level},
        sloping={family.name for family in setting.model.families if family.sloping},
        speed_m_s=_measured(passes["speed_m_s"].abs().median(), usual.speed_m_s),
        # its standard deviation, over that of two waves of amplitude 1
        heading_swing_deg=_measured(
            passes["heading_swing_deg"].median() / float(np.linalg.norm(WAVE_SHARES) * np.sqrt(0.5)),
            usual.heading_swing_deg,
        ),
    )
    advice = geometry_advice(setting, coverage, [normal], solution)
    rows = [("gap", words) for words in advice.gaps]
    if advice.remedy and not rough:
        rows.append(("remedy", advice.remedy))
    return pd.DataFrame(rows, columns=["kind", "words"])


def _measured(value: float, usual: float) -> float:
    """Return the session's value, clipped to 0.05 to 1e7; the usual value if the session's is not finite."""
    return float(np.clip(value, 0.05, 1e7)) if np.isfinite(value) else usual
