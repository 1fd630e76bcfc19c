"""One small session, simulated and calibrated once a worker process; copies of it to spoil.

Fixtures of every folder of tests: ``tests/conftest.py`` imports them, so that a worker makes them once for all.
"""

import shutil
from pathlib import Path

import pytest

from tests.support.places import Place, Told, digests, poolcal, simulate


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The session folder; its truth is beside it. Nobody changes it."""
    return simulate(tmp_path_factory.mktemp("small") / "session")


@pytest.fixture(scope="session")
def undisturbed(small: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Told]:
    """The run folder of the small session, calibrated once with one job and left alone, and what was said."""
    run = tmp_path_factory.mktemp("undisturbed") / "run"
    told = poolcal("run", small, "--config", small / "pool.yaml", "--run", run, "--jobs", 1, "--report")
    assert told.status == 0, told.err
    return run, told


@pytest.fixture(scope="session")
def right(undisturbed: tuple[Path, Told]) -> dict[str, str]:
    """Digests of every Parquet file of the undisturbed run."""
    return digests(undisturbed[0])


@pytest.fixture
def place(small: Path, tmp_path: Path) -> Place:
    made = Place(small, tmp_path)
    made.mend()
    return made


@pytest.fixture
def done(place: Place, undisturbed: tuple[Path, Told]) -> Place:
    """A place whose run is complete; nothing is drawn."""
    shutil.copytree(undisturbed[0], place.run, ignore=shutil.ignore_patterns("*.html"))
    return place
