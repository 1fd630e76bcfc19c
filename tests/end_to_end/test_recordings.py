"""Recordings: drawn from Parquet, read back with the SDK."""

import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from rerun.chunk import RrdReader

import stages.views.recording
from stages.commands.draw import Drawings, draw_missing
from stages.views.blueprint import tabs_of
from tests.support.places import Told, poolcal
from tests.support.recordings import Chunks, placed, points, read, rows_in, text


def log_curve(chunks: list[Any], timeline: str) -> tuple[np.ndarray, list[Any]]:
    rows = [chunk for chunk in chunks if "Scalars:scalars" in chunk.schema.names]
    values = np.concatenate([np.ravel(chunk.column("Scalars:scalars").to_pylist()) for chunk in rows])
    return values, [moment for chunk in rows for moment in chunk.column(timeline).to_pylist()]


def test_every_point_is_there(drawn: Path) -> None:
    cloud = read(drawn, "georeference")
    assert len(points(cloud["/pool/laser"])) == rows_in(drawn / "georeference" / "laser_pool")
    assert len(points(cloud["/pool/soundings"])) == rows_in(drawn / "georeference" / "soundings_pool")
    assert {"/pool/trajectory/pass_0", "/pool/trajectory/pass_1"} <= cloud.keys()
    labelled = read(drawn, "segment")
    number = sum(len(points(labelled[f"/target/laser/{family}"])) for family in ("P1", "P2", "P3", "H"))
    assert number == rows_in(drawn / "segment" / "laser_labelled")
    assert "/pool" in labelled
    wall = points(labelled["/target/laser/P2"])
    assert np.abs(wall[:, 0]).max() < 0.06  # in the target's frame the wall is x = 0


def test_quality_over_time_is_the_trajectorys_and_the_bins(drawn: Path) -> None:
    found = read(drawn, "ingest")
    trajectory = pd.read_parquet(drawn / "ingest" / "trajectory.parquet")
    roll, times = log_curve(found["/quality/attitude/roll"], "time")
    step = -(-len(trajectory) // len(roll))
    shown = trajectory.iloc[::step]
    unbroken = np.isfinite(roll)
    np.testing.assert_allclose(roll[unbroken], np.degrees(shown["roll_rad"].to_numpy())[unbroken])
    breaks = np.diff(shown["t_ns"].to_numpy(), prepend=shown["t_ns"].iloc[0]) > 2e9
    assert unbroken[1:].tolist() == (~breaks)[1:].tolist()
    leap = 18  # GPS - UTC since 2017
    unix = shown["t_ns"].to_numpy() + (315_964_800 - leap) * 10**9
    assert [int(t.value) for t in pd.to_datetime(times)] == unix.tolist()
    bins = pd.read_parquet(drawn / "adjust" / "residual_bins.parquet").query("by == 'time' and sensor == 'mbes'")
    count, _ = log_curve(read(drawn, "adjust")["/quality/points/mbes"], "time")
    assert count.sum() == bins["count"].sum()
    files = text(found, "/tables/files")
    for name in pd.read_parquet(drawn / "ingest" / "files.parquet")["file"]:
        assert name in files


def test_planes_lie_on_the_planes(drawn: Path) -> None:
    found = read(drawn, "fit_planes")
    planes = pd.read_parquet(drawn / "fit_planes" / "planes.parquet").query("`pass` == -1")
    planes = planes.set_index(["sensor", "plane"])
    for sensor in ("laser", "mbes"):
        for family in ("P1", "P2", "P3"):
            (chunk,) = found[f"/planes/{sensor}/{family}"]
            corners = np.concatenate(chunk.column("LineStrips3D:strips").to_pylist()[0])
            plane = planes.loc[(sensor, family)]
            assert (np.sign(corners[:, 2].round(6)) * (1 if sensor == "laser" else -1) >= 0).all()  # the water is at 0
            normal = plane[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy(dtype=float)
            np.testing.assert_allclose(corners @ normal, plane["distance_m"], atol=1e-5)
            (chunk,) = found[f"/planes/{sensor}/{family}/normal"]
            np.testing.assert_allclose(chunk.column("Arrows3D:vectors").to_pylist()[0][0], normal, atol=1e-6)
    (chunk,) = found["/planes/mbes/P2/normal/name"]
    off_mm = float(re.findall(r"^P2: ([+-]\d+) mm$", chunk.column("Points3D:labels").to_pylist()[0][0])[0])
    sonar = planes.loc[("mbes", "P2")]
    assert off_mm == pytest.approx(1000 * -sonar["centroid_x_target_m"], abs=2.0)  # outward of the wall is -x


def test_before_after_residuals_maps_and_fans(drawn: Path) -> None:
    found = read(drawn, "adjust")
    residuals = pd.read_parquet(drawn / "adjust" / "residuals.parquet")
    faces = pd.read_parquet(drawn / "segment" / "faces.parquet")
    family = faces["family"].to_numpy()[residuals["face"]]
    surfaces = pd.read_parquet(drawn / "adjust" / "surfaces.parquet").set_index("family")
    for name in ("P1", "P2", "P3", "H"):
        rows = residuals[(residuals["sensor"] == "mbes") & (family == name)]
        for path, prefix in ((f"/before/{name}", "coarse_"), (f"/after/{name}", "")):
            expected = rows[[f"{prefix}{axis}_target_m" for axis in "xyz"]].to_numpy()
            np.testing.assert_array_equal(points(found[path]).reshape(-1, 3), expected)
        surface = surfaces.loc[name]
        normal = surface[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy(dtype=float)
        shown = points(found[f"/residuals/mbes/{name}"]).reshape(-1, 3)
        face = faces.loc[rows["face"]]
        height = (face["distance_m"] * face["normal_z_target_1"]).to_numpy() if name == "H" else 0.0
        off_m = shown @ normal - surface["distance_m"] - height  # on its surface, but for biases that are allowed for
        np.testing.assert_allclose(off_m, 0.0, atol=0.006)
    wall = np.abs(points(found["/before/P2"])[:, 0]).mean(), np.abs(points(found["/after/P2"])[:, 0]).mean()
    assert wall[0] > 3 * wall[1]
    cells = pd.read_parquet(drawn / "adjust" / "residual_map.parquet").query("sensor == 'mbes'")
    cells = cells[np.isfinite(cells["mean_m"]) & (cells["count"] >= 10)]
    for name in ("P1", "P2", "P3", "H"):
        if f"/maps/mbes/{name}" not in found:
            assert not (faces["family"].to_numpy()[cells["face"]] == name).any()
            continue
        (chunk,) = found[f"/maps/mbes/{name}"]
        corners = np.array(chunk.column("Mesh3D:vertex_positions").to_pylist()[0])
        rows = cells[(faces["family"].to_numpy()[cells["face"]] == name)]
        assert len(corners) == 4 * len(rows)
        lift = 0.01 * faces[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy()[rows["face"]]
        middles = corners.reshape(-1, 4, 3).mean(axis=1)
        np.testing.assert_allclose(middles, rows[[f"{axis}_target_m" for axis in "xyz"]].to_numpy() + lift, atol=1e-5)
        colours = np.array(chunk.column("Mesh3D:vertex_colors").to_pylist()[0], dtype=np.uint32)[::4]
        red, blue = colours >> 24, (colours >> 8) & 255
        far = np.abs(rows["mean_m"].to_numpy()) > 0.001
        assert ((red > blue) == (rows["mean_m"].to_numpy() > 0))[far].all()  # red is plus: toward the boat
    replay = pd.concat([chunk.to_pandas() for chunk in found["/replay/P2"]]).sort_values("iteration")
    first, last = (np.stack(replay["Points3D:positions"].iloc[k]) for k in (0, -1))
    assert np.abs(first[:, 0]).mean() == pytest.approx(wall[0], rel=0.05)
    assert np.abs(last[:, 0]).mean() == pytest.approx(wall[1], rel=0.2)
    rows = [row for chunk in found["/fans/mbes/pass_0"] for row in chunk.column("LineStrips3D:strips").to_pylist()]
    rays = [ray for row in rows for ray in row]
    lengths = np.linalg.norm(np.diff(np.array(rays), axis=1)[:, 0], axis=1)
    assert lengths.min() > residuals["range_m"].min() - 0.01
    assert lengths.max() < residuals["range_m"].max() + 0.01
    boat, head = (placed(found[f"/boat/pass_0{sensor}"]) for sensor in ("", "/head"))
    here = boat[0] + boat[1] @ head[0]  # the sonar's acoustic centre, where its rays begin
    assert np.linalg.norm(np.array(rays)[:, 0] - here, axis=1).min() < 0.02
    down = boat[1] @ head[1] @ [0.0, 0.0, -1.0]  # the middle of its fan looks down and to the target, which is at +x
    assert down[2] < -0.5
    assert down[0] > 0.5


def test_the_iteration_closes_the_planes(drawn: Path) -> None:
    found = read(drawn, "angle_iterate")
    iterations = pd.read_parquet(drawn / "angle_iterate" / "iterations.parquet")
    angles = {}
    for sensor in ("laser", "mbes"):
        chunks = found[f"/iteration/normals/{sensor}"]  # several, where the machine was slow
        turns, arrows = (
            [row for chunk in chunks for row in chunk.column(name).to_pylist()]
            for name in ("iteration", "Arrows3D:vectors")
        )
        assert turns == iterations["iteration"].tolist()
        angles[sensor] = np.array(arrows)
    between = np.degrees(np.arccos(np.clip(np.sum(angles["laser"] * angles["mbes"], axis=2), -1, 1)))
    assert between[0].max() > 0.3
    assert between[-1].max() < between[0].max() / 4
    for path, column in (("deviation/yaw", "deviation_yaw_deg"), ("planes/P3", "angle_P3_deg")):
        values, steps = log_curve(found[f"/curves/{path}"], "iteration")
        np.testing.assert_allclose(values, iterations[column])
        assert steps == iterations["iteration"].tolist()
    wall = found["/iteration/soundings/P2"]
    clouds = [row for chunk in wall for row in chunk.column("Points3D:positions").to_pylist()]
    first, last = (np.array(clouds[k])[:, 0].std() for k in (0, -1))
    assert len(clouds) == len(iterations)
    assert last < first / 1.5  # the wall's points swing into one plane
    turns = pd.read_parquet(drawn / "offsets" / "alternation.parquet")
    values, steps = log_curve(read(drawn, "offsets")["/curves/turns/offsets"], "iteration")
    np.testing.assert_allclose(10**values, 1000 * turns["step_m"], rtol=1e-9)
    assert steps == turns["iteration"].tolist()


def test_one_scene_a_run_and_sound_files(drawn: Path) -> None:
    ids = set()
    for stage in stages.views.recording.DRAWN:
        path = drawn / stage / f"{stage}.rrd"
        (entry,) = RrdReader(path).recordings()
        ids.add((entry.application_id, entry.recording_id))
        assert len(RrdReader(path).blueprints()) == 1
        command = [Path(sys.executable).with_name("rerun"), "rrd", "verify", path]
        assert subprocess.run(command, capture_output=True, check=False, timeout=60).returncode == 0
    assert len(ids) == 1
    assert ids != {("poolcal", stages.views.recording.recording_id(drawn.with_name("other")))}


def test_drawn_once_and_again_when_gone(drawn: Path) -> None:
    written = {path: path.stat().st_mtime_ns for path in drawn.glob("*/*.rrd")}
    (drawn / "segment" / "segment.rrd").unlink()
    assert draw_missing(drawn, Drawings(report=True, recordings=True)) == []
    changed = [path.stem for path, when in written.items() if path.stat().st_mtime_ns != when]
    assert changed == ["segment"]
    assert not list(drawn.rglob("*.partial"))
    assert poolcal("verify", drawn).status == 0


def test_a_sample_says_so(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from stages.views import georeference

    monkeypatch.setattr(georeference, "MOST_POINTS", 1000)
    (drawn / "georeference" / "georeference.rrd").unlink()
    assert draw_missing(drawn, Drawings(report=False, recordings=True)) == []
    (chunk,) = read(drawn, "georeference")["/pool/laser"]
    (step,) = chunk.column("one_in").to_pylist()[0]
    total = rows_in(drawn / "georeference" / "laser_pool")
    assert step == -(-total // 1000)
    assert len(points([chunk])) == -(-total // step)
    chunks = [c for chunks in read(drawn, "adjust").values() for c in chunks if "one_in" in c.schema.names]
    assert {tuple(one) for chunk in chunks for one in chunk.column("one_in").to_pylist()} == {(1,)}


def test_words_stay_words(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    """Names that would end a code block, load a picture or make a link stand inside the block as they are."""
    run = tmp_path / "run"
    shutil.copytree(undisturbed[0], run)
    name = "laser/``` ![x](http://example.com/x.png) <b>水</b>.las"
    path = run / "ingest" / "files.parquet"
    table = pq.read_table(path)
    names = table["file"].to_pylist()
    changed = table.set_column(table.schema.get_field_index("file"), table.schema.field("file"), [[name, *names[1:]]])
    pq.write_table(changed, path)
    assert draw_missing(run, Drawings(report=False, recordings=True)) == []
    written = text(read(run, "ingest"), "/tables/files")
    fence = written.split("text\n")[0]
    assert set(fence) == {"`"}
    assert len(fence) == 4
    assert written.endswith("\n" + fence)
    assert fence not in written[4:-4]
    assert name in written


def test_without_a_result_nothing_is_shown_as_calibrated(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(undisturbed[0], run)
    path = run / "adjust" / "estimate.parquet"
    table = pq.read_table(path)
    place = table.schema.get_field_index("value")
    pq.write_table(table.set_column(place, table.schema.field("value"), [[float("nan")] * len(table)]), path)
    assert draw_missing(run, Drawings(report=False, recordings=True)) == []
    found = read(run, "adjust")
    assert "/before/P2" in found
    assert not [name for name in found if name.startswith("/after")]


def test_two_runs_in_one_recording(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    run = tmp_path / "other"
    shutil.copytree(undisturbed[0], run)
    out = tmp_path / "both.rrd"
    assert poolcal("diff", undisturbed[0], run, "--rrd", out).status == 0
    found: Chunks = defaultdict(list)
    for chunk in RrdReader(out).stream():
        found[str(chunk.entity_path)].append(chunk.to_record_batch())
    np.testing.assert_array_equal(points(found["/a/after/P2"]), points(found["/b/after/P2"]))
    np.testing.assert_allclose(points(found["/both/a"]), points(found["/both/b"]), atol=1e-6)
    after = np.concatenate([points(found[f"/a/after/{family}"]) for family in ("P1", "P2", "P3", "H")])
    shown = points(found["/both/a"])
    np.testing.assert_allclose(shown[np.lexsort(shown.T)], after[np.lexsort(after.T)], atol=1e-5)  # the mount is a's
    assert "/pool/laser" not in found
    assert "The same result in both." in text(found, "/tables/comparison")
    assert "ACCEPTED" in text(found, "/b/tables/summary")
    told = poolcal("view", undisturbed[0], run, "--stage", "adjust")
    assert (told.status, "two runs are shown as a whole" in told.err) == (2, True)


def test_nothing_is_sent_of_curves_without_values() -> None:
    """From columns without rows the viewer makes a timeline without an end, and dies; one place alone sends columns."""
    sent: list[str] = []

    class Recording:
        def log(self, path: str, *_: Any, **__: Any) -> None:
            sent.append(path)

        def send_columns(self, path: str, **_: Any) -> None:
            sent.append(path)

    def times() -> Any:
        import rerun as rr

        return rr.TimeColumn("iteration", sequence=[0])

    stages.views.recording.log_curve(Recording(), "empty", None, times, np.empty(0))
    assert sent == []
    stages.views.recording.log_curve(Recording(), "one", None, times, np.zeros(1))
    assert sent == ["one", "one"]
    folder = Path(stages.views.recording.__file__).parent
    callers = [path.name for path in folder.glob("*.py") if ".send_columns(" in path.read_text(encoding="utf-8")]
    assert sorted(callers) == ["recording.py", "two_runs.py"]  # two_runs: hands on what it is given


def test_recordings_drawn_before_know_the_tabs_of_now(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    """Where the iteration has lost its result, no recording offers its tab any more."""
    run = tmp_path / "run"
    shutil.copytree(undisturbed[0], run)
    assert draw_missing(run, Drawings(report=False, recordings=True)) == []
    before = (run / "ingest" / "ingest.rrd").read_bytes()
    path = run / "angle_iterate" / "iterations.parquet"
    pq.write_table(pq.read_table(path).slice(0, 0), path)
    (run / "angle_iterate" / "angle_iterate.rrd").unlink()
    assert draw_missing(run, Drawings(report=False, recordings=True)) == []
    assert tabs_of(run) == ("Overview", "Before and after", "Residuals", "Quality")
    assert (run / "ingest" / "ingest.rrd").read_bytes() != before
