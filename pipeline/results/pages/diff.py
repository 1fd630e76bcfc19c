"""The page of the difference of two runs, with the content that ``poolcal diff`` prints."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from pipeline.mount import WITHIN_95
from pipeline.results.answer_text import answer_lines
from pipeline.results.diff_text import own_faces_counted
from pipeline.results.mount_difference import quantity_text
from pipeline.results.pages.rendering import ALARM, INK, QUIET, WIDTH_IN, drawing_style, picture, render_page


def difference_page(difference: Mapping[str, Any]) -> str:
    """Return the page as HTML; ``difference``: the result of :func:`pipeline.results.diff.run_difference`."""
    rows = difference["parameters"]
    return render_page(
        "diff.html",
        difference=difference,
        rows=rows,
        sentences=list(answer_lines(difference)),
        config=list(own_faces_counted(difference["config"])),
        shown=quantity_text,
        plain=lambda value: "–" if value is None else value if isinstance(value, str) else json.dumps(value),
        chart=_difference_chart(rows) if rows else None,
    )


def _difference_chart(rows: list[dict[str, Any]]) -> Markup:
    """Draw each difference in units of its sigma, with its 95 % interval; in red if the parameter has moved."""
    with drawing_style():
        figure = Figure(figsize=(WIDTH_IN, 2.0))
        axis = figure.add_axes((0.13, 0.24, 0.85, 0.72))
        z = np.array([row["z"] for row in rows])
        for place, row in enumerate(rows):
            colour = ALARM if row["moved"] else INK
            axis.errorbar([z[place]], [place], xerr=[WITHIN_95], fmt="o", color=colour, markersize=4, linewidth=1.2)
        axis.axvline(0, color=QUIET, linewidth=0.8)
        widest = max(4.0, 1.1 * (float(np.max(np.abs(z))) + WITHIN_95))
        axis.set(xlim=(-widest, widest), xlabel="b - a, in sigmas of the difference, with 95 % intervals")
        axis.set_yticks(range(len(rows)), [row["parameter"] for row in rows])
        axis.invert_yaxis()
        return picture(figure, "differences of the mount parameters in sigmas")
