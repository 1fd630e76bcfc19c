"""Pictures of the target's points: sections to scale, distances in millimetres."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.from_tables import family_names, horizontal_families, is_horizontal
from pipeline.results.pages.rendering import COARSE, INK, LASER, SONAR, WIDTH_IN, picture

Array = NDArray[np.float64]
MOST_PANELS = 7  # families in one picture
HALF_SLICE_M = 0.04  # half the thickness of a section
ASIDE_M = 0.3  # a point so far from a face is another's
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


@dataclass(frozen=True)
class _Plane:
    """A vertical cutting plane: where this coordinate (0: x, 1: y) is ``at``; ``along`` is the other one."""

    axis: int
    at: float

    @property
    def along(self) -> int:
        return 1 - self.axis

    def __str__(self) -> str:
        return f"{'xy'[self.axis]} = {self.at:.2f} m"


def sections(residuals: pd.DataFrame, faces: pd.DataFrame, solved: bool) -> Markup:
    """Target from above, a section through it, to scale, and a part of that enlarged; without panels that are empty."""
    corners = [np.reshape(one, (-1, 3)) for one in faces["vertices_target_m"]]
    level = is_horizontal(faces)
    face = residuals["face"].to_numpy().astype(int)
    calibrated = _calibrated(residuals)
    of_sensor = {sensor: (residuals["sensor"] == sensor).to_numpy() for sensor in ("laser", "mbes")}
    seen = np.bincount(face[of_sensor[calibrated]], minlength=len(faces)) >= FEWEST
    plane = _plane(corners, ~level & seen)
    cut = np.array([plane is not None and bool(_cut(points, plane)) for points in corners])
    slope = np.zeros(len(faces)) if plane is None else _slopes(faces, plane)
    figure = Figure(figsize=(WIDTH_IN, 3.8))
    where = {"left": 0.08, "right": 0.98, "bottom": 0.19, "top": 0.93, "wspace": 0.3}
    widths = [1.0, 2.6, 2.6] if plane is not None else [1.0]
    above, *others = figure.subplots(1, len(widths), width_ratios=widths, gridspec_kw=where, squeeze=False)[0]
    nearest: list[Array] = []
    for sensor, prefix, label, colour in CLOUDS[calibrated][: None if solved else -1]:  # else nothing is calibrated
        columns = [prefix + name for name in XYZ]
        cloud = residuals.loc[of_sensor[sensor] & ~level[face], columns].to_numpy()
        _dots(above, cloud[:, 0], cloud[:, 1], colour, label)
        if plane is None:
            continue
        chosen = of_sensor[sensor] & cut[face]
        cloud = residuals.loc[chosen, columns].to_numpy()
        inside = np.abs(cloud[:, plane.axis] - plane.at) < HALF_SLICE_M
        on_face, cloud = face[chosen][inside], cloud[inside]
        cloud[:, plane.along] += slope[on_face] * (plane.at - cloud[:, plane.axis])
        for axis, size in zip(others, (1.1, 2.2), strict=True):
            _dots(axis, cloud[:, plane.along], cloud[:, 2], colour, label, size)
        nearest.append(cloud[~level[on_face]][:, [plane.along, 2]])
    for points in corners:
        if np.ptp(points[:, 2]) > 0:
            above.plot(*np.vstack([points, points[:1]]).T[:2], color=INK, linewidth=0.6)
        for one in _cut(points, plane) if plane is not None else []:
            for axis in others:
                axis.plot(one[:, 1 - plane.axis if plane else 0], one[:, 2], color=INK, linewidth=0.7)
    above.set(title="from above", xlabel="x, m", ylabel="y, along the target, m")
    above.set_aspect("equal", adjustable="datalim")  # a plain wall has no depth: its panel has
    if plane is not None:
        _section(others, plane, corners, residuals[of_sensor[calibrated] & (cut & ~level)[face]], nearest)
    for axis in (above, *others):
        axis.xaxis.set_major_locator(MaxNLocator(3 if axis is above else 6))
    _legend(figure, above)
    return picture(figure, "sections through the target with points of laser and sonar, coarse and calibrated")


def _section(
    axes: Sequence[Axes], plane: _Plane, corners: Sequence[Array], seen: pd.DataFrame, drawn: Sequence[Array]
) -> None:
    """The section's own panel, and the one that enlarges: one face of it, or of a wall cut across its thickness."""
    ahead, near = axes
    ahead.set(title=f"section at {plane}", ylabel="z, height, m")
    ahead.set_aspect("equal", adjustable="datalim")
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


def _plane(corners: Sequence[Array], seen: NDArray[np.bool_]) -> _Plane | None:
    """The plane that cuts most of the faces ``seen``: of the patent's target half the depth of its blocks, of a wall
    one across it. None where nothing is seen."""
    best: tuple[int, _Plane] | None = None
    for axis in (0, 1):
        ends = np.unique(np.concatenate([points[:, axis] for points in corners]))
        for at in ((ends[1:] + ends[:-1]) / 2).tolist():
            plane = _Plane(axis, at)
            number = sum(bool(_cut(points, plane)) for points, one in zip(corners, seen, strict=True) if one)
            if number and (best is None or number > best[0]):
                best = number, plane
    return None if best is None else best[1]


def _slopes(faces: pd.DataFrame, plane: _Plane) -> Array:
    """How far the other coordinate goes with that of the plane along each face, so that points near the plane can be
    moved into it along their faces: of faces at 45° to it ±1, of level ones, and of those that it does not cut, 0."""
    across, along = (faces[f"normal_{'xy'[axis]}_target_1"].to_numpy() for axis in (plane.axis, plane.along))
    aslant = np.abs(along) > 0.1
    return np.asarray(np.where(aslant, -across / np.where(aslant, along, 1.0), 0.0))


def _calibrated(residuals: pd.DataFrame) -> str:
    """The sensor of which there are two mounts to show."""
    return "mbes" if (residuals["sensor"] == "mbes").any() else "laser"


def _near(axis: Axes, points: pd.DataFrame, corners: Sequence[Array], plane: _Plane) -> None:
    """Set the panel to the face with the most points."""
    (cut,) = _cut(corners[int(points["face"].mode().iloc[0])], plane)
    ends = cut[:, [plane.along, 2]]
    low, high = ends.min(axis=0), ends.max(axis=0)
    middle, half = (low + high) / 2, max(high - low) * 1.1
    axis.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
    axis.set_title("one face of it")


def _across(
    axis: Axes, points: pd.DataFrame, corners: Sequence[Array], plane: _Plane, drawn: Sequence[Array]
) -> None:
    """The highest of the faces with points in its whole height, its thickness stretched to where the points lie."""
    there = [_cut(corners[number], plane)[0][:, [plane.along, 2]] for number in points["face"].astype(int).unique()]
    ends = max(there, key=lambda cut: float(np.ptp(cut[:, 1])))
    slant = np.ptp(ends[:, 0]) / 2
    middle = float(ends[:, 0].mean())
    cloud = np.concatenate(drawn)
    away = np.abs(cloud[:, 0] - middle)
    beside = away[away < slant + ASIDE_M]
    half = max(0.05, 1.2 * float(np.quantile(beside, 0.98))) if len(beside) else 0.05
    axis.set(xlim=(middle - half, middle + half), ylim=(ends[:, 1].min() - 0.2, ends[:, 1].max() + 0.2))
    axis.set_title(f"{'xy'[plane.along]} stretched")


def _cut(corners: Array, plane: _Plane) -> list[Array]:
    """Where a face's outline crosses the plane: one line (2, 3), or none."""
    closed = np.vstack([corners, corners[:1]])
    found = []
    for one, other in pairwise(closed):
        if (one[plane.axis] - plane.at) * (other[plane.axis] - plane.at) < 0:
            found.append(one + (other - one) * (plane.at - one[plane.axis]) / (other[plane.axis] - one[plane.axis]))
    return [np.array(found)] if len(found) == 2 else []


def distances(residuals: pd.DataFrame, faces: pd.DataFrame, family: NDArray[Any], solved: bool) -> Markup:
    """Each family's points by their distance from the adjusted surface, in mm; ``family``: of each residual."""
    names = [name for name in family_names(faces) if (family == name).any()][:MOST_PANELS]
    level = horizontal_families(faces)
    names = names or family_names(faces)[:1]
    clouds = CLOUDS[_calibrated(residuals)][: None if solved else -1]  # without a result nothing is calibrated
    figure = Figure(figsize=(WIDTH_IN, 3.2))
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
