"""Angles and offsets in turn: how much each turn still changes."""

from functools import partial
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.patent import ALTERNATION, CORRECTIONS
from pipeline.run.results import Tables
from stages.views.angle_iterate import say_why, steps_of
from stages.views.recording import LASER, SONAR, curve

CURVES = (("angles", "step_deg", 1.0, SONAR, "angles, °"), ("offsets", "step_m", 1000.0, LASER, "offsets, mm"))
SMALLEST = 1e-9  # the curve is the power of ten


def log(recording: Any, tables: Tables) -> None:
    import rerun as rr

    say_why(recording, "offsets", tables.table(CORRECTIONS))
    turns = tables.table(ALTERNATION)
    for name, column, scale, colour, label in CURVES:
        style = rr.SeriesLines(colors=colour, names=f"log10 of {label}")
        size = np.log10(np.maximum(scale * turns[column].to_numpy(), SMALLEST))
        curve(recording, f"curves/turns/{name}", style, partial(steps_of, turns), size)
