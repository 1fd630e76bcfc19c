"""The report's pictures of targets of any shape: sections where the sonar's points are, nothing printed over others."""

from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.config.pool import PoolConfig
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.maths.target.model import TargetModel
from pipeline.results.pages import face_maps, target_plots
from pipeline.results.pages.rendering import drawing_style
from pipeline.target.design import target_of
from tests.support.figures import kept_figures
from tests.support.roots import ROOT
from tests.support.targets import by_letters

ORIGIN = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
QUAY = {"wall": {"corners": [[0, 15, -6], [0, -15, -6], [0, -15, 2], [0, 15, 2]]},
        "cope": {"corners": [[0, 15, 2], [0, -15, 2], [2, -15, 2], [2, 15, 2]]}}
OFF_M = np.array([0.06, 0.02, 0.05])  # of what the coarse mount places


def model_of(name: str) -> TargetModel:
    if name == "patent":
        return by_letters(8.0, 3.0, 1.0, 0.5)
    target: Any = {"kind": "faces", "origin": ORIGIN, "azimuth_deg": 20.0, "faces": QUAY}
    if name != "quay":
        target = read_yaml(ROOT / "configs" / "scenarios" / f"{name}.yaml")["target"]
    return target_of(parse(PoolConfig, {"target": target}, name).target)


def faces_of(model: TargetModel) -> pd.DataFrame:
    rows: list[dict[str, Any]] = [
        {"face": number, "family": face.family, "vertices_target_m": face.vertices_m.ravel().tolist()}
        | {f"normal_{axis}_target_1": face.normal[k] for k, axis in enumerate("xyz")}
        for number, face in enumerate(model.faces)
    ]
    return pd.DataFrame(rows)


def residuals_of(model: TargetModel, seed: int = 0) -> pd.DataFrame:
    """Points on every face, the laser's above the water and the sonar's below, within millimetres."""
    random = np.random.default_rng(seed)
    tables = []
    many = 1500 if len(model.faces) > 2 else 30_000
    for number, face in enumerate(model.faces):
        weights = random.dirichlet(np.ones(len(face.vertices_m)), many)
        away = random.normal(0, 0.005, many)
        points = weights @ face.vertices_m + away[:, None] * face.normal
        sensor = np.where(points[:, 2] > 0, "laser", "mbes")
        coarse = points + OFF_M
        columns = {f"{axis}_target_m": points[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"coarse_{axis}_target_m": coarse[:, k] for k, axis in enumerate("xyz")}
        columns |= {"residual_m": away, "coarse_residual_m": away + OFF_M @ face.normal}
        tables.append(pd.DataFrame({"sensor": sensor, "face": number} | columns))
    return pd.concat(tables, ignore_index=True)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    return kept_figures(monkeypatch, target_plots, face_maps)


def draw(model: TargetModel, residuals: pd.DataFrame, solved: bool = True) -> None:
    with drawing_style():
        target_plots.target_sections(residuals, faces_of(model), solved, letters=model.repeats_m is not None)


@pytest.mark.parametrize(
    ("name", "title", "part"),
    [
        ("patent", "section at x = 0.50 m", "one face of it"),
        ("dock", "section at y = 0.00 m", "x stretched"),
        ("quay", "section at y = 0.00 m", "x stretched"),
    ],
)
def test_the_section_goes_through_the_wet_points(name: str, title: str, part: str, drawn: list[Figure]) -> None:
    model = model_of(name)
    draw(model, residuals_of(model))
    (figure,) = drawn
    _, ahead, near = figure.axes
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["from above", title, part]
    for axis in (ahead, near):
        seen = inside(axis, "sonar, calibrated")
        assert len(seen) >= 20
        assert (axis is near and name == "patent") or len(inside(axis, "laser")) >= 20
    if name == "quay":  # where the wall is, once from the laser and once from the sonar
        wall = [np.median(inside(near, label)[:, 0]) for label in ("laser", "sonar, calibrated", "sonar, coarse mount")]
        assert abs(wall[0] - wall[1]) < 0.003
        assert abs(wall[2] - wall[1]) == pytest.approx(0.06, abs=0.01)
        low, high = near.get_xlim()
        assert low < wall[2] < high


def inside(axis: Axes, label: str) -> np.ndarray:
    """Points of a cloud within the panel."""
    (line,) = [one for one in axis.lines if one.get_label() == label]
    points = np.asarray(line.get_xydata(), dtype=float)
    limits = zip(points.T, (axis.get_xlim(), axis.get_ylim()), strict=True)
    return points[np.all([(at >= min(ends)) & (at <= max(ends)) for at, ends in limits], axis=0)]


def test_without_the_sonars_points_there_is_no_section(drawn: list[Figure]) -> None:
    model = model_of("quay")
    residuals = residuals_of(model)
    few = residuals[(residuals["sensor"] == "laser") | (residuals.index % 10_000 == 0)]
    draw(model, few, solved=False)
    assert [axis.get_title(loc="left") for axis in drawn[0].axes] == ["from above"]


@pytest.mark.parametrize("name", ["patent", "dock", "quay", "caisson"])
def test_no_letters_are_printed_over_others(name: str, drawn: list[Figure]) -> None:
    model = model_of(name)
    faces, residuals = faces_of(model), residuals_of(model)
    family = faces["family"].to_numpy()[residuals["face"]]
    draw(model, residuals)
    with drawing_style():
        target_plots.distance_charts(residuals, faces, family, True)
        for sensor in ("laser", "mbes"):
            face_maps.residual_maps(cells_of(residuals, faces), faces, sensor)
    for figure in drawn:
        canvas = FigureCanvasAgg(figure)
        for axis in figure.axes:
            for place, ticks in enumerate((axis.xaxis, axis.yaxis)):
                low, high = sorted(ticks.get_view_interval())
                shown = [one for one in ticks.get_ticklabels() if low <= one.get_position()[place] <= high]
                boxes = [one.get_window_extent(canvas.get_renderer()) for one in shown if one.get_text()]
                assert not any(one.overlaps(other) for one, other in combinations(boxes, 2)), axis.get_title(loc="left")


def cells_of(residuals: pd.DataFrame, faces: pd.DataFrame) -> pd.DataFrame:
    """A cell round every seventh point."""
    some = residuals.iloc[::7]
    return some.assign(size_m=0.1, count=20, mean_m=some["residual_m"], rms_m=0.005)


def test_families_without_points_have_no_panel(drawn: list[Figure]) -> None:
    model = model_of("dock")
    faces, residuals = faces_of(model), residuals_of(model)
    names = faces["family"].to_numpy()
    residuals = residuals[names[residuals["face"]] != "return-north"]
    with drawing_style():
        target_plots.distance_charts(residuals, faces, names[residuals["face"]], True)
        face_maps.residual_maps(cells_of(residuals, faces), faces, "mbes")
    for figure in drawn:
        titles = [axis.get_title(loc="left").removesuffix(" (height)") for axis in figure.axes]
        assert sorted(filter(None, titles)) == ["fronts", "ledges", "return-south"]
