"""What is made of the small session and its run, once a worker process."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from markupsafe import Markup

import pipeline.results.pages.history
import pipeline.results.pages.plots
from stages import ORDER
from stages.commands.draw import Drawings, draw_missing
from tests.support.places import Told, result_of
from tools.survey_software import Entry, Recording, entry_of, recording


@pytest.fixture(scope="session")
def truth(small: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(small.with_name("session.truth.json").read_text(encoding="utf-8"))
    return content


@pytest.fixture(scope="session")
def finished(undisturbed: tuple[Path, Told]) -> Path:
    """The run folder of the undisturbed run."""
    return undisturbed[0]


@pytest.fixture(scope="session")
def recorded(small: Path) -> Recording:
    """What a survey software reads of the session."""
    return recording(small)


@pytest.fixture(scope="session")
def thinned(recorded: Recording) -> Recording:
    """Every third ping: what is wrong must be told from these as well."""
    kept = np.unique(recorded.t_ns, return_inverse=True)[1] % 3 == 0
    return replace(recorded, t_ns=recorded.t_ns[kept], points_m=recorded.points_m[kept])


@pytest.fixture(scope="session")
def entry(finished: Path) -> Entry:
    """The calibrated mount, as it is to be entered there."""
    return entry_of(result_of(finished))


@pytest.fixture(scope="session")
def drawn(undisturbed: tuple[Path, Told], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The undisturbed run with its page and recordings. Nobody changes it."""
    run = tmp_path_factory.mktemp("drawn") / "水池 <b>1</b>"
    shutil.copytree(undisturbed[0], run)
    assert draw_missing(run, Drawings(report=True, recordings=True)) == []
    assert sorted(path.stem for path in run.glob("*/*.rrd")) == sorted(ORDER)
    return run


@pytest.fixture
def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of pages are empty, where a test reads the words: they take six sevenths of the time of a page."""

    def empty(*_: object) -> Markup:
        return Markup('<img class="picture" alt="empty" src="data:image/svg+xml;base64,">')

    monkeypatch.setattr(pipeline.results.pages.plots, "draw_picture", empty)
    monkeypatch.setattr(pipeline.results.pages.history, "picture", empty)
