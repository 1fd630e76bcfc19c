"""Draw a picture of the pipeline from the inputs and outputs that the stages declare.

Usage: python -m tools.pipeline_picture OUT.svg
"""

import sys
import textwrap
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from pipeline.artefacts.schema import Artefact, Document, RawFiles
from pipeline.results.pages.rendering import INK, LASER, QUIET, SONAR, drawing_style
from pipeline.run.stage_protocol import declared, name_of
from stages import load

STEP, HEIGHT, WIDTH = 1.15, 0.62, 2.3
RAW = {"ins": "INS", "laser": "laser", "mbes": "sonar"}


def picture(path: Path) -> None:
    """Draw the stages from top to bottom, with arrows from earlier stages on the left and outputs on the right."""
    stages = load()
    place = {name_of(stage): -STEP * k for k, stage in enumerate(stages)}
    with drawing_style():
        figure = Figure(figsize=(8.6, 6.6))
        axis = figure.add_axes((0, 0, 1, 1))
        axis.set(xlim=(-4.2, 7.4), ylim=(-STEP * len(stages) - 0.1, 1.35))
        axis.axis("off")
        for stage in stages:
            name, y = name_of(stage), place[name_of(stage)]
            box = FancyBboxPatch((-WIDTH / 2, y - HEIGHT / 2), WIDTH, HEIGHT, "round,pad=0.05", fc="#f3f5f7", ec=QUIET)
            axis.add_patch(box)
            axis.text(0, y, name, ha="center", va="center", fontsize=10, weight="bold", color=INK)
            written = [m.name for m in declared(stage.Outputs).values() if isinstance(m, (Artefact, Document))]
            lines = textwrap.wrap(", ".join(written), 62)
            axis.text(WIDTH / 2 + 0.25, y, "\n".join(lines), va="center", fontsize=8, color=INK)
            inputs = declared(stage.Inputs).values()
            for owner in dict.fromkeys(m.owner for m in inputs if isinstance(m, (Artefact, Document))):
                _arrow(axis, place[owner], y)
            raw = [RAW[m.sensor] for m in inputs if isinstance(m, RawFiles)]
            if raw:
                axis.annotate(
                    f"files of {', '.join(raw)}; session.yaml; the pool's config",
                    (0, y + HEIGHT / 2 + 0.05), (0, y + 1.0), ha="center", fontsize=9,
                    arrowprops={"arrowstyle": "-|>", "color": LASER},
                )  # fmt: skip
        last = min(place.values())
        down = {"arrowstyle": "-|>", "color": SONAR}
        axis.annotate("", (0, last - 1.0), (0, last - HEIGHT / 2 - 0.05), arrowprops=down)
        axis.text(0.2, last - 0.8, "drawn from all of it: report.html, a recording of every stage", fontsize=9)
        figure.savefig(path, metadata={"Date": None, "Creator": None})


def _arrow(axis: Axes, start: float, end: float) -> None:
    """Draw an arrow: straight to the next stage, round the left to any later one; the farther, the wider."""
    steps = round((start - end) / STEP)
    ends: tuple[tuple[float, float], tuple[float, float]]
    if steps == 1:
        ends, colour, bend = ((0, start - HEIGHT / 2 - 0.05), (0, end + HEIGHT / 2 + 0.05)), INK, "arc3"
    else:
        left = -WIDTH / 2 - 0.05
        ends, colour, bend = ((left, start), (left, end)), QUIET, f"arc3,rad={0.62 - 0.03 * steps:.2f}"
    arrow = FancyArrowPatch(*ends, arrowstyle="-|>", mutation_scale=9, color=colour, connectionstyle=bend)
    axis.add_patch(arrow)


if __name__ == "__main__":
    picture(Path(sys.argv[1]))
