"""Draw one thing, the report's page or a stage's recording, and say why that failed."""

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
    """What could not be drawn, and why; ``trace``: of a bug."""

    kind: str
    reason: str
    trace: str = ""

    @classmethod
    def of(cls, kind: str, error: Exception) -> "DrawingFailure":
        """Return the failure that an error is: one line of it, and the traceback of one that nobody expects."""
        expected = isinstance(error, (PoolcalError, OSError))
        trace = "" if expected else "".join(traceback.format_exception(error)).rstrip()
        first = str(error).partition("\n")[0]
        return cls(kind, f"{type(error).__name__}: {first}", trace)


def draw_one(run: Path, name: str) -> DrawingFailure | None:
    """Draw the page, or a stage's recording; return what went wrong, if anything did."""
    try:
        if name == PAGE:
            _draw_page(run)
        else:
            _draw_recording(run, name)
    except Exception as error:  # a failed drawing, whatever its cause, must not stop the others
        return DrawingFailure.of(kind_of_drawing(name), error)
    return None


def kind_of_drawing(name: str) -> str:
    """Return what a name is called in messages: the page by its name, a stage's recording by RECORDINGS."""
    return PAGE if name == PAGE else RECORDINGS


def _draw_page(run: Path) -> None:
    from pipeline.results.pages import plots
    from pipeline.results.pages.report import write_report_page

    write_report_page(run, names_in(run), map(partial(plots.draw_picture, run), plots.picture_names(run)))


def _draw_recording(run: Path, stage: str) -> None:
    from stages.views.blueprint import tabs_of
    from stages.views.recording import record

    write_bytes(recording_path(run, stage), record(run, stage, tabs_of(run)))
