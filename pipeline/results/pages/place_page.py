"""The page of a found place: a plan of its planes, and each face as the boat sees it, to approve or to strike."""

from math import ceil

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.console import plural
from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.found_text import remarks, serving_first, table_rows
from pipeline.finding.place import FoundFace, FoundPlace
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.results.pages.rendering import INK, LASER, QUIET, WIDTH_IN, drawing_style, picture, render_page

Array = NDArray[np.float64]
OFF_MM = 40.0  # points farther off their plane have the last colour
BEHIND_M = 0.3  # of a face's name behind it, in the plan
COLUMNS = 2  # faces side by side
OFF_COLOURS = LinearSegmentedColormap.from_list("off", ["#0072b2", "#b9bcc1", "#d55e00"])
MOST_FACES = 24  # that are drawn


def place_page(place: FoundPlace, session: str) -> str:
    """Return the page as HTML; ``session``: the session's name."""
    with drawing_style():
        plan = _plan(place)
        faces = _elevations(place) if place.faces else Markup("")
    serve = f"{plural(len(place.faces), 'face')} of {plural(len(place.planes), 'plane')} can serve"
    return render_page(
        "place.html",
        session=session,
        sentences=[f"{serve}.", *remarks(place)],
        plan=plan,
        faces=faces,
        gaps=any(len(face.gaps_m) for face in place.faces),
        first=place.faces[0].name if place.faces else "",
        rows=table_rows(place),
    )


def _plan(place: FoundPlace) -> Markup:
    """Draw the planes and the boat's track from above."""
    figure = Figure(figsize=(WIDTH_IN, 4.6))
    axes = figure.subplots(gridspec_kw={"left": 0.08, "right": 0.98, "bottom": 0.1, "top": 0.97})
    track = place.track_m - place.boat_m
    axes.plot(*track.T, color=LASER, linewidth=0.8, label="the boat's track")
    names = {id(face.plane): face.name for face in place.faces}
    for plane in reversed(serving_first(place)):
        if not len(plane.outline_m) or plane.level:
            continue
        corners = plane.corners_m(plane.outline_m)[:, :2] - place.boat_m
        name = names.get(id(plane), "")
        colour, width = (INK, 2.2) if name else (QUIET, 0.8)
        axes.plot(*np.vstack([corners, corners[:1]]).T, color=colour, linewidth=width)
        if name:
            toward = plane.normal[:2]
            east, north = plane.corners_m(plane.middle_m[None])[0, :2] - place.boat_m - BEHIND_M * toward
            beside = "right" if toward[0] > 0 else "left"  # behind the face, away from the boat
            axes.annotate(f" {name} ", (east, north), ha=beside, va="center", color=INK)
    axes.set(xlabel="east, m", ylabel="north, m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False, loc="best")
    return picture(figure, "plan of the planes and of the boat's track, north up")


def _elevations(place: FoundPlace) -> Markup:
    """Draw each face from the front, with the laser's points on it."""
    faces = place.faces[:MOST_FACES]
    lines = ceil(len(faces) / COLUMNS)
    figure = Figure(figsize=(WIDTH_IN, 0.6 + 2.5 * lines))
    where = {"left": 0.08, "right": 0.87, "bottom": 0.55 / (0.6 + 2.5 * lines), "top": 1 - 0.3 / (0.6 + 2.5 * lines)}
    grid = figure.subplots(lines, COLUMNS, squeeze=False, gridspec_kw=where | {"hspace": 0.45, "wspace": 0.2})
    dots = None
    for axes, face in zip(grid.flat, faces, strict=False):
        dots = _elevation(axes, face, place)
    for axes in list(grid.flat)[len(faces) :]:
        axes.set_visible(False)
    if dots is not None:
        beside = figure.add_axes((0.9, 0.3, 0.02, 0.5))
        figure.colorbar(dots, cax=beside, label="off the plane, toward the boat, mm")
    return picture(figure, "each face from the front, with the laser's points, coloured by their distance from it")


def _elevation(axes: Axes, face: FoundFace, place: FoundPlace) -> PathCollection:
    """Draw one face; return its dots, for the colours."""
    plane = face.plane
    along, height, off = plane.sample_m.T
    middle = float(face.continued_m[:, 0].min() + face.continued_m[:, 0].max()) / 2  # that of masks
    dots = axes.scatter(
        along - middle, height - place.level_m, c=1000 * off, s=1.2, linewidths=0, rasterized=True,
        cmap=OFF_COLOURS, vmin=-OFF_MM, vmax=OFF_MM,
    )  # fmt: skip
    whole = _by_height(plane, face.continued_m, place.level_m, middle)
    axes.plot(*np.vstack([whole, whole[:1]]).T, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    dry = _by_height(plane, plane.outline_m, place.level_m, middle)
    axes.plot(*np.vstack([dry, dry[:1]]).T, color=INK, linewidth=1.0)
    ends = [whole[:, 0].min(), whole[:, 0].max()]
    for gaps, shade in ((face.gaps_m, 0.3), (face.below_m, 0.15)):
        for low, high in gaps:
            axes.fill_between(ends, low, high, color=QUIET, alpha=shade, linewidth=0)
    axes.axhline(0.0, color=LASER, linewidth=0.8)
    axes.set(title=face.name, xlabel="along, m", ylabel="above the water, m")
    axes.set_aspect("equal", adjustable="datalim")
    return dots


def _by_height(plane: DryPlane, outline_m: Array, level_m: float, middle_m: float) -> Array:
    """Return an outline (k, 2) of a plane as places along it and heights above the water."""
    heights = (outline_m @ plane_axes(plane.normal) + plane.distance_m * plane.normal)[:, 2]
    return np.column_stack([outline_m[:, 0] - middle_m, heights - level_m])
