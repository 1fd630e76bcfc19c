"""What people look at, drawn from a finished run after its verdict: the report's page and the recordings."""

from pathlib import Path

from pipeline import folder, manifest
from pipeline.errors import PoolcalError
from pipeline.executor import SERIAL, Workers
from stages import ORDER

PAGE = "report.html"
RECORDINGS = "recordings"


def draw(
    run: Path, report: bool = True, recordings: bool = True, workers: Workers = SERIAL
) -> dict[str, Exception]:
    """Draw what is not drawn yet. A finished result is never touched; what could not be drawn comes back with why."""
    try:
        with folder.locked(run, ORDER):
            wanted = [PAGE] * report + _recorded(run) * recordings
            tasks = [(run, name) for name in wanted]
            failed = [one for one in workers.here(_draw, tasks) if one is not None]
    except (PoolcalError, OSError) as error:  # the folder is in use, or cannot be written
        return {"pictures": error}
    return dict(reversed(failed))


def _recorded(run: Path) -> list[str]:
    from stages.views import DRAWN

    return [stage for stage in DRAWN if manifest.read(run / stage) is not None]


def _draw(task: tuple[Path, str]) -> tuple[str, Exception] | None:
    run, name = task
    try:
        if name == PAGE:
            from pipeline.pages.report import write_page

            write_page(run, ORDER)
        else:
            from stages.views import record

            record(run, name)
    except Exception as error:
        return (PAGE if name == PAGE else RECORDINGS), error
    return None
