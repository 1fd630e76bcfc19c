"""Recordings: drawn from Parquet, read back with the SDK, and never in the way of a calibration."""

import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rerun.chunk import RrdReader

import stages.views
from tests.end_to_end.places import Place, Told, digests, poolcal

Chunks = dict[str, list[Any]]


@pytest.fixture(scope="module")
def drawn(undisturbed: tuple[Path, Told], tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("drawn") / "水池 <b>1</b>"
    shutil.copytree(undisturbed[0], run)
    assert stages.views.draw(run) == list(stages.views.DRAWN)
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
    curve = np.concatenate([c.column("Scalars:scalars").to_pylist() for c in found["/curves/deviation/yaw"]]).ravel()
    np.testing.assert_allclose(curve, iterations["deviation_yaw_deg"])


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
    assert stages.views.draw(drawn) == []
    (drawn / "segment" / "segment.rrd").unlink()
    assert stages.views.draw(drawn) == ["segment"]
    assert not list(drawn.rglob("*.partial"))
    assert poolcal("verify", drawn).status == 0


def test_a_sample_says_so(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from stages.views import georeference

    monkeypatch.setattr(georeference, "AT_MOST", 1000)
    (drawn / "georeference" / "georeference.rrd").unlink()
    stages.views.draw(drawn)
    (chunk,) = read(drawn, "georeference")["/pool/laser"]
    (step,) = chunk.column("one_in").to_pylist()[0]
    total = rows_in(drawn / "georeference" / "laser_pool")
    assert step == -(-total // 1000)
    assert len(points([chunk])) == -(-total // step)


def test_a_failure_to_draw_spoils_nothing(place: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason on one line; a bug keeps its traceback as well."""
    for error, traced in ((OSError("no room\nfor pictures"), False), (ValueError("no room\nfor pictures"), True)):

        def fails(run: Path, error: Exception = error) -> list[str]:
            raise error

        monkeypatch.setattr(stages.views, "draw", fails)
        told = place.calibrate("--recordings")
        assert told.status == 0
        last = f"recordings: not drawn ({type(error).__name__}: no room); the calibration is complete"
        assert told.complaints[-1] == last
        assert ("Traceback" in told.err) == traced
        assert (len(told.complaints) > 1) == traced
        assert digests(place.run) == right


def test_none_when_not_wanted(place: Place) -> None:
    assert place.calibrate("--no-recordings").status == 0
    assert not list(place.run.rglob("*.rrd"))
    assert poolcal("view", place.folder / "nowhere").status == 2
    told = poolcal("view", place.run, "--stage", "../elsewhere")
    assert (told.status, "is no stage" in told.err) == (2, True)
