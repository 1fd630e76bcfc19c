"""Stage offsets: the change of angles and offsets in each turn of the alternation."""

from functools import partial
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.patent import ALTERNATION, CORRECTIONS
from pipeline.run.results import Tables
from stages.views.angle_iterate import iteration_column, log_reasons
from stages.views.recording import LASER, SONAR, log_curve

CURVES = (("angles", "step_deg", 1.0, SONAR, "angles, °"), ("offsets", "step_m", 1000.0, LASER, "offsets, mm"))
SMALLEST = 1e-9  # smallest change that is shown; the curve is its logarithm


def log(recording: Any, tables: Tables) -> None:
    """Log the change of angles and offsets in each turn."""
    import rerun as rr

    log_reasons(recording, "offsets", tables.table(CORRECTIONS))
    turns = tables.table(ALTERNATION)
    for name, column, scale, colour, label in CURVES:
        style = rr.SeriesLines(colors=colour, names=f"log10 of {label}")
        size = np.log10(np.maximum(scale * turns[column].to_numpy(), SMALLEST))
        log_curve(recording, f"curves/turns/{name}", style, partial(iteration_column, turns), size)
