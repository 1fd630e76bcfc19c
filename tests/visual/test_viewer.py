"""The recordings in a headless viewer: every tab shows something, no view complains, the iteration closes."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from stages.commands.draw import Drawings, draw_missing
from stages.views.blueprint import TABS
from stages.views.recording import recordings_of
from tests.support.effort import often
from tests.support.viewer import views_of
from tools.pictures import picture_of, show_tab, viewer

LEAST_COLOURS = 40


@pytest.fixture(scope="module")
def client(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    assert draw_missing(run, Drawings(report=False, recordings=True)) == []
    with viewer(*recordings_of(run)) as opened:
        yield opened


@pytest.mark.parametrize("tab", often((TABS[0], TABS[-1]), TABS))
def test_every_view_of_every_tab_shows_something(client: Any, tab: str, tmp_path: Path) -> None:
    show_tab(client, tab)
    client.set_time("time" if tab == "Quality" else "iteration", play_state="paused")
    picture_of(client, tmp_path / "tab.png")
    blueprint = client.get_blueprint().blueprint
    inside = views_of(blueprint, tab)
    assert len(inside) >= 2
    for view in client.get_state().views:
        if view.view_id in inside:
            assert view.reports == [], view.name
            path = tmp_path / f"{view.view_id}.png"
            client.save_screenshot(str(path), view_id=view.view_id)
            image = Image.open(path).convert("RGB")
            colours = image.getcolors(10_000_000)
            assert colours is not None
            assert len(colours) >= LEAST_COLOURS, view.name
            assert max(count for count, _ in colours) < 0.995 * image.width * image.height, view.name


@pytest.mark.thorough
def test_a_scrub_through_the_iteration_closes_the_planes(client: Any, tmp_path: Path) -> None:
    """The sonar's planes and points move from step to step, and come to rest."""
    show_tab(client, "Iteration")
    (scene,) = (view.view_id for view in client.get_state().views if view.name.startswith("The patent"))
    end = next(t.end for t in client.get_state().recordings[0].timelines if t.name == "iteration")
    frames = []
    for step in (0, 1, 2, end - 1, end):
        client.set_time("iteration", sequence=step, play_state="paused")
        picture_of(client, tmp_path / "whole.png")
        path = tmp_path / f"{step}.png"
        client.save_screenshot(str(path), view_id=scene)
        frames.append(np.asarray(Image.open(path).convert("RGB")).astype(int))
    changed = [float(np.mean(np.any(a != b, axis=2))) for a, b in pairwise(frames)]
    assert changed[0] > 10 * changed[-1]
    assert changed[0] > 0.005
