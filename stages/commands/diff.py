"""Two runs set beside each other, for ``poolcal diff`` and ``view``."""

from pathlib import Path
from typing import Any

from stages import ORDER


def comparison(first: Path, second: Path, *tolerances: float | None) -> dict[str, Any]:
    from pipeline.results.compare import RunRead, diff

    return diff(RunRead.read(first, ORDER), RunRead.read(second, ORDER), *tolerances)


def save_pair(first: Path, second: Path, found: dict[str, Any], path: Path) -> None:
    from pipeline.atomic_files import writing
    from stages.views.two_runs import save_pair as write_pair

    with writing(path):
        write_pair(first, second, found, path)
