"""Two runs set beside each other, for ``poolcal diff`` and ``view``."""

from pathlib import Path
from typing import Any

from stages import ORDER


def comparison(
    first: Path, second: Path, tolerance_deg: float | None = None, tolerance_mm: float | None = None
) -> dict[str, Any]:
    """Return the difference of two run folders, of :func:`pipeline.results.compare.run_difference`.

    Parameters
    ----------
    first, second
        The run folders.
    tolerance_deg, tolerance_mm
        Differences of an angle and of a lever arm's component that are tolerated.
    """
    from pipeline.results.compare import run_difference
    from pipeline.results.finished_run import FinishedRun
    from pipeline.results.mount_difference import Tolerances

    tolerances = Tolerances(tolerance_deg, tolerance_mm)
    return run_difference(FinishedRun.read(first, ORDER), FinishedRun.read(second, ORDER), tolerances)


def save_pair(first: Path, second: Path, difference: dict[str, Any], path: Path) -> None:
    """Write a recording of two run folders.

    Parameters
    ----------
    first, second
        The run folders.
    difference
        Their difference, of :func:`comparison`.
    path
        The recording's file.
    """
    from pipeline.atomic_files import writing
    from stages.views.two_runs import save_two_runs

    with writing(path):
        save_two_runs(first, second, difference, path)
