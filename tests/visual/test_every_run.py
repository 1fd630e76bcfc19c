"""Whatever a run came to, the viewer opens its recordings, and every tab that it offers shows something."""

from pathlib import Path
from typing import Any

import pytest

from stages.views.blueprint import TABS, tabs_of
from stages.views.recording import recordings_of
from tests.support.places import poolcal, simulate
from tests.support.roots import SCENARIOS
from tests.support.viewer import views_of
from tools.pictures import show_tab, viewer

REJECTED, LASER = "rejected", "laser"  # beside the scenarios
EVERY = [*sorted(path.stem for path in SCENARIOS.glob("*.yaml")), REJECTED, LASER]
GONE = {  # tabs, where there is nothing to show
    "caisson": {"Iteration"}, "dock": {"Iteration"}, REJECTED: {"Iteration"}, LASER: {"Before and after", "Iteration"},
}


def calibrated(name: str, folder: Path) -> Path:
    """A small run of the scenario, with its recordings."""
    base = SCENARIOS / f"{name}.yaml"
    short: dict[str, Any] = {"track": {"distances_m": [4.0], "half_length_m": 1.0}} if name == REJECTED else {}
    session = simulate(folder / "session", base=base if base.is_file() else None, **short)
    command = ["laser", "--no-write", "--no-report"] if name == LASER else ["run"]
    words = (session, "--config", session / "pool.yaml", "--run", folder / "run", "--jobs", 1, "--recordings")
    told = poolcal(*command, *words)
    assert told.status in (0, 1), told.err
    assert "not drawn" not in told.err
    if name == REJECTED:
        assert told.status == 1
    return folder / "run"


@pytest.mark.thorough
@pytest.mark.parametrize("name", EVERY)
def test_the_viewer_opens_it(name: str, tmp_path: Path) -> None:
    run = calibrated(name, tmp_path)
    tabs = tabs_of(run)
    assert set(TABS) - set(tabs) == GONE.get(name, set())
    with viewer(*recordings_of(run)) as client:
        for tab in tabs:
            show_tab(client, tab)
            client.save_screenshot(str(tmp_path / "tab.png"))
            inside = views_of(client.get_blueprint().blueprint, tab)
            assert len(inside) >= 2
            for view in client.get_state().views:
                if view.view_id in inside:
                    assert view.reports == [], view.name
        assert [entry for entry in client.get_logs() if entry.level == "error"] == []
