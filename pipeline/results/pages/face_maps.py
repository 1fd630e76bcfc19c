"""Maps of the mean residuals over the faces."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.from_tables import family_names, normal_of
from pipeline.maths.geometry.face_grid import face_axes, lies_flat
from pipeline.maths.target.bottom_names import PIECES, shown_name
from pipeline.results.pages.families import shown_names
from pipeline.results.pages.rendering import QUIET, WIDTH_IN, picture
from pipeline.results.pages.target_plots import MOST_PANELS, XYZ

Array = NDArray[np.float64]
LEFT_IN, RIGHT_IN, BOTTOM_IN, HIGHEST_IN = 0.65, 0.95, 0.45, 2.2  # margins and the tallest panel
GAP_IN, TICKS_IN, TITLE_IN = 0.26, 0.5, 0.3  # between panels; before one with numbers of its own; above
NARROWEST_IN, LOWEST_IN, FLAT_IN = 0.6, 1.1, 1.0  # panels: narrowest, lowest, width of one from above
MERGED = (1, 2, 4)  # cells along the side of a square
UNSEEN = "#d5d8dc"
MOST_HEARD = 0.5  # least share of each family's points in squares with enough of them


def residual_maps(residual_map: pd.DataFrame, faces: pd.DataFrame, sensor: str) -> Markup:
    """Draw the mean residuals over each family of faces, seen from the boat; faces that lie flat from above.

    Parameters
    ----------
    residual_map
        The artefact ``residual_map``.
    faces
        The artefact ``faces``.
    sensor
        ``laser`` or ``mbes``.
    """
    every = _from_the_boat(faces)
    order = families_of_maps(residual_map, faces, sensor)[0] or list(every)[:MOST_PANELS]
    cells = _placed(residual_map[residual_map["sensor"] == sensor], faces)
    squares = _squares(cells[cells["family"].isin(order)])
    figure, panels = _panels(order, every, squares)
    span = max(1.0, float(np.quantile(np.abs(squares["mean_mm"]), 0.95))) if len(squares) else 1.0
    image = None
    upright = [name for name in order if not every[name]]
    for name, axis in panels.items():
        inside = squares[squares["family"] == name]
        image = _draw(axis, inside, span) or image
        axis.set_title(name)
        if every[name]:
            axis.set_aspect("equal", adjustable="box", anchor="SW")
            axis.set(xlabel="x, m (from above)", ylabel="y, m")
        elif name == upright[0]:
            axis.set_ylabel("z, height, m")
        else:
            axis.tick_params(labelleft=False)
        if upright and name == upright[len(upright) // 2]:
            axis.set_xlabel("to the right, m")
        _few_ticks(axis, figure)
    if image is not None:
        bar = figure.add_axes((1 - 0.72 / WIDTH_IN, 0.2, 0.015, 0.65))
        figure.colorbar(image, cax=bar, label="mean residual, mm", extend="both")
    return picture(figure, f"maps of the {'sonar' if sensor == 'mbes' else 'laser'}'s mean residuals over the faces")


def families_of_maps(residual_map: pd.DataFrame, faces: pd.DataFrame, sensor: str) -> tuple[list[str], int]:
    """Return the families of the map of a sensor, from left to right, and the number of those left out.

    Where there are too many, walls and slopes that both sensors see come first, and flat faces last.
    """
    every = _from_the_boat(faces)
    family = faces["family"].map(shown_name).to_numpy()
    seen = {}
    for name in residual_map["sensor"].unique():
        rows = residual_map[(residual_map["sensor"] == name) & np.isfinite(residual_map["mean_m"])]
        counts = rows["count"].groupby(family[rows["face"].to_numpy().astype(int)]).sum()
        seen[name] = set(counts.index[counts >= FEWEST])
    by_both = set.intersection(*(names for names in seen.values() if names)) if any(seen.values()) else set()
    shown = [name for name in every if name in seen.get(sensor, ())]
    chosen = sorted(shown, key=lambda name: (every[name], name not in by_both))[:MOST_PANELS]
    return [name for name in shown if name in chosen], len(shown) - len(chosen)


def _from_the_boat(faces: pd.DataFrame) -> dict[str, bool]:
    """Return for each family whether it is drawn from above: from left to right as seen from the boat, those last."""
    shown = faces["family"].map(shown_name)
    middle, flat = {}, {}
    for name, of_family in faces.groupby(shown, sort=False):
        along = [np.reshape(corners, (-1, 3))[:, 1].mean() for corners in of_family["vertices_target_m"]]
        middle[name] = float(np.mean(along))
        flat[name] = name == PIECES or all(lies_flat(normal_of(row)) for row in of_family.to_dict("records"))
    names = sorted(shown_names(family_names(faces)), key=lambda name: (flat[name], -middle[name]))
    return {name: flat[name] for name in names}


def _placed(cells: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """Return the cells with a mean: family, right, up, wide, high (m), count, mean_m.

    ``right`` and ``up`` are as seen from the boat or from above. Seen from the boat, ``up`` is the height, so that the
    cells of a slope are lower than they are wide.
    """
    tables, every = [], _from_the_boat(faces)
    normals = {int(row["face"]): normal_of(row) for row in faces.to_dict("records")}
    family = dict(zip(faces["face"], faces["family"].map(shown_name), strict=True))
    for face, rows in cells[np.isfinite(cells["mean_m"])].groupby("face", sort=True):
        name, normal = family[face], normals[int(str(face))]
        points, size = rows[XYZ].to_numpy(np.float64), rows["size_m"].to_numpy(np.float64)
        right = points[:, 0] if every[name] else points @ face_axes(normal)[0]
        up, high = (points[:, 1], size) if every[name] else (points[:, 2], size * np.hypot(normal[0], normal[1]))
        values = {"family": name, "right": right, "up": up, "wide": size, "high": high}
        tables.append(pd.DataFrame(values | {key: rows[key].to_numpy() for key in ("count", "mean_m")}))
    names = ["family", "right", "up", "wide", "high", "count", "mean_m"]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=names)


def _squares(cells: pd.DataFrame) -> pd.DataFrame:
    """Return the means (mm) of squares of cells with enough points: family, column, row, right, up, wide, high.

    A square has as few cells as will do for half of each family's points; cells at one place (the tops of blocks) are
    one. ``right`` and ``up`` are the place of the square's middle.
    """
    if not len(cells):
        return cells.assign(column=0, row=0, mean_mm=0.0)
    start = cells.groupby("family")[["right", "up", "wide", "high"]].transform("min")
    column = np.rint((cells["right"] - start["right"]) / start["wide"]).astype(int)
    row = np.rint((cells["up"] - start["up"]) / start["high"]).astype(int)
    for many in MERGED:
        keyed = start.assign(family=cells["family"], column=column // many, row=row // many, count=cells["count"])
        keyed["total_mm"] = 1000 * cells["mean_m"] * cells["count"]
        sums = keyed.groupby(["family", "column", "row"], as_index=False, sort=True).agg(
            {"right": "min", "up": "min", "wide": "min", "high": "min", "count": "sum", "total_mm": "sum"}
        )
        enough = sums["count"] >= FEWEST
        shares = sums["count"].where(enough, 0).groupby(sums["family"]).sum() / sums.groupby("family")["count"].sum()
        if shares.min() >= MOST_HEARD:
            break
    squares = sums[enough].assign(mean_mm=sums["total_mm"] / sums["count"])
    for at, number, side in (("right", "column", "wide"), ("up", "row", "high")):
        squares[at] += squares[side] * (many * squares[number] + (many - 1) / 2)
        squares[side] *= many
    return squares


def _ends(squares: pd.DataFrame, at: str, margin: float) -> tuple[float, float]:
    """Return the limits of an axis (``right`` or ``up``) round these squares, m; 0 and 1 without any."""
    if not len(squares):
        return 0.0, 1.0
    half = squares["wide" if at == "right" else "high"] / 2
    return float((squares[at] - half).min() - margin), float((squares[at] + half).max() + margin)


def _panels(order: Sequence[str], flat: Mapping[str, bool], squares: pd.DataFrame) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure with a panel for each family: upright ones at one scale with one axis of heights, then flat ones.

    What would be too low at this scale is drawn higher; what would be too narrow gets room beside it.
    """
    own = {name: squares[squares["family"] == name] for name in order}
    ends = {name: _ends(own[name], "right", 0.05) for name in order}
    upright = [name for name in order if not flat[name]]
    heights = _ends(squares[squares["family"].isin(upright)], "up", 0.1)
    gaps = sum(TICKS_IN if flat[name] else GAP_IN for name in order[1:])
    room = WIDTH_IN - LEFT_IN - RIGHT_IN - gaps - FLAT_IN * (len(order) - len(upright))
    narrowest = min(NARROWEST_IN, 0.8 * room / max(1, len(upright)))
    widths = np.array([ends[name][1] - ends[name][0] for name in upright])
    scale = HIGHEST_IN / (heights[1] - heights[0])  # inches for a metre
    while np.maximum(scale * widths, narrowest).sum() > room:
        scale *= 0.98
    height = float(np.clip(scale * (heights[1] - heights[0]), LOWEST_IN, HIGHEST_IN))
    tallest = height if len(upright) == len(order) else HIGHEST_IN
    high = BOTTOM_IN + tallest + TITLE_IN
    figure = Figure(figsize=(WIDTH_IN, high))
    panels: dict[str, Axes] = {}
    left = LEFT_IN
    for name in order:
        left += 0.0 if not panels else TICKS_IN if flat[name] else GAP_IN
        low, most = ends[name]
        width = FLAT_IN if flat[name] else max(scale * (most - low), narrowest)
        place = left / WIDTH_IN, BOTTOM_IN / high, width / WIDTH_IN, (tallest if flat[name] else height) / high
        panels[name] = figure.add_axes(place)
        beside = 0.0 if flat[name] else (width / scale - (most - low)) / 2
        up = _ends(own[name], "up", 0.05) if flat[name] else heights
        panels[name].set(xlim=(low - beside, most + beside), ylim=up)
        left += width
    return figure, panels


def _draw(axis: Axes, squares: pd.DataFrame, span: float) -> Any:
    """Draw the squares of a family in colour; return the image, None without squares."""
    if not len(squares):
        axis.text(0.5, 0.5, "no points", transform=axis.transAxes, ha="center", color=QUIET)
        return None
    column, row = (squares[name].to_numpy() - squares[name].min() for name in ("column", "row"))
    mean = np.full((row.max() + 1, column.max() + 1), np.nan)
    mean[row, column] = squares["mean_mm"]
    edges = (*_ends(squares, "right", 0.0), *_ends(squares, "up", 0.0))
    limits = axis.get_xlim(), axis.get_ylim()
    axis.set_facecolor(UNSEEN)  # white is a residual of zero
    image = axis.imshow(
        mean, origin="lower", extent=edges, cmap="RdBu_r", vmin=-span, vmax=span, interpolation="none", aspect="auto"
    )
    axis.set(xlim=limits[0], ylim=limits[1])
    return image


def _few_ticks(axis: Axes, figure: Figure) -> None:
    """Set the ticks of a panel: no more than there is room for their numbers."""
    axis.apply_aspect()
    box = axis.get_position()
    rooms = np.array([box.width, box.height]) * figure.get_size_inches()
    for ticks, room, needed in zip((axis.xaxis, axis.yaxis), rooms, (0.5, 0.25), strict=True):
        number = int(room / needed)
        middle = round(float(np.mean(ticks.get_view_interval())), 1)
        few = MaxNLocator(min(number, 6), steps=[1, 2, 5, 10], min_n_ticks=1) if number else FixedLocator([middle])
        ticks.set_major_locator(few)
