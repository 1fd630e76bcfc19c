"""Pictures of the target: sections to scale, distances in millimetres, maps of the faces, the passes' tracks."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.families import families_of, level_families
from pipeline.maths.residuals import face_axes
from pipeline.maths.targets import LEVEL
from pipeline.pages import COARSE, INK, LASER, QUIET, SONAR, picture
from pipeline.residuals import FEWEST

Array = NDArray[np.float64]
MOST_PANELS = 7  # families in one picture
HALF_SLICE_M = 0.04  # half the thickness of a section
DOTS = 6000  # a cloud in one panel, at most
XYZ = [f"{axis}_target_m" for axis in "xyz"]
SECTIONS = ("sensor", "face", *XYZ, *(f"coarse_{name}" for name in XYZ))  # columns of residuals
DISTANCES = ("sensor", "face", "residual_m", "coarse_residual_m", "z_target_m", "coarse_z_target_m")
Cloud = tuple[str, str, str, str]  # sensor, prefix of the columns, words, colour
CLOUDS: Mapping[str, tuple[Cloud, ...]] = {  # by what is calibrated, in the order in which they are drawn
    "mbes": (
        ("mbes", "coarse_", "sonar, coarse mount", COARSE),
        ("laser", "", "laser", LASER),
        ("mbes", "", "sonar, calibrated", SONAR),
    ),
    "laser": (("laser", "coarse_", "laser, coarse mount", COARSE), ("laser", "", "laser, calibrated", LASER)),
}


def sections(residuals: pd.DataFrame, faces: pd.DataFrame, solved: bool) -> Markup:
    """Target from above and from the boat, to scale, and one wet face near by."""
    figure = Figure(figsize=(7.2, 3.8))
    where = {"left": 0.07, "right": 0.98, "bottom": 0.19, "top": 0.93, "wspace": 0.25}
    above, ahead, near = figure.subplots(1, 3, width_ratios=[1.0, 2.6, 2.6], gridspec_kw=where)
    corners = [np.reshape(one, (-1, 3)) for one in faces["vertices_target_m"]]
    depth = _depth(corners)
    level = faces["normal_z_target_1"].abs().to_numpy() > LEVEL
    cut = np.array([bool(_cut(points, depth)) for points in corners])
    slope = _slopes(faces)
    face = residuals["face"].to_numpy().astype(int)
    calibrated = _calibrated(residuals)
    for sensor, prefix, label, colour in CLOUDS[calibrated][: None if solved else -1]:  # else nothing is calibrated
        of_sensor = (residuals["sensor"] == sensor).to_numpy()
        columns = [prefix + name for name in XYZ]
        cloud = residuals.loc[of_sensor & ~level[face], columns].to_numpy()
        _dots(above, cloud[:, 0], cloud[:, 1], colour, label)
        cloud = residuals.loc[of_sensor & cut[face], columns].to_numpy()
        near_cut = np.abs(cloud[:, 0] - depth) < HALF_SLICE_M
        cloud = cloud[near_cut]
        cloud[:, 1] += slope[face[of_sensor & cut[face]][near_cut]] * (depth - cloud[:, 0])
        _dots(ahead, cloud[:, 1], cloud[:, 2], colour, label)
        _dots(near, cloud[:, 1], cloud[:, 2], colour, label, 2.2)
    for points in corners:
        if np.ptp(points[:, 2]) > 0:
            above.plot(*np.vstack([points, points[:1]]).T[:2], color=INK, linewidth=0.6)
        for one in _cut(points, depth):
            for axis in (ahead, near):
                axis.plot(one[:, 1], one[:, 2], color=INK, linewidth=0.7)
    above.set(title="from above", xlabel="x, m", ylabel="y, along the target, m", aspect="equal")
    ahead.set(title=f"section at x = {100 * depth:.0f} cm", ylabel="z, height, m", aspect="equal")
    near.set(title="one face of it", aspect="equal")
    seen = (residuals["sensor"] == calibrated).to_numpy() & (cut & ~level)[face]
    _near(near, residuals[seen], corners, depth)
    for axis in (ahead, near):
        axis.invert_xaxis()  # seen from the boat, looking along x, y grows to the left
        axis.set_xlabel("y, m")
    _legend(figure, above)
    return picture(figure, "sections through the target with points of laser and sonar, coarse and calibrated")


def _depth(corners: Sequence[Array]) -> float:
    """The x of the plane that cuts most faces: of the patent's target half the depth of its blocks."""
    ends = np.unique(np.concatenate([points[:, 0] for points in corners]))
    middles = (ends[1:] + ends[:-1]) / 2 if len(ends) > 1 else ends
    return float(max(middles, key=lambda x: sum(bool(_cut(points, x)) for points in corners)))


def _slopes(faces: pd.DataFrame) -> Array:
    """dy/dx along each face, so that points near the cutting plane can be moved into it along their faces: of faces at
    45° to it ±1, of level ones, and of those that it does not cut, 0."""
    x, y = (faces[f"normal_{axis}_target_1"].to_numpy() for axis in "xy")
    aslant = np.abs(y) > 0.1
    return np.asarray(np.where(aslant, -x / np.where(aslant, y, 1.0), 0.0))


def _calibrated(residuals: pd.DataFrame) -> str:
    """The sensor of which there are two mounts to show."""
    return "mbes" if (residuals["sensor"] == "mbes").any() else "laser"


def _near(axis: Axes, points: pd.DataFrame, corners: Sequence[Array], depth: float) -> None:
    """Set the panel to the face with the most points."""
    if len(points) >= FEWEST:
        (cut,) = _cut(corners[int(points["face"].mode().iloc[0])], depth)
        low, high = cut[:, 1:].min(axis=0), cut[:, 1:].max(axis=0)
        middle, half = (low + high) / 2, max(high - low) * 1.1
        axis.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
    else:
        for drawn in (*axis.lines, *axis.collections):
            drawn.set_visible(False)
        axis.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
        axis.text(0.5, 0.5, "too few points", transform=axis.transAxes, ha="center", color=QUIET)


def _cut(corners: Array, x: float) -> list[Array]:
    """Where a face's outline crosses the plane of this x: one line (2, 3), or none."""
    closed = np.vstack([corners, corners[:1]])
    found = []
    for one, other in pairwise(closed):
        if (one[0] - x) * (other[0] - x) < 0:
            found.append(one + (other - one) * (x - one[0]) / (other[0] - one[0]))
    return [np.array(found)] if len(found) == 2 else []


def distances(residuals: pd.DataFrame, faces: pd.DataFrame, family: NDArray[Any], solved: bool) -> Markup:
    """Each family's points by their distance from the adjusted surface, in mm; ``family``: of each residual."""
    names, level = families_of(faces)[:MOST_PANELS], level_families(faces)
    clouds = CLOUDS[_calibrated(residuals)][: None if solved else -1]  # without a result nothing is calibrated
    figure = Figure(figsize=(7.2, 3.2))
    where = {"left": 0.07, "right": 0.97, "bottom": 0.23, "top": 0.92, "wspace": 0.16}
    panels = figure.subplots(1, len(names), sharey=True, gridspec_kw=where, squeeze=False)[0]
    for axis, name in zip(panels, names, strict=True):
        largest = 5.0
        for sensor, prefix, label, colour in clouds:
            points = residuals[(residuals["sensor"] == sensor).to_numpy() & (family == name)]
            away = 1000 * points[prefix + "residual_m"].to_numpy()
            _dots(axis, away, points[prefix + "z_target_m"].to_numpy(), colour, label)
            if len(away):
                largest = max(largest, float(np.quantile(np.abs(away), 0.995)))
        axis.axvline(0, color=INK, linewidth=0.6)
        axis.set(title=name if name not in level else f"{name} (height)", xlim=(-1.1 * largest, 1.1 * largest))
        axis.set_xlabel("distance, mm")
    panels[0].set_ylabel("z, height, m")
    _legend(figure, panels[0])
    return picture(figure, "distances of the points from the adjusted surfaces in millimetres, over the height")


def _dots(axis: Axes, x: Any, y: Any, colour: str, label: str, size: float = 1.1) -> None:
    step = max(1, -(-len(x) // DOTS))
    axis.plot(x[::step], y[::step], "o", ms=size, mew=0, color=colour, label=label, rasterized=True)


def _legend(figure: Figure, axis: Axes) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, frameon=False, markerscale=6)


def maps(residual_map: pd.DataFrame, faces: pd.DataFrame, sensor: str) -> Markup:
    """Mean residual over each family of faces as one sees it from the boat; level ones from above."""
    figure = Figure(figsize=(7.2, 2.9))
    where = {"left": 0.07, "right": 0.87, "bottom": 0.15, "top": 0.92, "wspace": 0.25}
    level = level_families(faces)
    order = _from_the_boat(faces)[:MOST_PANELS]
    widths = [_panel_width(faces, name) for name in order]
    panels = figure.subplots(1, len(order), width_ratios=widths, gridspec_kw=where, squeeze=False)[0]
    family = dict(zip(faces["face"], faces["family"], strict=True))
    normal = {
        row["family"]: np.array([row[f"normal_{axis}_target_1"] for axis in "xyz"]) for row in faces.to_dict("records")
    }
    enough = (residual_map["count"] >= FEWEST) & np.isfinite(residual_map["mean_m"])
    cells = residual_map[(residual_map["sensor"] == sensor) & enough]
    of_family = np.array([family[face] for face in cells["face"]], dtype=object)
    span = max(1.0, 1000 * float(np.quantile(np.abs(cells["mean_m"]), 0.95))) if len(cells) else 1.0
    z = cells.loc[[name not in level for name in of_family], "z_target_m"]
    heights = (z.min() - 0.1, z.max() + 0.1) if len(z) else (0.0, 1.0)
    image = None
    for axis, name in zip(panels, order, strict=True):
        inside = cells[of_family == name]
        flat = inside[XYZ].to_numpy(np.float64) @ face_axes(normal[name]).T
        size = float(inside["size_m"].iloc[0]) if len(inside) else 0.1
        image = _grid(axis, flat[:, 0], flat[:, 1], 1000 * inside["mean_m"].to_numpy(), size, span) or image
        axis.set(title=name if name not in level else f"{name}, from above", aspect="equal")
        axis.set_xticks(np.round(axis.get_xlim(), 1))
        axis.set_xlabel("x, m" if name in level else "to the right, m")
        if name not in level:
            axis.set_ylim(*heights)
    panels[0].set_ylabel("z, height, m")
    if image is not None:
        bar = figure.add_axes((0.9, 0.15, 0.015, 0.7))
        figure.colorbar(image, cax=bar, label="mean residual, mm", extend="both")
    return picture(figure, f"maps of the {sensor}'s mean residuals over the faces")


def _from_the_boat(faces: pd.DataFrame) -> list[str]:
    """Families as one sees them, y growing to the left; level ones last."""
    middle = {
        name: np.mean([np.reshape(one, (-1, 3))[:, 1].mean() for one in of_family["vertices_target_m"]])
        for name, of_family in faces.groupby("family", sort=False)
    }
    level = level_families(faces)
    return sorted(families_of(faces), key=lambda name: (name in level, -middle[name]))


def _panel_width(faces: pd.DataFrame, name: str) -> float:
    """Share of the picture, by how wide the family's faces are."""
    outlines = faces.loc[faces["family"] == name, "vertices_target_m"]
    x, y = np.ptp(np.concatenate([np.reshape(one, (-1, 3)) for one in outlines]), axis=0)[:2]
    return float(np.clip((x if name in level_families(faces) else np.hypot(x, y)) / 1.5, 0.8, 2.0))


def _grid(axis: Axes, x: Array, y: Array, values: Array, size: float, span: float) -> Any:
    """Cells with these centres; where several lie over each other (block over block) their mean."""
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


def tracks(positions_m: Mapping[int, Array], faces: pd.DataFrame, azimuth_deg: float) -> Markup:
    """The passes' tracks before the target, north shown; ``positions_m``: of the INS in the target frame, by pass."""
    figure = Figure(figsize=(7.2, 3.6))
    axis = figure.add_axes((0.08, 0.14, 0.78, 0.77))
    for corners in faces.loc[faces["normal_z_target_1"].abs() <= LEVEL, "vertices_target_m"]:
        points = np.reshape(corners, (-1, 3))
        axis.plot(points[:, 1], points[:, 0], color=INK, linewidth=1.2)
    for number, track in positions_m.items():
        axis.plot(track[:, 1], track[:, 0], color=SONAR, linewidth=0.9)
        axis.annotate(f"{number}", (track[-1, 1], track[-1, 0]), (4, 0), textcoords="offset points", va="center")
        axis.plot(*track[0, [1, 0]], ".", color=SONAR, markersize=4)
    rose = figure.add_axes((0.87, 0.4, 0.12, 0.24))
    rose.axis("off")
    rose.set(xlim=(-1.4, 1.4), ylim=(-1.4, 1.4), aspect="equal")
    along, down = np.cos(np.radians(azimuth_deg)), -np.sin(np.radians(azimuth_deg))  # of north, along y and x
    rose.arrow(-along, down, 1.6 * along, -1.6 * down, color=QUIET, width=0.02, head_width=0.25)
    rose.annotate("N", (1.25 * along, -1.25 * down), ha="center", va="center")
    axis.set(xlabel="y, along the target, m", ylabel="x, into it, m", aspect="equal")
    axis.set_title("tracks of the passes (dot: start) and the target, from above")
    axis.invert_yaxis()  # from above, with y to the right x runs down
    axis.margins(0.08)
    return picture(figure, "plan of the passes before the target")
