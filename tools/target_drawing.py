"""Draw the patent's target with its letters and faces, as the program's own model has them.

Usage: python -m tools.target_drawing docs/pictures/target.svg
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from pipeline.config.target import Letters, Origin
from pipeline.maths.target.model import TargetModel
from pipeline.results.pages.rendering import FAMILY, INK, QUIET, drawing_style
from pipeline.target.design import target_of

Array = NDArray[np.float64]

WATER, ARROW = "#2a6f97", "#b5485d"
AZIMUTH_DEG, ELEVATION_DEG = 196.0, 20.0  # of the eye, seen from the target: in front of it, and to the south


def light(family: str) -> Array:
    """Return the family's colour in the report, mixed with white."""
    return 0.45 * np.array(to_rgb(FAMILY[family])) + 0.55


def example() -> Letters:
    """Return the target of the demo's pool: a 8 m, b 3 m, c 1 m, e 0.5 m, half of it below the water."""
    origin = Origin(latitude_deg=36.0, longitude_deg=120.1, height_m=12.0)
    return Letters(kind="letters", a=8.0, b=3.0, c=1.0, e=0.5, origin=origin)


def projection() -> Array:
    """Return the matrix (2, 3) that takes points of frame target to the drawing: right and up of the eye."""
    azimuth, elevation = np.radians([AZIMUTH_DEG, ELEVATION_DEG])
    toward = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )  # from the target to the eye
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right)])


def draw_faces(axis: Axes, model: TargetModel) -> None:
    """Draw the faces that look to the eye, the farthest first; what is below the water is darker."""
    flat = projection()
    toward = np.cross(flat[0], flat[1])
    seen = [face for face in model.faces if face.normal @ toward > 0]
    for face in sorted(seen, key=lambda face: float(face.vertices_m.mean(axis=0) @ toward)):
        corners = face.vertices_m @ flat.T
        axis.add_patch(Polygon(corners, fc=light(face.family), ec=INK, lw=0.7))
        middle = face.vertices_m.mean(axis=0)
        if not face.level and face.family != "P2":
            right, up = flat @ middle
            axis.text(right, up, face.name, ha="center", va="center", fontsize=7, color=INK)


def draw_water(axis: Axes, water_m: float) -> None:
    """Draw the surface of the water in front of the target."""
    flat = projection()
    sheet = np.array([[-2.6, -2.9, water_m], [0, -2.9, water_m], [0, 2.9, water_m], [-2.6, 2.9, water_m]])
    axis.add_patch(Polygon(sheet @ flat.T, fc=WATER, ec=WATER, alpha=0.3, lw=0.8))
    axis.annotate(
        "water", tuple(flat @ sheet[0]), xytext=(22, -4), textcoords="offset points", color=WATER, fontsize=9,
        ha="right",
    )  # fmt: skip


def measure(axis: Axes, start: tuple[float, ...], end: tuple[float, ...], word: str, shift: tuple[int, int]) -> None:
    """Draw a dimension line between two points of frame target, with its letter."""
    flat = projection()
    first, second = flat @ np.array(start), flat @ np.array(end)
    axis.annotate("", tuple(first), tuple(second), arrowprops={"arrowstyle": "<->", "color": INK, "lw": 1.0})
    axis.annotate(
        word, tuple((first + second) / 2), xytext=shift, textcoords="offset points", ha="center", va="center",
        fontsize=11, weight="bold", color=INK,
    )  # fmt: skip


def oblique_view(axis: Axes, model: TargetModel, letters: Letters) -> None:
    """Draw the target as it is seen from the boat, half in and half out of the water."""
    a, b, c, e = letters.a, letters.b, letters.c, letters.e
    draw_faces(axis, model)
    draw_water(axis, letters.water_level_m)
    flat = projection()
    right, up = flat @ np.array([0, 0, 0.7 * a / 2])
    axis.text(right, up, "P2", ha="center", va="center", fontsize=10, color=INK)
    measure(axis, (0, -b / 2 - 2.0, -a / 2), (0, -b / 2 - 2.0, a / 2), "a", (9, 0))
    measure(axis, (0, -b / 2, a / 2 + 0.35), (0, b / 2, a / 2 + 0.35), "b", (0, 9))
    top = max(float(face.vertices_m[:, 2].max()) for face in model.faces if face.family == "P1")
    measure(axis, (c, -b / 2 - c - 0.2, top - e), (c, -b / 2 - c - 0.2, top), "e", (9, 0))
    measure(axis, (c, -b / 2 - c - 0.2, top - 2 * e), (c, -b / 2 - c - 0.2, top - e), "e", (9, 0))
    axis.annotate(
        "H: all tops and bottoms", tuple(flat @ np.array([0.6, b / 2 + 0.3, top + e])), xytext=(-14, 20),
        textcoords="offset points", fontsize=8, color=INK, ha="center", arrowprops={"arrowstyle": "-", "color": INK},
    )  # fmt: skip
    axis.set_title("as the boat sees it", fontsize=10, color=QUIET)


def plan_view(axis: Axes, model: TargetModel, letters: Letters) -> None:
    """Draw the target from above, with its axes and the boat's track; +y is up."""
    b, c = letters.b, letters.c
    done = set()
    for face in model.faces:
        if face.level and face.name.split("-")[0] not in done and face.normal[2] > 0:
            done.add(face.name.split("-")[0])
            axis.add_patch(Polygon(face.vertices_m[:, :2], fc=light(face.name[:2]), ec=INK, lw=0.8))
    axis.plot([0, 0], [-b / 2, b / 2], color=INK, lw=2.5)
    axis.plot([c, c], [-b / 2 - c, b / 2 + c], color=QUIET, lw=1.0)
    for word, at in (("P1", (0.55, -b / 2 - 0.3)), ("P2", (-0.25, 0.3)), ("P3", (0.55, b / 2 + 0.3))):
        axis.text(*at, word, ha="center", va="center", fontsize=9, color=INK)
    for at, word in (((1.3, 0.0), "x"), ((0.0, 1.3), "y")):
        axis.annotate("", at, (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": ARROW, "lw": 1.4})
        axis.text(at[0] + 0.14, at[1], word, fontsize=10, color=ARROW, va="center")
    axis.annotate("", (-2.4, 2.6), (-2.4, -2.6), arrowprops={"arrowstyle": "-|>", "color": WATER, "lw": 1.6})
    words = "the boat, target to starboard"
    axis.text(-2.55, 0.0, words, rotation=90, ha="right", va="center", color=WATER, fontsize=9)
    axis.annotate("", (0.0, b / 2 + c + 0.25), (c, b / 2 + c + 0.25), arrowprops={"arrowstyle": "<->", "color": INK})
    axis.text(c / 2, b / 2 + c + 0.4, "c", ha="center", fontsize=11, weight="bold", color=INK)
    axis.text(c / 2, -b / 2 - c - 0.35, "south (-y)", ha="center", va="top", fontsize=8, color=QUIET)
    axis.text(c / 2, b / 2 + c + 0.95, "north (+y)", ha="center", fontsize=8, color=QUIET)
    axis.set_title("from above", fontsize=10, color=QUIET)


def picture(path: Path) -> None:
    """Draw both views."""
    letters = example()
    model = target_of(letters)
    with drawing_style():
        figure = Figure(figsize=(8.2, 5.6))
        views = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        oblique_view(views[0], model, letters)
        plan_view(views[1], model, letters)
        for axis in views:
            axis.set_aspect("equal")
            axis.autoscale_view()
            axis.axis("off")
        left, right = views[0].get_xlim()
        views[0].set(xlim=(left, right + 0.8))
        views[1].set(xlim=(-3.2, 1.8), ylim=(-3.6, 4.0))
        figure.tight_layout(rect=(0, 0, 1, 0.97))
        figure.savefig(path, metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    picture(Path(sys.argv[1]))
