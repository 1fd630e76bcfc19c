"""What an INS says of its own accuracy (table ins_sigmas), and the drift that the adjustment concedes it by that."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.config.session import Drift, Ins
from pipeline.maths.geometry.passes import pass_of

AXES = {  # of the session's drift: the columns of which the root mean square counts
    "horizontal_m": ["north_m", "east_m"],
    "vertical_m": ["up_m"],
    "roll_pitch_deg": ["roll_deg", "pitch_deg"],
    "heading_deg": ["heading_deg"],
}


def told(ins: Ins, ins_sigmas: pd.DataFrame, passes: pd.DataFrame) -> dict[str, float]:
    """Figures of the drift that the files tell: the medians within the passes; none where the session's go first."""
    if ins.drift_from == "settings":
        return {}
    number = pass_of(*(table.to_numpy() for table in (ins_sigmas["t_ns"], passes["start_ns"], passes["end_ns"])))
    inside = ins_sigmas[number >= 0]
    return rms({name: inside[name].to_numpy(np.float64) for columns in AXES.values() for name in columns})


def rms(sigmas: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """The medians of the drift's figures by the sigmas' columns; those that are told."""
    squares = {name: np.mean([sigmas[one] ** 2 for one in columns], axis=0) for name, columns in AXES.items()}
    known = {name: values[np.isfinite(values)] for name, values in squares.items()}
    return {name: float(np.sqrt(np.median(values))) for name, values in known.items() if len(values)}


def drift_of(ins: Ins, ins_sigmas: pd.DataFrame, passes: pd.DataFrame) -> Drift:
    """The drift to be conceded: the files' figures where there are any, else the session's, as the time constant."""
    return ins.drift.model_copy(update=told(ins, ins_sigmas, passes))
