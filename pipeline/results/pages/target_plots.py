"""Plots of the points on the target: sections to scale, distances in millimetres."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.from_tables import family_names, horizontal_families, is_horizontal, normals_of
from pipeline.maths.target.bottom_names import PIECES, shown_name
from pipeline.results.pages.cutting_plane import (
    HALF_SLICE_M,
    CuttingPlane,
    cut_line,
    plane_by_points,
    plane_through,
    slopes_in,
)
from pipeline.results.pages.rendering import COARSE, INK, LASER, SONAR, WIDTH_IN, picture

Array = NDArray[np.float64]
MOST_PANELS = 7  # most families in one picture
ASIDE_M = 0.3  # a point farther than this from a face belongs to another face
DOTS = 6000  # most points of a cloud in one panel
XYZ = [f"{axis}_target_m" for axis in "xyz"]
SECTIONS = ("sensor", "face", *XYZ, *(f"coarse_{name}" for name in XYZ))  # columns of table residuals
DISTANCES = ("sensor", "face", "residual_m", "coarse_residual_m", "z_target_m", "coarse_z_target_m")
Cloud = tuple[str, str, str, str]  # sensor, prefix of the columns, words, colour
CLOUDS: Mapping[str, tuple[Cloud, ...]] = {  # by the calibrated sensor, in the order of drawing
    "mbes": (
        ("mbes", "coarse_", "sonar, coarse mount", COARSE),
        ("laser", "", "laser", LASER),
        ("mbes", "", "sonar, calibrated", SONAR),
    ),
    "laser": (("laser", "coarse_", "laser, coarse mount", COARSE), ("laser", "", "laser, calibrated", LASER)),
}


def target_sections(residuals: pd.DataFrame, faces: pd.DataFrame, solved: bool, letters: bool) -> Markup:
    """Draw the target from above, a section through it to scale, and an enlarged part of the section.

    If no vertical plane cuts a face with points, only the view from above is drawn.

    Parameters
    ----------
    residuals
        The artefact ``residuals`` with the columns :data:`SECTIONS`.
    faces
        The artefact ``faces``.
    solved
        Whether the adjustment has a result to show.
    letters
        Whether the target is the patent's, whose shape tells where to cut it; else the points do.
    """
    corners = [np.reshape(outline, (-1, 3)) for outline in faces["vertices_target_m"]]
    level = is_horizontal(faces)
    from_above = ~level | (faces["family"].map(shown_name) == PIECES).to_numpy()
    face = residuals["face"].to_numpy().astype(int)
    calibrated = _calibrated(residuals)
    of_sensor = {sensor: (residuals["sensor"] == sensor).to_numpy() for sensor in ("laser", "mbes")}
    plane = _plane(residuals, faces, of_sensor, calibrated, letters)
    cut = np.array([plane is not None and bool(cut_line(points, plane)) for points in corners])
    slope = np.zeros(len(faces)) if plane is None else slopes_in(faces, plane)
    figure = Figure(figsize=(WIDTH_IN, 3.8))
    where = {"left": 0.08 if letters else 0.105, "right": 0.98, "bottom": 0.19, "top": 0.93, "wspace": 0.3}
    widths = [1.0, 2.6, 2.6] if plane is not None else [1.0]
    above, *others = figure.subplots(1, len(widths), width_ratios=widths, gridspec_kw=where, squeeze=False)[0]
    nearest: list[Array] = []
    for sensor, prefix, label, colour in CLOUDS[calibrated][: None if solved else -1]:  # the last is the calibrated one
        columns = [prefix + name for name in XYZ]
        cloud = residuals.loc[of_sensor[sensor] & from_above[face], columns].to_numpy()
        _dots(above, cloud[:, :2], colour, label)
        if plane is None:
            continue
        chosen = of_sensor[sensor] & cut[face]
        cloud = residuals.loc[chosen, columns].to_numpy()
        inside = np.abs(cloud[:, plane.axis] - plane.at) < HALF_SLICE_M
        on_face, cloud = face[chosen][inside], cloud[inside]
        cloud[:, plane.along] += slope[on_face] * (plane.at - cloud[:, plane.axis])
        for axis, size in zip(others, (1.1, 2.2), strict=True):
            _dots(axis, cloud[:, [plane.along, 2]], colour, label, size)
        nearest.append(cloud[~level[on_face]][:, [plane.along, 2]])
    for points in corners:
        if np.ptp(points[:, 2]) > 0:
            above.plot(*np.vstack([points, points[:1]]).T[:2], color=INK, linewidth=0.6)
        for line in cut_line(points, plane) if plane is not None else []:
            for axis in others:
                axis.plot(line[:, 1 - plane.axis if plane else 0], line[:, 2], color=INK, linewidth=0.7)
    above.set(title="from above", xlabel="x, m", ylabel="y, along the target, m")
    above.set_aspect("equal", adjustable="datalim")  # a plain wall has no depth, but its panel must have a width
    if plane is not None:
        _section(others, plane, corners, residuals[of_sensor[calibrated] & (cut & ~level)[face]], nearest)
    for axis in (above, *others):
        axis.xaxis.set_major_locator(MaxNLocator(3 if axis is above else 6))
    _legend(figure, above)
    return picture(figure, "sections through the target with points of laser and sonar, coarse and calibrated")


def _plane(
    residuals: pd.DataFrame,
    faces: pd.DataFrame,
    of_sensor: Mapping[str, NDArray[np.bool_]],
    calibrated: str,
    letters: bool,
) -> CuttingPlane | None:
    """Return the plane of the section: of the patent's target by its faces, of others by the points of both sensors."""
    corners = [np.reshape(outline, (-1, 3)) for outline in faces["vertices_target_m"]]
    level, face = is_horizontal(faces), residuals["face"].to_numpy().astype(int)
    if letters:
        seen = np.bincount(face[of_sensor[calibrated]], minlength=len(faces)) >= FEWEST
        return plane_through(corners, ~level & seen)
    use = {name: mask & ~level[face] for name, mask in of_sensor.items()}
    of_face = {name: face[mask] for name, mask in use.items() if mask.any()}
    if calibrated not in of_face:
        return None
    points_m = {name: residuals.loc[use[name], XYZ].to_numpy(np.float64) for name in of_face}
    return plane_by_points(corners, normals_of(faces), points_m, of_face)


def _section(
    axes: Sequence[Axes], plane: CuttingPlane, corners: Sequence[Array], seen: pd.DataFrame, drawn: Sequence[Array]
) -> None:
    """Draw the panel of the section, and the panel that enlarges a part of it: one face, or the thickness of a wall."""
    whole, near = axes
    whole.set(title=f"section at {plane}", ylabel="z, height, m")
    whole.set_aspect("equal", adjustable="datalim")
    for axis in axes:
        axis.set_xlabel(f"{'xy'[plane.along]}, m")
    if len(seen) < FEWEST:
        near.remove()
    elif plane.axis == 0:
        _near(near, seen, corners, plane)
        for axis in axes:
            axis.invert_xaxis()  # seen from the boat, looking along x, y grows to the left
    else:
        _across(near, seen, corners, plane, drawn)


def _calibrated(residuals: pd.DataFrame) -> str:
    """Return the sensor whose coarse and calibrated mounts are shown."""
    return "mbes" if (residuals["sensor"] == "mbes").any() else "laser"


def _near(axis: Axes, points: pd.DataFrame, corners: Sequence[Array], plane: CuttingPlane) -> None:
    """Set the limits of the panel to the face with the most points."""
    (cut,) = cut_line(corners[int(points["face"].mode().iloc[0])], plane)
    ends = cut[:, [plane.along, 2]]
    low, high = ends.min(axis=0), ends.max(axis=0)
    middle, half = (low + high) / 2, max(high - low) * 1.1
    axis.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
    axis.set_title("one face of it")


def _across(
    axis: Axes, points: pd.DataFrame, corners: Sequence[Array], plane: CuttingPlane, drawn: Sequence[Array]
) -> None:
    """Set the panel to the whole height of the tallest face with points; its thickness is stretched to fit them."""
    there = [cut_line(corners[number], plane)[0][:, [plane.along, 2]] for number in points["face"].astype(int).unique()]
    ends = max(there, key=lambda cut: float(np.ptp(cut[:, 1])))
    slant = np.ptp(ends[:, 0]) / 2
    middle = float(ends[:, 0].mean())
    cloud = np.concatenate(drawn)
    away = np.abs(cloud[:, 0] - middle)
    beside = away[away < slant + ASIDE_M]
    half = max(0.05, 1.2 * float(np.quantile(beside, 0.98))) if len(beside) else 0.05
    axis.set(xlim=(middle - half, middle + half), ylim=(ends[:, 1].min() - 0.2, ends[:, 1].max() + 0.2))
    axis.set_title(f"{'xy'[plane.along]} stretched")


def distance_charts(residuals: pd.DataFrame, faces: pd.DataFrame, family: NDArray[Any], solved: bool) -> Markup:
    """Draw each family's points by their distance from the adjusted surface, in mm, over the height.

    Parameters
    ----------
    residuals
        The artefact ``residuals`` with the columns :data:`DISTANCES`.
    faces
        The artefact ``faces``.
    family
        The family of each residual's face, (n,).
    solved
        Whether the adjustment has a result to show.
    """
    by_laser = (residuals["sensor"] == "laser").to_numpy()
    both = by_laser if by_laser.any() else np.ones(len(by_laser), dtype=bool)  # what goes on from one to the other
    names = [name for name in family_names(faces) if ((family == name) & both).any()][:MOST_PANELS]
    level = horizontal_families(faces)
    names = names or family_names(faces)[:1]
    clouds = CLOUDS[_calibrated(residuals)][: None if solved else -1]  # the last is the calibrated one
    figure = Figure(figsize=(WIDTH_IN, 3.2))
    where = {"left": 0.07, "right": 0.97, "bottom": 0.23, "top": 0.92, "wspace": 0.16}
    panels = figure.subplots(1, len(names), sharey=True, gridspec_kw=where, squeeze=False)[0]
    for axis, name in zip(panels, names, strict=True):
        largest = 5.0
        for sensor, prefix, label, colour in clouds:
            points = residuals[(residuals["sensor"] == sensor).to_numpy() & (family == name)]
            away = 1000 * points[prefix + "residual_m"].to_numpy()
            _dots(axis, np.column_stack([away, points[prefix + "z_target_m"].to_numpy()]), colour, label)
            if len(away):
                largest = max(largest, float(np.quantile(np.abs(away), 0.995)))
        axis.axvline(0, color=INK, linewidth=0.6)
        axis.set(title=name if name not in level else f"{name} (height)", xlim=(-1.1 * largest, 1.1 * largest))
        axis.set_xlabel("distance, mm")
    panels[0].set_ylabel("z, height, m")
    _legend(figure, panels[0])
    return picture(figure, "distances of the points from the adjusted surfaces in millimetres, over the height")


def _dots(axis: Axes, points: Array, colour: str, label: str, size: float = 1.1) -> None:
    step = max(1, -(-len(points) // DOTS))
    axis.plot(points[::step, 0], points[::step, 1], "o", ms=size, mew=0, color=colour, label=label, rasterized=True)


def _legend(figure: Figure, axis: Axes) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, frameon=False, markerscale=6)
