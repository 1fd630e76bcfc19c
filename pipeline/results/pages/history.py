"""The page of a boat's history: a control chart of each mount parameter, and the table of sessions."""

import io
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.atomic_files import write_bytes, write_text, writing
from pipeline.console import plural
from pipeline.maths.detectable_movement import POWER
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.mount import WITHIN_95
from pipeline.results.history import TEXT_COLUMNS, History, SessionFilter
from pipeline.results.mount_difference import least_text
from pipeline.results.pages.rendering import ALARM, INK, QUIET, WIDTH_IN, drawing_style, picture, render_page

UNITS = {"deg": ("°", 1.0), "m": ("mm", 1000.0)}  # by unit of the setting: unit and factor in the chart


def history_page(history: History, filters: str) -> str:
    """Return the page as HTML; ``filters``: the filter of the sessions, in words."""
    table = history.table
    parameters = [{"name": name, "unit": "°" if unit == "deg" else unit} for name, *_, unit in PARAMETERS]
    rows = [
        {
            "date": row["date_utc"][:16].replace("T", " "),
            "session": row["session"],
            "run": row["run"],
            "verdict": row["verdict"],
            "cells": {name: _number(row[key], 4) for name, _, key, _ in PARAMETERS},
            "probability": "" if np.isnan(row["probability"]) else f"{row['probability']:.2g}",
            "moved": row["moved"],
            "uncertain": row["answer"] == "too uncertain",
            "detectable": _detectable(row),
        }
        for row in table.to_dict("records")
    ]
    jumps = table[table["moved"] != ""]
    each = "; ".join(f"{row['session']}: {row['moved']}" for row in jumps.to_dict("records"))
    sentence = f"Significant movements: {each}." if each else "No movement of the mount is shown."
    uncertain = int((table["answer"] == "too uncertain").sum())
    if uncertain:
        sentence += f" {plural(uncertain, 'comparison')} would not have found a movement that matters."
    return render_page(
        "history.html",
        rows=rows,
        parameters=parameters,
        chart=_control_charts(table),
        sentence=sentence,
        filters=filters,
        unreadable=history.unreadable,
        without=history.not_shown,
        sessions=plural(len(rows), "session"),
        power=POWER,
    )


def _time_labels(dates: Sequence[str]) -> list[str]:
    """Return the chart's label of each session: its day, with hour and minute if the day has several sessions.

    If these are the same too, the label begins with the session's number in the table.

    >>> _time_labels(["2026-05-12T08:00:00Z", "2026-05-12T14:30:00Z", "2026-05-13T08:00:00Z"])
    ['2026-05-12 08:00', '2026-05-12 14:30', '2026-05-13']
    >>> _time_labels(["2026-05-12T08:00:00Z", "2026-05-12T08:00:00Z"])
    ['1: 2026-05-12 08:00', '2: 2026-05-12 08:00']
    """
    days, minutes = Counter(date[:10] for date in dates), Counter(date[:16] for date in dates)
    labels = []
    for number, date in enumerate(dates, 1):
        label = date[:16].replace("T", " ") if days[date[:10]] > 1 else date[:10]
        labels.append(f"{number}: {label}" if minutes[date[:16]] > 1 else label)
    return labels


def _detectable(row: Mapping[Any, Any]) -> str:
    """Return the least movements that are found, of the angle and of the lever arm of which the least is largest."""
    of_unit = {unit: max(row[f"detectable_{key}"] for *_, key, own in PARAMETERS if own == unit) for unit in UNITS}
    return ", ".join(least_text(size, unit) for unit, size in of_unit.items() if not np.isnan(size))


def _number(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def _control_charts(table: pd.DataFrame) -> Markup:
    """Draw six charts, one for each mount parameter, over the sessions in order of time."""
    with drawing_style():
        figure = Figure(figsize=(WIDTH_IN, 6.0), layout="constrained")
        axes = figure.subplots(3, 2, sharex=True).T.ravel()
        for axis, parameter in zip(axes, PARAMETERS, strict=True):
            _control_chart(axis, table, parameter)
        for axis in (axes[2], axes[5]):
            axis.set_xticks(range(len(table)), _time_labels(table["date_utc"].tolist()), rotation=30, ha="right")
        return picture(figure, f"control charts of roll, pitch, yaw, x, y and z over {len(table)} sessions")


def _control_chart(axis: Axes, table: pd.DataFrame, parameter: tuple[str, int, str, str]) -> None:
    """Draw a mount parameter of each session, minus the median of the accepted sessions, with 95 % intervals."""
    name, index, key, unit = parameter
    word, scale = UNITS[unit]
    place = np.arange(len(table))
    accepted = (table["verdict"] == "accepted").to_numpy()
    values = table[key].to_numpy(dtype=float)
    sigma = table[f"sigma_{key}"].to_numpy(dtype=float) * scale
    good = accepted & np.isfinite(values)
    if good.any():
        values = values - np.median(values[good])
    if unit == "deg":
        values = values - 360.0 * np.round(values / 360.0)  # the yaw of a sonar head mounted backwards is near ±180°
    values = values * scale
    axis.axhline(0.0, color=QUIET, linewidth=0.6)
    for use, colour in ((~accepted & np.isfinite(values), QUIET), (good, INK)):
        bars = WITHIN_95 * np.nan_to_num(sigma[use])
        axis.errorbar(place[use], values[use], bars, fmt="o", color=colour, markersize=3.5, linewidth=1.0)
    moved = np.array([MOUNT_WORDS[index] in words.split(", ") for words in table["moved"]], dtype=bool)
    ring: dict[str, Any] = {"color": ALARM, "markersize": 9, "fillstyle": "none", "markeredgewidth": 1.4}
    axis.plot(place[moved], values[moved], "o", **ring)
    axis.set_title(f"{name}, {word}")
    axis.margins(x=0.05, y=0.15)
    if good.any():  # else a rejected session far away would hide the others: it is drawn at the edge
        reach = 1.15 * float(np.max(np.abs(values[good]) + WITHIN_95 * np.nan_to_num(sigma[good]))) + 1e-9
        axis.set_ylim(-reach, reach)
        beyond = np.isfinite(values) & (np.abs(values) > reach)
        for x, up in zip(place[beyond], values[beyond] > 0, strict=True):
            edge, mark = (0.96 * reach, "^") if up else (-0.96 * reach, "v")
            axis.plot([x], [edge], mark, color=QUIET, markersize=4)


def _no_formula(text: str) -> str:
    """Return the text, changed if a spreadsheet would execute it as a formula.

    >>> _no_formula("=1+1"), _no_formula("2026-05-12")
    ("'=1+1", '2026-05-12')
    """
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\r")) else text


def write_history(history: History, out: Path, chosen: SessionFilter) -> None:
    """Write history.html, .csv and .parquet.

    Parameters
    ----------
    history
        The sessions.
    out
        The folder to write to; it is made if it is missing.
    chosen
        The filter of the sessions, which the page shows in words.
    """
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
    content = io.BytesIO()
    history.table.to_parquet(content, index=False)
    write_bytes(out / "history.parquet", content.getvalue())
    plain = history.table.assign(**{name: history.table[name].map(_no_formula) for name in TEXT_COLUMNS})
    write_text(out / "history.csv", plain.to_csv(index=False, lineterminator="\n"))
    write_text(out / "history.html", history_page(history, chosen.words()))
