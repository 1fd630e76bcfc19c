"""The report's pictures of walls, slopes and pieces of the bottom, which are one entry: heights, maps, sections."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.adjustment.residual_tables import map_table
from pipeline.results.pages import face_maps, height_chart, residual_plots, target_plots
from pipeline.results.pages.cutting_plane import plane_by_points
from pipeline.results.pages.families import shown_names, styles_of_families, together
from pipeline.results.pages.rendering import FAMILY, MARKS, drawing_style
from tests.support.figures import kept_figures

HALF = np.sqrt(0.5)
WATER_M = 0.4
WALLS: dict[str, tuple[list[list[float]], tuple[float, float, float]]] = {
    "wall-1": ([[0, 3, -4], [0, -3, -4], [0, -3, 2], [0, 3, 2]], (-1, 0, 0)),
    "wall-2": ([[0, -3, -4], [2, -5, -4], [2, -5, 2], [0, -3, 2]], (-HALF, -HALF, 0)),
    "slope-1": ([[-4, -5, -4], [-4, -10, -4], [2, -10, 2], [2, -5, 2]], (-HALF, 0, HALF)),
    "slope-2": ([[-4, 8, -4], [-4, 3, -4], [1.8, 3, 2], [1.8, 8, 2]], (-0.71891, 0, 0.69510)),
}


def places(bottom: int = 0) -> pd.DataFrame:
    """The table faces of a quay: two walls, two slopes (one a little flatter than 45°), and pieces of the bottom."""
    faces = dict(WALLS)
    for k in range(bottom):
        x, y = -10.0 + 2 * (k % 3), -10.0 + 2 * (k // 3)
        corners = [[x, y, -4.5], [x + 1.8, y, -4.5], [x + 1.8, y + 1.8, -4.5], [x, y + 1.8, -4.5]]
        faces[f"bottom-{k + 1}"] = corners, (0, 0, 1)
    rows: list[dict[str, Any]] = [
        {"face": number, "name": name, "family": name, "vertices_target_m": np.ravel(corners).astype(float).tolist()}
        | {f"normal_{axis}_target_1": float(normal[k]) for k, axis in enumerate("xyz")}
        | {"distance_m": float(np.dot(np.mean(corners, axis=0), normal))}
        for number, (name, (corners, normal)) in enumerate(faces.items())
    ]
    return pd.DataFrame(rows)


def points_on(faces: pd.DataFrame, per_m2: float = 600.0, seed: int = 1) -> pd.DataFrame:
    """Points evenly on all faces, the laser's above the water and the sonar's below; residuals of ± 2 mm."""
    random = np.random.default_rng(seed)
    tables = []
    for row in faces.to_dict("records"):
        first, second, _, last = np.reshape(row["vertices_target_m"], (4, 3))
        many = round(per_m2 * float(np.linalg.norm(second - first) * np.linalg.norm(last - first)))
        share = random.random((many, 2))
        points = first + share[:, :1] * (second - first) + share[:, 1:] * (last - first)
        residual = 0.002 * random.choice([-1.0, 1.0], many)
        columns = {f"{axis}_target_m": points[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"coarse_{name}": column + 0.05 for name, column in columns.items()}
        columns |= {"residual_m": residual, "coarse_residual_m": residual + 0.05, "weight": np.ones(many)}
        sensor = np.where(points[:, 2] > WATER_M, "laser", "mbes")
        tables.append(pd.DataFrame({"sensor": sensor, "face": row["face"], "pass": 0} | columns))
    return pd.concat(tables, ignore_index=True)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    return kept_figures(monkeypatch, target_plots, face_maps, height_chart, residual_plots)


def step_pattern(low: float, normalised: float, by: str = "height") -> pd.DataFrame:
    row = {"by": by, "sensor": "mbes", "family": "wall-1", "low": low, "normalised": normalised}
    return pd.DataFrame([row])


def test_means_by_height_against_a_loop_and_with_plain_weights() -> None:
    """A part of the wall that the adjustment rejected, with no weight, must show in full."""
    faces = places(bottom=2)
    points = points_on(faces)
    ledge = (points["face"] == 0) & (points["z_target_m"] < WATER_M - 2.0)
    points.loc[ledge, "residual_m"] += 0.03
    points.loc[ledge, "weight"] = 0.0
    means = height_chart.means_by_height(points, faces, WATER_M)
    assert set(means["family"]) == set(WALLS)
    for row in means.sample(40, random_state=2).to_dict("records"):
        above = points["z_target_m"] - WATER_M
        of_face = points["face"] == list(WALLS).index(row["family"])
        use = of_face & (points["sensor"] == row["sensor"]) & (above >= row["low"]) & (above < row["low"] + 0.1)
        assert row["count"] == pytest.approx(use.sum(), abs=2)  # edges of bins are rounded
        if row["count"] >= 12:
            assert row["mean_m"] == pytest.approx(points.loc[use, "residual_m"].mean(), abs=1e-4)
    wall = means[(means["family"] == "wall-1") & (means["sensor"] == "mbes") & (means["count"] >= 10)]
    deep = wall["low"] < -2.05
    assert wall.loc[deep, "mean_m"].min() > 0.028
    assert wall.loc[~deep, "mean_m"].abs().max() < 0.002


def test_a_bin_of_nine_points_has_no_mean_and_one_of_ten_has() -> None:
    faces = places()
    points = points_on(faces).iloc[[0] * 19].assign(face=0, sensor="mbes", residual_m=0.004)
    points["z_target_m"] = WATER_M - np.array([1.05] * 9 + [2.05] * 10)
    means = height_chart.means_by_height(points, faces, WATER_M).set_index("count")["mean_m"]
    assert np.isnan(means[9])
    assert means[10] == pytest.approx(0.004)


@pytest.mark.parametrize(
    ("pattern", "rings"),
    [(step_pattern(-2.0, 4.6), 1), (step_pattern(-2.0, -4.6), 1), (step_pattern(-2.0, 4.4), 0),
     (step_pattern(-2.0, 9.0, by="angle"), 0)],
)  # fmt: skip
def test_the_height_chart_has_a_ring_where_the_test_finds_a_step(
    pattern: pd.DataFrame, rings: int, drawn: list[Figure]
) -> None:
    faces = places(bottom=24)
    points = points_on(faces)
    points.loc[(points["face"] == 0) & (points["z_target_m"] < WATER_M - 2.0), "residual_m"] += 0.04
    with drawing_style():
        means = height_chart.means_by_height(points, faces, WATER_M)
        height_chart.height_chart(means, pattern, faces, 0.003, 4.5)
    (axis,) = drawn[0].axes
    circles = [line for line in axis.lines if line.get_marker() == "o" and line.get_linestyle() == "None"]
    found = np.concatenate([np.asarray(line.get_xydata()) for line in circles])
    assert len(found) == rings
    assert all(found[:, 1] == -2.0)
    tolerances = [line.get_xdata()[0] for line in axis.lines if line.get_linestyle() == "--"]
    assert sorted(map(float, tolerances)) == [-3.0, 3.0]
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()] == list(WALLS)
    (wall,) = [one for one in axis.containers if one.get_label() == "wall-1" and one[0].get_ydata().max() < 0.06]
    inside = np.asarray(wall[0].get_xydata(), dtype=float)
    assert inside[inside[:, 1] < -2.1, 0] == pytest.approx(15.0)  # 40 mm stand on the edge
    assert np.abs(inside[inside[:, 1] > -1.9, 0]).max() < 2


def test_cells_of_slopes_lie_within_their_panels_at_their_heights(drawn: list[Figure]) -> None:
    faces = places(bottom=24)
    points = points_on(faces)
    table = map_table(points, faces)
    order, left_out = face_maps.families_of_maps(table, faces, "mbes")
    assert (order, left_out) == (["slope-2", "wall-1", "wall-2", "slope-1", "bottom"], 0)
    with drawing_style():
        for sensor in ("mbes", "laser"):
            face_maps.residual_maps(table, faces, sensor)
    for figure, heights in zip(drawn, ((-4.0, WATER_M), (WATER_M, 2.0)), strict=True):
        *panels, _ = figure.axes
        for axis in panels:
            (image,) = axis.images
            left, right, low, high = image.get_extent()
            limits = axis.get_xlim(), axis.get_ylim()
            assert limits[0][0] <= left < right <= limits[0][1]
            assert limits[1][0] <= low < high <= limits[1][1]
            name = axis.get_title(loc="left")
            if name != "bottom":
                assert (low, high) == pytest.approx(heights, abs=0.21), name
                filled = np.isfinite(np.ma.filled(image.get_array(), np.nan)).mean()
                assert filled > 0.9, name
            if name == "slope-1":
                assert (left, right) == pytest.approx((5.0, 10.0), abs=0.21)


def test_maps_label_nothing_twice_or_beyond_the_picture(drawn: list[Figure]) -> None:
    faces = places(bottom=24)
    with drawing_style():
        face_maps.residual_maps(map_table(points_on(faces), faces), faces, "mbes")
    (figure,) = drawn
    canvas = FigureCanvasAgg(figure)
    boxes = []
    for axis in figure.axes:
        labels = [axis.xaxis.label, axis.yaxis.label]
        for place, ticks in enumerate((axis.xaxis, axis.yaxis)):
            low, high = sorted(ticks.get_view_interval())
            labels += [one for one in ticks.get_ticklabels() if low <= one.get_position()[place] <= high]
        shown = [one for one in labels if one.get_text() and one.get_visible()]
        boxes += [one.get_window_extent(canvas.get_renderer()) for one in shown]
    for k, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.x1
        assert not any(box.overlaps(other) for other in boxes[:k])


def test_of_too_many_families_those_that_both_sensors_see_are_shown() -> None:
    many = 6
    walls = {f"wet-{k}": ([[0, y, -4], [0, y - 1, -4], [0, y - 1, -1], [0, y, -1]], (-1, 0, 0))
             for k, y in enumerate(range(20, 20 + 2 * many, 2))}  # fmt: skip
    extra = [{"face": 4 + k, "name": name, "family": name, "vertices_target_m": np.ravel(corners).tolist(),
              "normal_x_target_1": -1.0, "normal_y_target_1": 0.0, "normal_z_target_1": 0.0, "distance_m": 0.0}
             for k, (name, (corners, _)) in enumerate(walls.items())]  # fmt: skip
    faces = pd.concat([places(), pd.DataFrame(extra)], ignore_index=True)
    table = map_table(points_on(faces), faces)
    order, left_out = face_maps.families_of_maps(table, faces, "mbes")
    assert left_out == 4 + many - 7
    assert set(order) > set(WALLS)
    assert face_maps.families_of_maps(table, faces, "laser") == (["slope-2", "wall-1", "wall-2", "slope-1"], 0)


@pytest.mark.parametrize("bottom", [0, 24])
def test_the_section_cuts_the_wall_at_right_angles_where_both_sensors_are(bottom: int, drawn: list[Figure]) -> None:
    faces = places(bottom)
    points = points_on(faces)
    with drawing_style():
        target_plots.target_sections(points, faces, solved=True, letters=False)
    above, section, _ = drawn[0].axes
    title = section.get_title(loc="left")
    assert title.startswith("section at y = ")
    assert abs(float(title.removeprefix("section at y = ").removesuffix(" m"))) < 3
    for label in ("laser", "sonar, calibrated"):
        (line,) = [one for one in section.lines if one.get_label() == label]
        at = np.asarray(line.get_xydata(), dtype=float)
        assert (np.abs(at[:, 0]) < 0.01).sum() > 50, label
    (soundings,) = [one for one in above.lines if one.get_label() == "sonar, calibrated"]
    on_bottom = np.asarray(soundings.get_xdata(), dtype=float) < -4.1
    assert on_bottom.any() == bool(bottom)
    label = above.yaxis.label.get_window_extent(FigureCanvasAgg(drawn[0]).get_renderer())
    assert label.x0 >= 0


def test_a_plane_needs_points_of_both_sensors_on_one_face() -> None:
    """The sonar alone sees one end of the wall, the laser alone the other; both see a return at right angles to it."""
    wall = np.array([[0, 3, -4], [0, -3, -4], [0, -3, 2], [0, 3, 2]], dtype=float)
    side = np.array([[0, -3, -4], [1, -3, -4], [1, -3, 2], [0, -3, 2]], dtype=float)
    random = np.random.default_rng(3)
    z = random.uniform(-4, 2, 3000)
    at_wall = np.column_stack([np.zeros(3000), np.where(z > 0, 2.9, 0.0) + random.uniform(-0.02, 0.02, 3000), z])
    at_side = np.column_stack([0.5 + random.uniform(-0.02, 0.02, 300), np.full(300, -3.0), z[:300]])
    points, face = np.vstack([at_wall, at_side]), np.repeat([0, 1], [3000, 300])
    dry = points[:, 2] > 0
    normals = np.array([[-1.0, 0, 0], [0, -1.0, 0]])
    both = {"laser": points[dry], "mbes": points[~dry]}
    plane = plane_by_points([wall, side], normals, both, {"laser": face[dry], "mbes": face[~dry]})
    assert str(plane) == "x = 0.50 m"
    alone = plane_by_points([wall, side], normals, {"mbes": points[~dry]}, {"mbes": face[~dry]})
    assert str(alone) == "y = 0.00 m"
    few = plane_by_points([wall, side], normals, {"mbes": points[~dry][:9]}, {"mbes": face[~dry][:9]})
    assert few is None


def test_a_wall_with_points_at_one_end_alone_is_cut_there() -> None:
    wall = np.array([[0, 50, -4], [0, -50, -4], [0, -50, 2], [0, 50, 2]], dtype=float)
    random = np.random.default_rng(4)
    points = np.column_stack([np.zeros(3000), random.uniform(38, 40, 3000), random.uniform(-4, 0, 3000)])
    plane = plane_by_points([wall], np.array([[-1.0, 0, 0]]), {"mbes": points}, {"mbes": np.zeros(3000, dtype=int)})
    assert plane is not None
    assert (plane.axis, plane.at) == (1, pytest.approx(39.0, abs=0.1))


def test_pieces_of_the_bottom_are_one_entry_weighted_by_count() -> None:
    rows = [("mbes", "wall-1", 0, 5, 0.001, 0.004, 0.001), ("mbes", "bottom-1", 0, 10, 0.002, 0.003, 0.001),
            ("mbes", "bottom-22", 0, 30, -0.001, 0.005, 0.002), ("mbes", "bottom-3", 1, 7, 0.006, 0.006, 0.003),
            ("mbes", "bottom-4", 1, 9, np.nan, np.nan, np.nan),
            ("mbes", "bottom-left", 0, 4, 0.009, 0.009, 0.001)]  # fmt: skip
    names = ["sensor", "family", "pass", "count", "mean_m", "rms_m", "sigma_mean_m"]
    found = together(pd.DataFrame(rows, columns=names), ("sensor", "pass")).set_index(["family", "pass"])
    assert sorted(found.index) == [("bottom", 0), ("bottom", 1), ("bottom-left", 0), ("wall-1", 0)]
    first = found.loc["bottom", 0]
    assert first["count"] == 40
    assert first["mean_m"] == pytest.approx((10 * 0.002 - 30 * 0.001) / 40)
    assert first["rms_m"] == pytest.approx(np.sqrt((10 * 0.003**2 + 30 * 0.005**2) / 40))
    assert first["sigma_mean_m"] == pytest.approx(np.hypot(10 * 0.001, 30 * 0.002) / 40)
    assert found.loc[("bottom", 1), "count"] == 7
    assert found.loc[("wall-1", 0), "mean_m"] == 0.001


def test_the_legend_of_a_place_with_24_pieces_has_five_names(drawn: list[Figure]) -> None:
    families = list(places(bottom=24)["family"])
    bins = pd.DataFrame(
        {"sensor": "mbes", "family": name, "pass": -1, "by": by, "low": low, "width": 2.0, "count": 50,
         "mean_m": 0.001, "rms_m": 0.008}
        for name in families for by in ("angle", "range") for low in (10.0, 12.0)
    )  # fmt: skip
    cells = pd.DataFrame(
        {"sensor": "mbes", "family": name, "pass": 0, "count": 50, "mean_m": 0.001, "rms_m": 0.008,
         "sigma_mean_m": 0.001} for name in families
    )  # fmt: skip
    passes = pd.DataFrame({"pass": [0], "start_ns": [0], "duration_s": [30.0]})
    with drawing_style():
        residual_plots.residual_charts(bins, cells, passes, families)
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()] == [*WALLS, "bottom"]
    ticks = [text.get_text() for text in drawn[0].axes[0].get_xticklabels()]
    assert ticks == [*WALLS, "bottom"]


def test_thirty_families_look_different() -> None:
    names = shown_names([f"wall-{k}" for k in range(30)])
    colours, marks = styles_of_families(names, FAMILY), styles_of_families(names, MARKS, turn=1)
    assert len({(colours[name], marks[name]) for name in names}) == 30
