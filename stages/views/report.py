"""The answer in words, as on the screen."""

from typing import Any

from pipeline.folder import calibration
from pipeline.screen import summary
from pipeline.tables import Tables
from stages.views import words


def log(recording: Any, tables: Tables) -> None:
    recording.log("tables/summary", words(summary(calibration(tables.run))), static=True)
