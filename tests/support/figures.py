"""Figures that a page would draw, kept as figures."""

from types import ModuleType

import pytest
from markupsafe import Markup
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


def kept_figures(monkeypatch: pytest.MonkeyPatch, *modules: ModuleType) -> list[Figure]:
    """The list in which the figures of these modules' pictures are kept, drawn, from now on."""
    found: list[Figure] = []

    def kept(figure: Figure, _: str) -> Markup:
        FigureCanvasAgg(figure)
        figure.draw_without_rendering()
        found.append(figure)
        return Markup()

    for module in modules:
        monkeypatch.setattr(module, "picture", kept)
    return found
