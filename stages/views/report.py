"""The answer in words, as on the screen."""

from typing import Any

from pipeline.results.screen import summary
from pipeline.run.results import Tables, calibration
from stages.views.recording import words


def log(recording: Any, tables: Tables) -> None:
    recording.log("tables/summary", words(summary(calibration(tables.run))), static=True)
