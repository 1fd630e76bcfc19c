"""Charts of the report: residuals by angle, distance and time, their means by pass, and convergence."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.gps_time import NS
from pipeline.mount import WITHIN_95
from pipeline.results.pages.families import shown_names, styles_of_families, together
from pipeline.results.pages.rendering import AXIS, FAMILY, LASER, MARKS, QUIET, SMALLEST_PT, SONAR, WIDTH_IN, picture

WORDS = {"angle": "swath angle", "range": "distance"}
LABELS = {"angle": "angle across track in the {}'s frame, degrees", "range": "distance from the {}, m"}


def residual_charts(bins: pd.DataFrame, cells: pd.DataFrame, passes: pd.DataFrame, families: Sequence[str]) -> Markup:
    """Draw mean residuals of the calibrated sensor by angle and distance, of both sensors by family and over time.

    Pieces of the bottom are one family.

    Parameters
    ----------
    bins
        The artefact ``residual_bins``.
    cells
        The artefact ``cells``: mean residuals by sensor, family and pass.
    passes
        The artefact ``passes``.
    families
        Names of the target's families.
    """
    names = shown_names(families)
    colours, marks = styles_of_families(names, FAMILY), styles_of_families(names, MARKS, turn=1)
    bins, cells = together(bins, ("sensor", "pass", "by", "low", "width")), together(cells, ("sensor", "pass"))
    figure = Figure(figsize=(WIDTH_IN, 6.0))
    grid = figure.add_gridspec(3, 2, left=0.08, right=0.98, bottom=0.05, top=0.91, wspace=0.2, hspace=0.55)
    by_face, by_angle, by_range = (figure.add_subplot(grid[place]) for place in ((0, 0), (0, 1), (1, 0)))
    _by_face(by_face, cells, marks)
    shown = bins[(bins["count"] >= FEWEST) & np.isfinite(bins["mean_m"])]
    sensor = "mbes" if (shown["sensor"] == "mbes").any() else "laser"
    word, sonar = {"mbes": "sonar", "laser": "laser"}[sensor], shown[shown["sensor"] == sensor]
    for axis, by in ((by_angle, "angle"), (by_range, "range")):
        for name, colour in colours.items():
            rows = sonar[(sonar["by"] == by) & (sonar["family"] == name)]
            scatter = np.sqrt(np.maximum(rows["rms_m"] ** 2 - rows["mean_m"] ** 2, 0.0))
            mean, sigma = 1000 * rows["mean_m"], 1000 * scatter / np.sqrt(rows["count"])
            bars: dict[str, Any] = {"markersize": 3, "linewidth": 0.8, "color": colour}
            axis.errorbar(rows["low"] + rows["width"] / 2, mean, WITHIN_95 * sigma, fmt=f"{marks[name]}-", **bars)
        axis.set(title=f"{word}, by {WORDS[by]}", xlabel=LABELS[by].format(word), ylabel="mean residual, mm")
    spread = figure.add_subplot(grid[1, 1])
    for name, colour in colours.items():
        rows = sonar[(sonar["by"] == "angle") & (sonar["family"] == name)]
        spread.plot(rows["low"] + rows["width"] / 2, 1000 * rows["rms_m"], f"{marks[name]}-", color=colour, label=name)
        spread.lines[-1].set(markersize=3, linewidth=0.8)
    label = LABELS["angle"].format(word)
    spread.set(title=f"{word}, scatter by swath angle", xlabel=label, ylabel="RMS residual, mm", ylim=(0, None))
    figure.legend(*spread.get_legend_handles_labels(), loc="upper center", ncols=6, frameon=False)
    _over_time(figure.add_subplot(grid[2, :]), shown[shown["by"] == "time"], passes)
    for axis in (by_face, by_angle, by_range):
        axis.axhline(0, color=QUIET, linewidth=0.6)
    return picture(figure, "mean residuals by face, swath angle, distance and time")


def _by_face(axis: Axes, cells: pd.DataFrame, marks: Mapping[str, str]) -> None:
    """Draw the mean residuals by family, with one mark for each pass: the laser on the left, the sonar on the right."""
    for sensor, side, colour in (("laser", -0.18, LASER), ("mbes", 0.18, SONAR)):
        for place, name in enumerate(marks):
            rows = cells[(cells["sensor"] == sensor) & (cells["family"] == name)]
            at = place + side + np.linspace(-0.12, 0.12, len(rows)) if len(rows) > 1 else [place + side] * len(rows)
            bars: dict[str, Any] = {"markersize": 3, "linewidth": 0.8, "color": colour}
            mean = 1000 * rows["mean_m"].to_numpy()
            axis.errorbar(at, mean, 1000 * WITHIN_95 * rows["sigma_mean_m"], fmt=marks[name], **bars)
            for x, y, number in zip(at, mean, rows["pass"], strict=True):
                beside: dict[str, Any] = {"textcoords": "offset points", "fontsize": SMALLEST_PT, "color": colour}
                axis.annotate(f"{number}", (x, y), (2, 2), **beside)
    if len(cells):
        inner = 3000 * float(cells["mean_m"].abs().quantile(0.9)) + 1  # else one mean far away would hide the others
        axis.set_ylim(-inner, inner)
    axis.set_xticks(range(len(marks)), list(marks))
    axis.set(title="by family and pass (laser blue, sonar orange)", ylabel="mean residual, mm")


def _over_time(axis: Axes, rows: pd.DataFrame, passes: pd.DataFrame) -> None:
    """Draw the mean residual of each second. The passes follow each other, without the time between them."""
    start, gap = 0.0, 5.0
    middles, names = [], []
    for row in passes.to_dict("records"):
        first = row["start_ns"] / NS
        for sensor, colour, size in (("laser", LASER, 2.0), ("mbes", SONAR, 2.5)):
            inside = rows[(rows["pass"] == row["pass"]) & (rows["sensor"] == sensor)]
            at = start + inside["low"] + inside["width"] / 2 - first
            axis.plot(at, 1000 * inside["mean_m"], ".", color=colour, markersize=size * 1.5)
        middles.append(start + row["duration_s"] / 2)
        names.append(f"pass {row['pass']}")
        start += row["duration_s"] + gap
        axis.axvline(start - gap / 2, color=QUIET, linewidth=0.4)
    if len(middles) <= 20:
        axis.set_xticks(middles, names)
    axis.axhline(0, color=QUIET, linewidth=0.6)
    axis.set(title="by time: mean of each second and family (laser blue, sonar orange)", ylabel="mean residual, mm")


def convergence_charts(iterations: pd.DataFrame, alternation: pd.DataFrame) -> Markup:
    """Draw the deviations in the patent's angle iteration, and the changes in each turn of its angles and offsets."""
    figure = Figure(figsize=(WIDTH_IN, 2.5))
    where = {"left": 0.1, "right": 0.99, "bottom": 0.18, "top": 0.9, "wspace": 0.22}
    angles, turns = figure.subplots(1, 2, gridspec_kw=where)
    for (axis, colour), style in zip(AXIS.items(), ("o-", "s-", "^-"), strict=True):
        size = iterations[f"deviation_{axis}_deg"].abs().clip(lower=1e-9)
        angles.semilogy(iterations["iteration"], size, style, color=colour, label=axis, markersize=3, linewidth=0.8)
    angles.set(title="angle iteration (offsets not yet applied)", xlabel="step", ylabel="deviation of the planes, °")
    for column, scale, style, label, colour in (
        ("step_deg", 1.0, "o-", "angles, °", SONAR),
        ("step_m", 1000.0, "s-", "offsets, mm", LASER),
    ):
        size = (scale * alternation[column]).clip(lower=1e-9)
        turns.semilogy(alternation["iteration"], size, style, color=colour, label=label, markersize=3, linewidth=0.8)
    turns.set(title="angles and offsets in turn", xlabel="turn", ylabel="change in this turn")
    for axis in (angles, turns):
        axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.minorticks_off()
        axis.legend(frameon=False)
    return picture(figure, "convergence of the angle iteration and of the alternation")
