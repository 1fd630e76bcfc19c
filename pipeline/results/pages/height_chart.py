"""Chart of the mean residuals by height above the water: the laser's above it, the sonar's below."""

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.from_tables import family_names, horizontal_families
from pipeline.maths.geometry.face_grid import bin_statistics
from pipeline.maths.target.bottom_names import PIECES, shown_name
from pipeline.mount import WITHIN_95
from pipeline.results.pages.families import shown_names, styles_of_families
from pipeline.results.pages.rendering import ALARM, FAMILY, INK, LASER, MARKS, QUIET, SONAR, WIDTH_IN, picture

Array = NDArray[np.float64]
BIN_M = 0.1  # as in table patterns
MOST_TOLERANCES = 5.0  # half the width of the panel: larger means stand on its edge
HEIGHTS = ("sensor", "face", "residual_m", "z_target_m")  # columns of table residuals


def means_by_height(residuals: pd.DataFrame, faces: pd.DataFrame, water_level_m: float) -> pd.DataFrame:
    """Return the mean residuals of the faces that are not level: sensor, family, low, count, mean_m, sigma_mean_m.

    All points of the sample count alike, as in the test of steps: robust weights would hide a part of a wall that lies
    elsewhere. Bins of fewer than :data:`~pipeline.adjustment.residual_tables.FEWEST` points have no mean (NaN).

    Parameters
    ----------
    residuals
        The artefact ``residuals`` with the columns :data:`HEIGHTS`.
    faces
        The artefact ``faces``.
    water_level_m
        Height of the water, target frame.
    """
    level = horizontal_families(faces)
    names = [name for name in family_names(faces) if name not in level and shown_name(name) != PIECES]
    number_of = {name: number for number, name in enumerate(names)}
    family = faces["family"].map(number_of).fillna(-1).to_numpy(np.int64)[residuals["face"].to_numpy().astype(int)]
    bins = np.floor((residuals["z_target_m"].to_numpy(np.float64) - water_level_m) / BIN_M).astype(np.int64)
    tables = []
    for sensor in ("laser", "mbes"):
        use = (residuals["sensor"] == sensor).to_numpy() & (family >= 0)
        residual_m = residuals["residual_m"].to_numpy(np.float64)[use]
        means = bin_statistics(np.column_stack([family[use], bins[use]]), residual_m, np.ones(len(residual_m)))
        scatter = np.sqrt(np.maximum(means.rms_m**2 - means.mean_m**2, 0.0))
        rows = {"sensor": sensor, "family": np.array(names, dtype=object)[means.keys[:, 0]]}
        rows |= {"low": means.keys[:, 1] * BIN_M, "count": means.count}
        few = means.count < FEWEST
        rows |= {"mean_m": np.where(few, np.nan, means.mean_m)}
        rows |= {"sigma_mean_m": np.where(few, np.nan, scatter / np.sqrt(means.count))}
        tables.append(pd.DataFrame(rows))
    return pd.concat(tables, ignore_index=True)


def height_chart(
    means: pd.DataFrame, patterns: pd.DataFrame, faces: pd.DataFrame, tolerance_m: float, limit: float
) -> Markup:
    """Draw the mean residuals by height, as the wall stands: heights upwards, with a ring where the test finds a step.

    Parameters
    ----------
    means
        The result of :func:`means_by_height`.
    patterns
        The artefact ``patterns``, whose rows by height are steps: the mean above a height less the mean below it.
    faces
        The artefact ``faces``.
    tolerance_m
        The setting ``adjust.test_tolerance_m``.
    limit
        The limit of the test for |normalised| in ``patterns``.
    """
    figure = Figure(figsize=(WIDTH_IN, 4.2))
    axis = figure.add_axes((0.09, 0.11, 0.73, 0.82))
    names = shown_names(family_names(faces))
    colours, marks = styles_of_families(names, FAMILY), styles_of_families(names, MARKS, turn=1)
    family_of = dict(zip(faces["name"], faces["family"], strict=True))
    beyond = patterns[(patterns["by"] == "height") & (patterns["normalised"].abs() > limit)]
    half = _half_width(means, 1000 * tolerance_m)
    for (sensor, name), rows in means.groupby(["sensor", "family"], sort=False):
        heights, values, sigmas = _without_gaps_closed(rows)
        values = np.clip(values, -half, half)
        line, *_ = axis.errorbar(
            values, heights, xerr=WITHIN_95 * sigmas, fmt=f"{marks[str(name)]}-", color=colours[str(name)],
            markersize=2.5, linewidth=1.0, elinewidth=0.4, label=name,
        )  # fmt: skip
        line.set_clip_on(False)  # a mean on the edge is drawn in full
        at = beyond.loc[(beyond["sensor"] == sensor) & (beyond["family"].map(family_of) == name), "low"].to_numpy()
        axis.plot(np.clip(_mean_at(at, rows), -half, half), at, "o", mfc="none", mec=ALARM, ms=8, clip_on=False)
    _frame(axis, means, 1000 * tolerance_m, half)
    handles, labels = axis.get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    shown = [name for name in names if name in known]
    figure.legend([known[name] for name in shown], shown, loc="upper left", bbox_to_anchor=(0.84, 0.8), frameon=False)
    return picture(figure, "mean residuals by height above the water")


def _without_gaps_closed(rows: pd.DataFrame) -> tuple[Array, Array, Array]:
    """Return heights (m) of bins' middles, means and sigmas (mm), (n,) each, with NaN where bins are missing."""
    number = np.rint(rows["low"].to_numpy() / BIN_M).astype(int)
    start = number.min()
    values = np.full((2, np.ptp(number) + 1), np.nan)
    values[:, number - start] = 1000 * rows[["mean_m", "sigma_mean_m"]].to_numpy().T
    return (start + np.arange(values.shape[1]) + 0.5) * BIN_M, values[0], values[1]


def _mean_at(heights_m: Array, rows: pd.DataFrame) -> Array:
    """Return the mean (mm) at the lower edge of a bin, between the bin's and that of the one below, (n,)."""
    known = rows[np.isfinite(rows["mean_m"])].sort_values("low")
    if not len(known):
        return np.full(len(heights_m), np.nan)
    return np.asarray(np.interp(heights_m, known["low"] + BIN_M / 2, 1000 * known["mean_m"]))


def _half_width(means: pd.DataFrame, tolerance_mm: float) -> float:
    """Return half the width of the panel, mm."""
    largest = 1000 * float(means["mean_m"].abs().max()) if np.isfinite(means["mean_m"]).any() else 0.0
    return float(np.clip(1.15 * largest, 2 * tolerance_mm, MOST_TOLERANCES * tolerance_mm))


def _frame(axis: Axes, means: pd.DataFrame, tolerance_mm: float, half: float) -> None:
    """Draw zero, the tolerance, the water's surface and the sensors' names, and set the limits and titles."""
    axis.axvline(0, color=QUIET, linewidth=0.6)
    for side in (-1, 1):
        axis.axvline(side * tolerance_mm, color=INK, linewidth=0.6, linestyle=(0, (6, 3)))
    low, high = axis.get_ylim()
    if low < 0 < high:
        axis.axhline(0, color=LASER, linewidth=0.8)
        axis.annotate("water", (half, 0), (-2, 2), textcoords="offset points", ha="right", color=LASER)
    for sensor, word, colour in (("laser", "laser", LASER), ("mbes", "sonar", SONAR)):
        heights = means.loc[(means["sensor"] == sensor) & np.isfinite(means["mean_m"]), "low"]
        if len(heights):
            axis.annotate(word, (-half, heights.mean()), (4, 0), textcoords="offset points", va="center", color=colour)
    axis.set(xlim=(-half, half), ylim=(low, high), xlabel="mean residual, mm (broken lines: the tolerance)")
    axis.set(ylabel="height above the water, m", title="mean residuals by height")
