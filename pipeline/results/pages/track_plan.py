"""A plan of the passes' tracks before the target."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.offsetbox import AnnotationBbox, DrawingArea
from matplotlib.patches import FancyArrow
from matplotlib.text import Text
from numpy.typing import NDArray

from pipeline.artefacts.from_tables import is_horizontal
from pipeline.results.pages.rendering import INK, QUIET, SONAR, WIDTH_IN, picture

Array = NDArray[np.float64]
ROSE_PT = 56.0  # size of the arrow to north with its letter


def pass_tracks(positions_m: Mapping[int, Array], faces: pd.DataFrame, azimuth_deg: float) -> Markup:
    """Draw the passes' tracks before the target from above, with an arrow to north.

    Parameters
    ----------
    positions_m
        The positions of the INS by pass, target frame, (n, 3).
    faces
        The artefact ``faces``.
    azimuth_deg
        The azimuth of the target.
    """
    figure = Figure(figsize=(WIDTH_IN, 3.6))
    axis = figure.add_axes((0.08, 0.14, 0.78, 0.77))
    for corners in faces.loc[~is_horizontal(faces), "vertices_target_m"]:
        points = np.reshape(corners, (-1, 3))
        axis.plot(points[:, 1], points[:, 0], color=INK, linewidth=1.2)
    for number, track in positions_m.items():
        axis.plot(track[:, 1], track[:, 0], color=SONAR, linewidth=0.9)
        axis.annotate(f"{number}", (track[-1, 1], track[-1, 0]), (4, 0), textcoords="offset points", va="center")
        axis.plot(*track[0, [1, 0]], ".", color=SONAR, markersize=4)
    _point_north(axis, azimuth_deg)
    axis.set(xlabel="y, along the target, m", ylabel="x, into it, m", aspect="equal")
    axis.set_title("tracks of the passes (dot: start) and the target, from above")
    axis.invert_yaxis()  # seen from above with y to the right, x runs down
    axis.margins(0.08)
    return picture(figure, "plan of the passes before the target")


def _point_north(axis: Axes, azimuth_deg: float) -> None:
    """Draw an arrow to north beside the right edge of a plan with y to the right and x down."""
    half = ROSE_PT / 2
    along, up = np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg))  # components of north to right and up
    box = DrawingArea(ROSE_PT, ROSE_PT)
    tail, length = 0.7 * half, 1.1 * half
    shape: dict[str, Any] = {"width": 0.6, "head_width": 5.0, "color": QUIET, "length_includes_head": True}
    box.add_artist(FancyArrow(half - tail * along, half - tail * up, length * along, length * up, **shape))
    place: dict[str, Any] = {"ha": "center", "va": "center"}
    box.add_artist(Text(half + 0.75 * half * along, half + 0.75 * half * up, "N", **place))
    axis.add_artist(
        AnnotationBbox(box, (1.0, 0.5), xycoords=axis.transAxes, box_alignment=(0.0, 0.5), frameon=False, pad=0.0)
    )
