"""Recordings: drawn from Parquet, read back with the SDK, and never in the way of a calibration."""

import errno
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from rerun.chunk import RrdReader

import stages.painter
import stages.views
from pipeline.folder import locked
from pipeline.streams import serial
from stages import ORDER
from stages.drawing import Painters, Prepared, paint, painters
from tests.end_to_end.places import Place, Told, digests, poolcal

Chunks = dict[str, list[Any]]
MARK = f"STARTED_BY_TEST_{os.getpid()}"


@pytest.fixture(autouse=True)
def marked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(MARK, "yes")


def painting() -> list[Path]:
    """The processes that draw, of those started by these tests, wherever they hang."""
    return [place for place in Path("/proc").glob("[0-9]*") if _draws(place)]


def assert_all_end() -> None:
    """What was told to end takes a moment."""
    deadline = time.monotonic() + 10
    while painting() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not painting()


def _draws(process: Path) -> bool:
    try:
        words, given = (process / "cmdline").read_bytes(), (process / "environ").read_bytes()
    except OSError:  # gone, or not ours
        return False
    return b"stages.painter" in words and MARK.encode() in given


@pytest.fixture(scope="module")
def drawn(undisturbed: tuple[Path, Told], tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("drawn") / "水池 <b>1</b>"
    shutil.copytree(undisturbed[0], run)
    assert Painters(report=True, recordings=True).draw(run) == []
    assert sorted(path.stem for path in run.glob("*/*.rrd")) == sorted(ORDER)
    return run


def read(run: Path, stage: str) -> Chunks:
    found: Chunks = defaultdict(list)
    for chunk in RrdReader(run / stage / f"{stage}.rrd").stream():
        found[str(chunk.entity_path)].append(chunk.to_record_batch())
    return found


def rows_in(path: Path) -> int:
    return sum(len(pd.read_parquet(part)) for part in path.glob("part-*.parquet"))


def points(chunks: list[Any]) -> np.ndarray:
    lists = [row for chunk in chunks for row in chunk.column("Points3D:positions").to_pylist()]
    return np.array([point for row in lists for point in row])


def curve(chunks: list[Any], timeline: str) -> tuple[np.ndarray, list[Any]]:
    rows = [chunk for chunk in chunks if "Scalars:scalars" in chunk.schema.names]
    values = np.concatenate([np.ravel(chunk.column("Scalars:scalars").to_pylist()) for chunk in rows])
    return values, [moment for chunk in rows for moment in chunk.column(timeline).to_pylist()]


def text(found: Chunks, path: str) -> str:
    (chunk,) = found[path]
    ((written,),) = chunk.column("TextDocument:text").to_pylist()
    return str(written)


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
    roll, times = curve(found["/quality/attitude/roll"], "time")
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
    count, _ = curve(read(drawn, "adjust")["/quality/points/mbes"], "time")
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
            corners = np.array(chunk.column("Mesh3D:vertex_positions").to_pylist()[0])
            plane = planes.loc[(sensor, family)]
            normal = plane[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy(dtype=float)
            np.testing.assert_allclose(corners @ normal, plane["distance_m"], atol=1e-5)
            (chunk,) = found[f"/planes/{sensor}/{family}/normal"]
            np.testing.assert_allclose(chunk.column("Arrows3D:vectors").to_pylist()[0][0], normal, atol=1e-6)


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
        np.testing.assert_allclose(shown @ normal, surface["distance_m"] + height, atol=5e-6)  # on its surface
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
    rows = [row for chunk in found["/fans/mbes/pass_0"] for row in chunk.column("LineStrips3D:strips").to_pylist()]
    rays = [ray for row in rows for ray in row]
    lengths = np.linalg.norm(np.diff(np.array(rays), axis=1)[:, 0], axis=1)
    assert lengths.min() > residuals["range_m"].min() - 0.01
    assert lengths.max() < residuals["range_m"].max() + 0.01


def test_the_iteration_closes_the_planes(drawn: Path) -> None:
    found = read(drawn, "angle_iterate")
    iterations = pd.read_parquet(drawn / "angle_iterate" / "iterations.parquet")
    angles = {}
    for sensor in ("laser", "mbes"):
        (chunk,) = found[f"/iteration/normals/{sensor}"]
        assert chunk.column("iteration").to_pylist() == iterations["iteration"].tolist()
        angles[sensor] = np.array(chunk.column("Arrows3D:vectors").to_pylist())
    between = np.degrees(np.arccos(np.clip(np.sum(angles["laser"] * angles["mbes"], axis=2), -1, 1)))
    assert between[0].max() > 0.3
    assert between[-1].max() < between[0].max() / 4
    for path, column in (("deviation/yaw", "deviation_yaw_deg"), ("planes/P3", "angle_P3_deg")):
        values, steps = curve(found[f"/curves/{path}"], "iteration")
        np.testing.assert_allclose(values, iterations[column])
        assert steps == iterations["iteration"].tolist()
    wall = found["/iteration/soundings/P2"]
    clouds = [row for chunk in wall for row in chunk.column("Points3D:positions").to_pylist()]
    first, last = (np.array(clouds[k])[:, 0].std() for k in (0, -1))
    assert len(clouds) == len(iterations)
    assert last < first / 1.5  # the wall's points swing into one plane
    turns = pd.read_parquet(drawn / "offsets" / "alternation.parquet")
    values, steps = curve(read(drawn, "offsets")["/curves/turns/offsets"], "iteration")
    np.testing.assert_allclose(10**values, 1000 * turns["step_m"], rtol=1e-9)
    assert steps == turns["iteration"].tolist()


def test_one_scene_a_run_and_sound_files(drawn: Path) -> None:
    ids = set()
    for stage in stages.views.DRAWN:
        path = drawn / stage / f"{stage}.rrd"
        (entry,) = RrdReader(path).recordings()
        ids.add((entry.application_id, entry.recording_id))
        assert len(RrdReader(path).blueprints()) == 1
        command = [Path(sys.executable).with_name("rerun"), "rrd", "verify", path]
        assert subprocess.run(command, capture_output=True, check=False, timeout=60).returncode == 0
    assert len(ids) == 1
    assert ids != {("poolcal", stages.views.recording_id(drawn.with_name("other")))}


def test_drawn_once_and_again_when_gone(drawn: Path) -> None:
    written = {path: path.stat().st_mtime_ns for path in drawn.glob("*/*.rrd")}
    (drawn / "segment" / "segment.rrd").unlink()
    assert Painters(report=True, recordings=True).draw(drawn) == []
    changed = [path.stem for path, when in written.items() if path.stat().st_mtime_ns != when]
    assert changed == ["segment"]
    assert not list(drawn.rglob("*.partial"))
    assert poolcal("verify", drawn).status == 0


def test_a_sample_says_so(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from stages.views import georeference

    monkeypatch.setattr(georeference, "AT_MOST", 1000)
    (drawn / "georeference" / "georeference.rrd").unlink()
    assert Painters(report=False, recordings=True).draw(drawn) == []
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
    assert Painters(report=False, recordings=True).draw(run) == []
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
    assert Painters(report=False, recordings=True).draw(run) == []
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
    assert "the same result in both." in text(found, "/tables/comparison")
    assert "ACCEPTED" in text(found, "/b/tables/summary")
    told = poolcal("view", undisturbed[0], run, "--stage", "adjust")
    assert (told.status, "two runs are shown as a whole" in told.err) == (2, True)


def test_the_viewer_listens_on_this_machine_alone(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[list[str]] = []

    def run(command: list[object], **_: object) -> subprocess.CompletedProcess[str]:
        called.append([str(word) for word in command])
        return subprocess.CompletedProcess([], 0)

    monkeypatch.setattr(subprocess, "run", run)
    assert poolcal("view", drawn).status == 0
    assert poolcal("view", drawn, drawn).status == 0
    assert poolcal("view", drawn, "--stage", "adjust").status == 0
    whole, pair, one = called
    assert all(words[1:3] == ["--bind", "127.0.0.1"] for words in called)
    assert len(whole) == 3 + len(ORDER)
    assert len(pair) == 4
    assert one[3:] == [str(drawn / "adjust" / "adjust.rrd")]


def test_a_failure_to_draw_spoils_nothing(place: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason on one line; a bug keeps its traceback as well."""
    for error, traced in ((OSError("no room\nfor pictures"), False), (ValueError("no room\nfor pictures"), True)):

        def fails(run: Path, stage: str, error: Exception = error) -> bool:
            raise error

        monkeypatch.setattr(stages.views, "record", fails)
        told = place.calibrate("--recordings")
        assert told.status == 0
        last = f"recordings: not drawn ({type(error).__name__}: no room); the calibration is complete"
        assert told.complaints[-1] == last
        assert ("Traceback" in told.err) == traced
        assert (len(told.complaints) > 1) == traced
        assert digests(place.run) == right


def test_painters_beside_the_run(place: Place, right: dict[str, str], drawn: Path) -> None:
    """With two workers the pictures come from processes of their own: the same ones, and no process stays behind."""
    told = poolcal(*place.words()[:-1], 2, "--report", "--recordings")
    assert told.status == 0
    assert told.complaints == []
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)
    one, other = (re.findall("<img .*?>", (run / "report" / "report.html").read_text()) for run in (place.run, drawn))
    assert one == other
    assert len(one) == 7
    assert digests(place.run) == right
    assert_all_end()
    here, there = (read(run, "adjust")["/after/P2"] for run in (place.run, drawn))
    np.testing.assert_array_equal(points(here), points(there))


def test_nothing_is_started_where_nothing_is_to_be_drawn(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    assert place.calibrate("--report", "--recordings").status == 0
    monkeypatch.setattr(subprocess, "Popen", None)
    assert poolcal(*place.words()[:-1], 2, "--report", "--recordings").complaints == []


def test_recordings_are_prepared_as_stages_finish_and_written_after_the_verdict(place: Place) -> None:
    """So that they never take the room on the disk that a stage needs."""
    assert place.calibrate().status == 0
    with painters(report=True, recordings=True, beside=True) as found:
        for stage in ORDER:
            found.begin(place.run, stage)
        time.sleep(2.0)  # long enough to have prepared some
        assert not list(place.run.glob("*/*.rrd"))
        assert not (place.run / "report" / "report.html").exists()
        assert found.draw(place.run) == []
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)
    assert (place.run / "report" / "report.html").is_file()


def test_what_was_prepared_is_written_only_beside_the_tables_that_it_shows(place: Place) -> None:
    assert place.calibrate().status == 0
    shown = (place.run / "ingest" / "manifest.json").read_bytes()
    current, stale = Prepared(shown, b"prepared"), Prepared(shown + b" ", b"of tables that are gone")
    assert paint(place.run, ["ingest", "offsets"], prepared={"ingest": current, "offsets": stale}) == []
    assert (place.run / "ingest" / "ingest.rrd").read_bytes() == b"prepared"
    assert "/curves/turns/angles" in read(place.run, "offsets")


def test_what_fails_while_stages_run_is_drawn_after_them(place: Place) -> None:
    with painters(report=False, recordings=True, beside=True) as found:
        found.begin(place.run, "georeference")  # not there yet
        assert place.calibrate().status == 0
        assert found.draw(place.run) == []
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)


def test_a_painter_that_dies_is_said(place: Place) -> None:
    assert place.calibrate().status == 0
    with painters(report=True, recordings=True, beside=True) as found:
        found.begin(place.run, "adjust")
        assert found._process is not None
        found._process.kill()
        failed = found.draw(place.run)
    assert_all_end()
    assert [(one.what, one.trace) for one in failed] == [("report.html and recordings", "")]
    assert not list(place.run.rglob("*.new"))
    assert not list(place.run.rglob("*.partial"))


@pytest.mark.parametrize("wait_s", [0.0, 0.3, 1.0])
def test_without_its_copies_it_draws_all_the_same(place: Place, wait_s: float) -> None:
    """They may be killed at any moment, by a system short of memory: while they load, or with a picture half done."""
    assert place.calibrate().status == 0
    with painters(report=True, recordings=True, beside=True) as found:
        found.begin(place.run, "georeference")
        deadline = time.monotonic() + 60
        while len(copies := _children(found)) < 2 and time.monotonic() < deadline:
            time.sleep(0.005)
        time.sleep(wait_s)
        for copy in copies:
            os.kill(copy, signal.SIGKILL)
        assert found.draw(place.run) == []
    assert (place.run / "report" / "report.html").is_file()
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)


@pytest.mark.parametrize("wait_s", [0.0, 0.001, 0.01])
def test_a_painter_killed_while_it_forks_leaves_nothing(place: Place, wait_s: float) -> None:
    assert place.calibrate().status == 0
    with painters(report=True, recordings=True, beside=True) as found:
        found.begin(place.run, "georeference")
        assert found._process is not None
        deadline = time.monotonic() + 60
        while not _children(found) and time.monotonic() < deadline:
            pass
        time.sleep(wait_s)
        found._process.kill()
        assert [one.trace for one in found.draw(place.run)] == [""]
    assert_all_end()


def test_no_shared_memory_no_copies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a pool of processes cannot be made the process draws alone."""

    def none(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(stages.painter, "ProcessPoolExecutor", none)
    assert stages.painter._others() is serial


def _children(found: Painters) -> list[int]:
    assert found._process is not None
    place = Path(f"/proc/{found._process.pid}/task/{found._process.pid}/children")
    return [int(word) for word in place.read_text().split()]


def test_nothing_stays_behind_of_a_killed_run(place: Place) -> None:
    command = [Path(sys.executable).with_name("poolcal"), *map(str, place.words()[:-1]), "2"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while len(painting()) < 3 and time.monotonic() < deadline:  # loaded, and with its copies
            time.sleep(0.01)
        assert len(painting()) == 3
        process.kill()
    assert_all_end()


def test_nothing_in_the_working_directory_is_run(place: Place) -> None:
    """Neither code nor settings of a folder that came from somewhere."""
    for name in ("numpy.py", "rerun.py", "matplotlib.py"):
        (place.folder / name).write_text("open('run by mistake', 'w').write('x')\n")
    (place.folder / "matplotlibrc").write_text("text.usetex: True\n")
    command = [Path(sys.executable).with_name("poolcal"), *map(str, place.words()[:-1]), "2"]
    done = subprocess.run(command, cwd=place.folder, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    assert "not drawn" not in done.stderr
    assert (place.run / "report" / "report.html").is_file()
    assert len(list(place.run.glob("*/*.rrd"))) == len(ORDER)
    assert not (place.folder / "run by mistake").exists()


def test_a_full_disk_is_one_line_and_no_stump(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    assert place.calibrate().status == 0

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    failed = Painters(report=False, recordings=True).draw(place.run)
    assert [one.trace for one in failed] == [""]
    assert "make room" in failed[0].reason
    assert not [path for path in place.run.rglob("*") if path.suffix in (".rrd", ".new", ".partial")]


def test_no_room_for_another_process(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr(subprocess, "Popen", none)
    assert poolcal(*place.words()[:-1], 2, "--report", "--recordings").complaints == []
    assert (place.run / "report" / "report.html").is_file()


def test_nothing_missing_nothing_said(place: Place) -> None:
    """A folder that is in use, or that cannot be written, is looked at all the same."""
    assert place.calibrate("--recordings").status == 0
    with locked(place.run, ORDER):
        assert Painters(report=False, recordings=True).draw(place.run) == []
        (place.run / "adjust" / "adjust.rrd").unlink()
        (failed,) = Painters(report=False, recordings=True).draw(place.run)
    assert "is in use" in failed.reason


def test_a_mistyped_run_is_refused_and_not_made(place: Place) -> None:
    told = poolcal("view", place.folder / "typo")
    assert (told.status, len(told.err.splitlines())) == (2, 1)
    assert not (place.folder / "typo").exists()


def test_none_when_not_wanted(place: Place) -> None:
    assert place.calibrate("--no-recordings").status == 0
    assert not list(place.run.rglob("*.rrd"))
    assert poolcal("view", place.folder / "nowhere").status == 2
    told = poolcal("view", place.run, "--stage", "../elsewhere")
    assert (told.status, "is no stage" in told.err) == (2, True)
