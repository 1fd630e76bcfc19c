"""Maps of the mean residuals over the faces, and a plan of the passes' tracks before the target."""

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
from matplotlib.ticker import FixedLocator, MaxNLocator
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.from_tables import family_names, horizontal_families, is_horizontal, normal_of
from pipeline.maths.geometry.face_grid import face_axes
from pipeline.results.pages.rendering import INK, QUIET, SONAR, WIDTH_IN, picture
from pipeline.results.pages.target_plots import MOST_PANELS, XYZ

Array = NDArray[np.float64]
MAP_HEIGHT_IN = 2.9
ROSE_PT = 56.0  # size of the arrow to north with its letter


def residual_maps(residual_map: pd.DataFrame, faces: pd.DataFrame, sensor: str) -> Markup:
    """Draw the mean residuals over each family of faces, seen from the boat; horizontal faces from above.

    Parameters
    ----------
    residual_map
        The artefact ``residual_map``.
    faces
        The artefact ``faces``.
    sensor
        ``laser`` or ``mbes``.
    """
    figure = Figure(figsize=(WIDTH_IN, MAP_HEIGHT_IN))
    where = {"left": 0.07, "right": 0.87, "bottom": 0.15, "top": 0.92, "wspace": 0.25}
    level = horizontal_families(faces)
    family = dict(zip(faces["face"], faces["family"], strict=True))
    normal = {row["family"]: normal_of(row) for row in faces.to_dict("records")}
    enough = (residual_map["count"] >= FEWEST) & np.isfinite(residual_map["mean_m"])
    cells = residual_map[(residual_map["sensor"] == sensor) & enough]
    of_family = np.array([family[face] for face in cells["face"]], dtype=object)
    every = _from_the_boat(faces)
    order = ([name for name in every if name in set(of_family)] or every)[:MOST_PANELS]
    widths = [_panel_width(faces, name) for name in order]
    panels = figure.subplots(1, len(order), width_ratios=widths, gridspec_kw=where, squeeze=False)[0]
    span = max(1.0, 1000 * float(np.quantile(np.abs(cells["mean_m"]), 0.95))) if len(cells) else 1.0
    z = cells.loc[[name not in level for name in of_family], "z_target_m"]
    heights = (z.min() - 0.1, z.max() + 0.1) if len(z) else (0.0, 1.0)
    image = None
    for axis, name in zip(panels, order, strict=True):
        inside = cells[of_family == name]
        flat = inside[XYZ].to_numpy(np.float64) @ face_axes(normal[name]).T
        size = float(inside["size_m"].iloc[0]) if len(inside) else 0.1
        image = _grid(axis, flat, 1000 * inside["mean_m"].to_numpy(), size, span) or image
        axis.set(title=name, aspect="equal")
        axis.set_xlabel("x, m (from above)" if name in level else "to the right, m")
        if name not in level:
            axis.set_ylim(*heights)
        _few_ticks(axis)
    panels[0].set_ylabel("z, height, m")
    if image is not None:
        bar = figure.add_axes((0.9, 0.15, 0.015, 0.7))
        figure.colorbar(image, cax=bar, label="mean residual, mm", extend="both")
    return picture(figure, f"maps of the {'sonar' if sensor == 'mbes' else 'laser'}'s mean residuals over the faces")


def _few_ticks(axis: Axes) -> None:
    """Set the ticks of a panel that is drawn to scale: no more than there is room for their numbers."""
    spans = [abs(high - low) for low, high in (axis.get_xlim(), axis.get_ylim())]
    box = axis.get_position(original=True)
    room = box.width * WIDTH_IN, box.height * MAP_HEIGHT_IN
    scale = min(inches / span for inches, span in zip(room, spans, strict=True))
    for ticks, span, needed in zip((axis.xaxis, axis.yaxis), spans, (0.5, 0.25), strict=True):
        number = int(span * scale / needed)
        middle = round(float(np.mean(ticks.get_view_interval())), 1)
        ticks.set_major_locator(MaxNLocator(min(number, 6)) if number else FixedLocator([middle]))


def _from_the_boat(faces: pd.DataFrame) -> list[str]:
    """Return the families from left to right as seen from the boat (decreasing y), and the horizontal ones last."""
    middle = {
        name: np.mean([np.reshape(corners, (-1, 3))[:, 1].mean() for corners in of_family["vertices_target_m"]])
        for name, of_family in faces.groupby("family", sort=False)
    }
    level = horizontal_families(faces)
    return sorted(family_names(faces), key=lambda name: (name in level, -middle[name]))


def _panel_width(faces: pd.DataFrame, name: str) -> float:
    """Return a panel's relative width, which follows from the width of the family's faces."""
    outlines = faces.loc[faces["family"] == name, "vertices_target_m"]
    x, y = np.ptp(np.concatenate([np.reshape(outline, (-1, 3)) for outline in outlines]), axis=0)[:2]
    return float(np.clip((x if name in horizontal_families(faces) else np.hypot(x, y)) / 1.5, 0.8, 2.0))


def _grid(axis: Axes, centres: Array, values: Array, size: float, span: float) -> Any:
    """Draw a square at each centre; for several squares at one place (horizontal faces of blocks), draw their mean."""
    x, y = centres[:, 0], centres[:, 1]
    if not len(x):
        axis.text(0.5, 0.5, "no points", transform=axis.transAxes, ha="center", color=QUIET)
        return None
    column, row = (np.round((at - at.min()) / size).astype(int) for at in (x, y))
    total, count = (np.zeros((row.max() + 1, column.max() + 1)) for _ in range(2))
    np.add.at(total, (row, column), values)
    np.add.at(count, (row, column), 1)
    with np.errstate(invalid="ignore"):
        mean = total / count
    edges = (x.min() - size / 2, x.max() + size / 2, y.min() - size / 2, y.max() + size / 2)
    return axis.imshow(mean, origin="lower", extent=edges, cmap="RdBu_r", vmin=-span, vmax=span, interpolation="none")


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
