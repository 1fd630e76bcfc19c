"""Simulated sessions to check, each made once a worker process; copies of them to spoil."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import stages.commands.check
from pipeline.checking.trial_calibration import TrialCalibration
from tests.support.checks import FINE
from tests.support.places import simulate
from tests.support.roots import SCENARIOS


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Sessions by scenario and changed blocks, each simulated once. Nobody changes them."""
    place = tmp_path_factory.mktemp("checked")
    made: dict[str, Path] = {}

    def session(scenario: str = "default", **blocks: Any) -> Path:
        key = json.dumps([scenario, blocks])
        if key not in made:
            made[key] = simulate(place / f"{len(made)}", base=SCENARIOS / f"{scenario}.yaml", **(FINE | blocks))
        return made[key]

    return session


@pytest.fixture
def spoilt(good: Callable[..., Path], tmp_path: Path) -> Callable[..., Path]:
    """A copy of one's own."""

    def copy(*words: str, **blocks: Any) -> Path:
        folder = tmp_path / "session"
        shutil.copytree(good(*words, **blocks), folder)
        return folder

    return copy


@pytest.fixture
def calibrated_where_marked(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seconds are spent on calibrating a sample only where it is asked what that tells."""
    if not request.node.get_closest_marker("calibrates"):
        monkeypatch.setattr(stages.commands.check, "_calibrated", lambda *_: TrialCalibration())
