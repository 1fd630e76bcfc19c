"""Angles and offsets in turn: how much each turn still changes."""

from functools import partial
from typing import Any

import numpy as np

from pipeline import artefacts
from pipeline.tables import Tables
from stages.views import LASER, SONAR, curve
from stages.views.angle_iterate import say_why, steps_of

CURVES = (("angles", "step_deg", 1.0, SONAR, "angles, °"), ("offsets", "step_m", 1000.0, LASER, "offsets, mm"))
SMALLEST = 1e-9  # the curve is the power of ten


def log(recording: Any, tables: Tables) -> None:
    import rerun as rr

    say_why(recording, "offsets", tables.table(artefacts.CORRECTIONS))
    turns = tables.table(artefacts.ALTERNATION)
    for name, column, scale, colour, label in CURVES:
        style = rr.SeriesLines(colors=colour, names=f"log10 of {label}")
        size = np.log10(np.maximum(scale * turns[column].to_numpy(), SMALLEST))
        curve(recording, f"curves/turns/{name}", style, partial(steps_of, turns), size)
