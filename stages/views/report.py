"""Stage report: the result as text, the same as on the screen."""

from typing import Any

from pipeline.results.screen import summary
from pipeline.run.results import Tables, calibration
from stages.views.recording import text_document


def log(recording: Any, tables: Tables) -> None:
    """Log the result as text."""
    recording.log("tables/summary", text_document(summary(calibration(tables.run, several_heads=True))), static=True)
