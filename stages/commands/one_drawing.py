"""No command: this module makes one drawing, the report's page or a stage's recording, and returns a failure."""

import traceback
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pipeline.atomic_files import write_bytes
from pipeline.errors import PoolcalError
from pipeline.run.results import PAGE, recording_path
from stages import names_in

RECORDINGS = "recordings"


@dataclass(frozen=True)
class DrawingFailure:
    """A drawing that failed, and the reason; ``trace``: the traceback if the cause is a bug."""

    kind: str
    reason: str
    trace: str = ""

    @classmethod
    def of(cls, kind: str, error: Exception) -> "DrawingFailure":
        """Return the failure with the first line of an error, and with the traceback of an unexpected error."""
        expected = isinstance(error, (PoolcalError, OSError))
        trace = "" if expected else "".join(traceback.format_exception(error)).rstrip()
        first = str(error).partition("\n")[0]
        return cls(kind, f"{type(error).__name__}: {first}", trace)


def draw_one(run: Path, name: str) -> DrawingFailure | None:
    """Draw the page or a stage's recording; return the failure, or None."""
    try:
        if name == PAGE:
            _draw_page(run)
        else:
            _draw_recording(run, name)
    except Exception as error:
        return DrawingFailure.of(kind_of_drawing(name), error)
    return None


def kind_of_drawing(name: str) -> str:
    """Return the kind of a drawing for messages: PAGE, or RECORDINGS for the recording of any stage."""
    return PAGE if name == PAGE else RECORDINGS


def _draw_page(run: Path) -> None:
    from pipeline.results.pages import plots
    from pipeline.results.pages.report import write_report_page

    write_report_page(run, names_in(run), map(partial(plots.draw_picture, run), plots.picture_names(run)))


def _draw_recording(run: Path, stage: str) -> None:
    from stages.views.blueprint import tabs_of
    from stages.views.recording import record

    write_bytes(recording_path(run, stage), record(run, stage, tabs_of(run)))
