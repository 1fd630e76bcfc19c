"""Stage adjust: soundings before and after and in between, residuals as colours, as maps and over time, the boat."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.catalogue.results import (
    COVARIANCE,
    ESTIMATE,
    GROUPS,
    RESIDUAL_BINS,
    RESIDUAL_MAP,
    RESIDUALS,
    SURFACES,
)
from pipeline.artefacts.catalogue.target import FACES
from pipeline.artefacts.from_tables import family_names, normal_of, normals_of
from pipeline.gps_time import NS
from pipeline.maths.geometry.face_grid import face_axes
from pipeline.maths.mount_parameters import N_MOUNT, PARAMETERS
from pipeline.results.pages.families import styles_of_families
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from pipeline.text_table import text_table
from stages.views.boat import log_boats
from stages.views.ingest import time_column
from stages.views.recording import COLOURS, DOT_M, LASER, SONAR, log_curve, text_document

Array = NDArray[np.float64]
Shades = dict[str, tuple[int, int, int]]  # by family
XYZ = [f"{axis}_target_m" for axis in "xyz"]
SENSORS = ("laser", "mbes")  # and further heads of the sonar, where a run has them
PARTS = 20  # of the way from the coarse to the calibrated mount
MOST_IN_REPLAY = 5000  # points of a family in one of its steps


@dataclass(frozen=True)
class ResidualPoints:
    """Points of the adjustment with their residuals.

    Attributes
    ----------
    residuals
        The artefact ``residuals``.
    family
        The family of each row's face.
    span_m
        By sensor, the residual (m) that has the strongest colour.
    steps
        By sensor, n if one in n points is in the table.
    """

    residuals: pd.DataFrame
    family: NDArray[Any]
    span_m: dict[str, float]
    steps: dict[str, int]


def log(recording: Any, tables: Tables) -> None:
    """Log soundings before, after and in between, residuals as colours, as maps and over time, boats, and a text."""
    faces, residuals = tables.table(FACES), tables.table(RESIDUALS)
    family = faces["family"].to_numpy()[residuals["face"].to_numpy().astype(int)]
    span = _span(residuals)
    steps = _steps(tables, residuals, list(span))
    shades = styles_of_families(family_names(faces), COLOURS)
    points = ResidualPoints(residuals, family, span, steps)
    _clouds(recording, tables, points, shades)
    _maps(recording, tables.table(RESIDUAL_MAP), faces, span)
    if read_settings(tables.run).session.calibrated == "mbes":
        _replay(recording, tables, points, shades)
    log_boats(recording, tables, residuals)
    _over_time(recording, tables.table(RESIDUAL_BINS), steps, shades)
    _log_text(recording, tables, span)


def _span(residuals: pd.DataFrame) -> dict[str, float]:
    """Return by sensor the residual (m) with the strongest colour: three times the RMS of points with a weight > 0."""
    spans_m = {}
    for sensor in sorted({*SENSORS, *residuals["sensor"].unique()}):
        rows = residuals[(residuals["sensor"] == sensor) & (residuals["weight"] > 0)]
        size = rows["residual_m"].to_numpy(np.float64)
        spans_m[sensor] = max(3 * float(np.sqrt(np.mean(size**2))), 1e-3) if len(size) else 1e-3
    return spans_m


def _steps(tables: Tables, residuals: pd.DataFrame, sensors: Sequence[str]) -> dict[str, int]:
    """Return by sensor the number of observations for one row of table ``residuals``, which is thinned."""
    total = dict.fromkeys(sensors, 0)
    groups = tables.table(GROUPS)
    for sensor, count in groups[groups["family"] != ""].groupby("sensor")["count"].sum().items():
        total[str(sensor)] += int(count)
    return {s: round(total[s] / max(1, int((residuals["sensor"] == s).sum()))) for s in sensors}


def residual_colours(residual_m: Array, span_m: float) -> NDArray[np.uint8]:
    """Return colours (n, 3): blue is negative, grey is zero, orange is positive; strongest from ``span_m`` on."""
    share = np.clip(np.asarray(residual_m, dtype=np.float64) / span_m, -1, 1)[:, None]
    end = np.where(share < 0, LASER, SONAR)
    return np.asarray(np.round((1 - abs(share)) * np.array((205, 205, 205)) + abs(share) * end), dtype=np.uint8)


def _clouds(recording: Any, tables: Tables, points: ResidualPoints, shades: Shades) -> None:
    """Log soundings before and after, and all points coloured by their residual."""
    import rerun as rr

    surfaces: Any = tables.table(SURFACES).to_dict("records")
    # each point is shown on its surface: points in front of it would hide the others, and all would seem to be in front
    normals = {row["family"]: normal_of(row) for row in surfaces}
    solved = bool(np.isfinite(tables.table(ESTIMATE)["value"].to_numpy()[:6]).all())
    for sensor in points.span_m:
        of_sensor = (points.residuals["sensor"] == sensor).to_numpy()
        step = rr.AnyValues(one_in=points.steps[sensor])
        for name, colour in shades.items():
            rows = points.residuals[of_sensor & (points.family == name)]
            calibrated = rows[XYZ].to_numpy()
            colours = residual_colours(rows["residual_m"].to_numpy(), points.span_m[sensor])
            away = rows["residual_m"].to_numpy()[:, None] * normals.get(name, np.zeros(3))
            cloud = rr.Points3D((calibrated - away).astype(np.float32), radii=DOT_M, colors=colours)
            recording.log(f"residuals/{sensor}/{name}", cloud, step, static=True)
            if sensor != "laser":
                own = name if sensor == "mbes" else f"{sensor}/{name}"
                coarse = rows[[f"coarse_{column}" for column in XYZ]].to_numpy()
                for when, where in (("before", coarse), *([("after", calibrated)] if solved else [])):
                    cloud = rr.Points3D(where, radii=DOT_M, colors=colour)
                    recording.log(f"{when}/{own}", cloud, step, static=True)


def _maps(recording: Any, cells: pd.DataFrame, faces: pd.DataFrame, span: dict[str, float]) -> None:
    """Log the squares of the residual map as coloured quads, one centimetre in front of their face."""
    import rerun as rr

    cells = cells[np.isfinite(cells["mean_m"]) & (cells["count"] >= FEWEST)]
    normals = normals_of(faces)
    family = faces["family"].to_numpy()
    for sensor in span:
        for name in family_names(faces):
            numbers = cells["face"].to_numpy().astype(int)
            rows = cells[(cells["sensor"] == sensor).to_numpy() & (family[numbers] == name)]
            if not len(rows):
                continue
            corners = []
            for face, of_face in rows.groupby("face", sort=True):
                half = face_axes(normals[int(str(face))]) * float(of_face["size_m"].iloc[0]) / 2
                middle = of_face[XYZ].to_numpy(np.float64) + 0.01 * normals[int(str(face))]
                signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
                corners.append(np.stack([middle + a * half[0] + b * half[1] for a, b in signs], axis=1))
            quads = np.concatenate(corners)
            first = 4 * np.arange(len(quads))[:, None, None]
            triangles = (first + np.array([[[0, 1, 2], [0, 2, 3]]])).reshape(-1, 3)
            ordered = rows.sort_values("face", kind="stable")
            colours = np.repeat(residual_colours(ordered["mean_m"].to_numpy(), span[sensor] / 3), 4, axis=0)
            mesh = rr.Mesh3D(
                vertex_positions=quads.reshape(-1, 3).astype(np.float32),
                triangle_indices=triangles.astype(np.uint32),
                vertex_colors=colours,
            )
            recording.log(f"maps/{sensor}/{name}", mesh, static=True)


def _replay(recording: Any, tables: Tables, points: ResidualPoints, shades: Shades) -> None:
    """Log the soundings on their way from the coarse to the calibrated mount, over the timeline ``iteration``.

    The way is divided into equal parts. (The adjustment itself takes few steps, of which the first is nearly all.)
    """
    import rerun as rr

    if not np.isfinite(tables.table(ESTIMATE)["value"].to_numpy()[:6]).all():
        return
    of_sonar = (points.residuals["sensor"] != "laser").to_numpy()
    for name, colour in shades.items():
        rows = points.residuals[of_sonar & (points.family == name)]
        rows = rows.iloc[:: max(1, -(-len(rows) // MOST_IN_REPLAY))]
        coarse, calibrated = rows[[f"coarse_{column}" for column in XYZ]].to_numpy(), rows[XYZ].to_numpy()
        for part in range(PARTS + 1 if len(rows) else 0):
            recording.set_time("iteration", sequence=part)
            where = (coarse + part / PARTS * (calibrated - coarse)).astype(np.float32)
            recording.log(f"replay/{name}", rr.Points3D(where, radii=DOT_M, colors=colour))


def _over_time(recording: Any, bins: pd.DataFrame, steps: dict[str, int], shades: Shades) -> None:
    import rerun as rr

    bins = bins[bins["by"] == "time"].sort_values("low", kind="stable")

    def dots(path: str, name: str, seconds: Any, values: Any, colour: Any) -> None:
        style = rr.SeriesPoints(colors=colour, names=name, marker_sizes=2.5)
        t_ns = np.round(np.asarray(seconds, dtype=np.float64) * NS).astype(np.int64)
        log_curve(recording, path, style, partial(time_column, t_ns), values)

    for sensor in steps:
        rows = bins[bins["sensor"] == sensor]
        if not len(rows):
            continue
        count = rows.groupby("low", sort=True)["count"].sum()
        thinned = f", one in {steps[sensor]} of them" if steps[sensor] > 1 else ""
        shown = count.to_numpy(np.float64)
        of_points = LASER if sensor == "laser" else SONAR
        dots(f"quality/points/{sensor}", f"{sensor}{thinned}", count.index + 0.5, shown, of_points)
        for name, colour in shades.items():
            of_family = rows[(rows["family"] == name) & np.isfinite(rows["mean_m"])]
            if len(of_family):
                where = of_family["low"].to_numpy() + 0.5
                shade = colour if sensor != "laser" else tuple((part + 2 * 160) // 3 for part in colour)
                mean = 1000 * of_family["mean_m"].to_numpy()
                dots(f"quality/residual/{sensor}/{name}", f"{sensor}/{name}", where, mean, shade)


def _log_text(recording: Any, tables: Tables, span: dict[str, float]) -> None:
    correlation = tables.table(COVARIANCE)["correlation"].to_numpy()
    size = math.isqrt(len(correlation))
    matrix = correlation.reshape(size, size)[:N_MOUNT, :N_MOUNT]
    places = [place for _, place, *_ in PARAMETERS]
    lines = ["Colours: blue, grey, orange from minus to plus; the strongest at"]
    lines += [f"  {s}: {1000 * span[s]:.1f} mm (points), {1000 * span[s] / 3:.1f} mm (means)" for s in span]
    lines += ["Plus: towards the boat, of horizontal faces up.", "", "Observations, and their variance factors:"]
    for row in tables.table(GROUPS).to_dict("records"):
        lines.append(f"  {row['group']:<16}{row['count']:>10,}{row['variance_factor']:>8.3f}")
    names = [name for name, *_ in PARAMETERS]
    rows = [(name, *(f"{matrix[place, column]:.2f}" for column in places)) for name, place, *_ in PARAMETERS]
    words = "Correlations" if size == N_MOUNT else "Correlations of the first head's parameters"
    lines += ["", words, *text_table("<6" + ">7" * len(names), ("", *names), rows)]
    recording.log("tables/residuals", text_document("\n".join(lines)), static=True)
