"""Angles and offsets in turn: how much each turn still changes."""

from typing import Any

import numpy as np

from pipeline import artefacts
from pipeline.tables import Tables
from stages.views import LASER, SONAR

CURVES = (("angles", "step_deg", 1.0, SONAR, "angles, °"), ("offsets", "step_m", 1000.0, LASER, "offsets, mm"))
SMALLEST = 1e-9  # the curve is the power of ten


def log(recording: Any, tables: Tables) -> None:
    import rerun as rr

    turns = tables.table(artefacts.ALTERNATION)
    steps = rr.TimeColumn("iteration", sequence=turns["iteration"].to_numpy())
    for name, column, scale, colour, label in CURVES:
        path = f"curves/turns/{name}"
        recording.log(path, rr.SeriesLines(colors=colour, names=f"log10 of {label}"), static=True)
        size = np.log10(np.maximum(scale * turns[column].to_numpy(), SMALLEST))
        recording.send_columns(path, indexes=[steps], columns=rr.Scalars.columns(scalars=size))
