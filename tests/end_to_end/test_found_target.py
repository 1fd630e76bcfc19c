"""A config that says ``target: {kind: found}``: found once, remembered, and refused in one line where it cannot be."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from pipeline.config.found import DEPTH_M, Found
from pipeline.run.folder import FOUND
from pipeline.run.settings import RUN_YAML
from tests.support.docks import DOCK
from tests.support.places import Told, poolcal, simulate
from tests.support.refusals import one_line


@pytest.fixture(scope="module")
def dock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session at a wall with two returns."""
    folder = tmp_path_factory.mktemp("dock") / "session"
    return simulate(folder, **DOCK, track={"half_length_m": 6.0}, laser={"point_rate_hz": 8000.0})


def config(folder: Path, **more: Any) -> Path:
    file = folder / "pool.yaml"
    target = {"kind": "found"} | more
    file.write_text(yaml.safe_dump({"target": target}), encoding="utf-8")
    return file


def run(dock: Path, file: Path, folder: Path) -> Told:
    return poolcal("run", dock, "--config", file, "--run", folder, "--jobs", 1)


def begun(dock: Path, file: Path, folder: Path, jobs: int = 1) -> Told:
    """The first stage alone: before it the target is found, as before a whole run."""
    return poolcal("stage", "ingest", folder, "--session", dock, "--config", file, "--jobs", jobs)


def faces(folder: Path) -> dict[str, Any]:
    settings: dict[str, Any] = yaml.safe_load((folder / RUN_YAML).read_text(encoding="utf-8"))["config"]
    assert settings["as_built"]["offset_sigma_m"] == 0.02
    return dict(settings["target"]["faces"])


def test_it_is_found_once_and_again_when_what_it_depends_on_changes(dock: Path, tmp_path: Path) -> None:
    folders = [tmp_path / f"run-{jobs}" for jobs in (1, 2)]
    told = run(dock, config(tmp_path), folders[0])
    assert told.status in (0, 1), told.err
    assert told.ran[-1] == "report"
    assert "exchanged" not in told.out  # a found target has no left and right to be wrong
    calibration = json.loads((folders[0] / "report" / "calibration.json").read_text(encoding="utf-8"))
    assert "target_found" in calibration["warning_codes"]
    assert "wall-1, wall-2, wall-3" in told.out
    assert "could be adjusted" not in told.out  # walls tell no height, and yet labels are without the drift
    assert begun(dock, config(tmp_path), folders[1], jobs=2).ran == ["ingest"]
    for folder in folders:
        assert sorted(faces(folder)) == ["wall-1", "wall-2", "wall-3"]
    memories = [folder / FOUND for folder in folders]
    assert memories[0].read_bytes() == memories[1].read_bytes()

    def when() -> int:
        return memories[0].stat().st_mtime_ns

    before = when()
    told = run(dock, config(tmp_path), folders[0])
    assert (told.ran, when()) == ([], before)
    assert begun(dock, config(tmp_path, strike=["wall-3"]), folders[0]).status == 0  # no other target was found
    assert sorted(faces(folders[0])) == ["wall-1", "wall-2"]
    assert when() == before
    assert begun(dock, config(tmp_path, depth_m=3.0), folders[0]).status == 0
    assert when() > before
    assert min(corner[2] for corner in faces(folders[0])["wall-1"]["corners"]) == pytest.approx(-3.0, abs=0.1)


def test_a_mask_leaves_out_a_part_of_a_face_for_both_sensors(dock: Path, tmp_path: Path) -> None:
    """What is left of the points on wall-2 lies beyond the mask; all others are as they were.

    But for a few of no weight at edges: the adjusted sample lacks the masked points, which moves labels a little.
    """
    folder, mask = tmp_path / "run", {"along_m": [0.5, 1.5], "height_m": [-2.0, 1.0]}
    labels = []
    for masks in ({}, {"wall-2": [mask]}):
        file = config(tmp_path, masks=masks)
        told = poolcal("run", dock, "--config", file, "--run", folder, "--no-report", "--no-recordings")
        assert told.status in (0, 1), told.err
        labels.append({
            name: pd.read_parquet(folder / "segment" / name) for name in ("laser_labelled", "soundings_labelled")
        })  # fmt: skip
    names = pd.read_parquet(folder / "segment" / "faces.parquet").set_index("name")
    wall = names.index.get_loc("wall-2")
    whole, masked = (one["laser_labelled"] for one in labels)
    lost = whole.merge(masked, on="t_ns", how="left", indicator=True, suffixes=("", "_"))
    lost = lost[lost["_merge"] == "left_only"]
    right, height = -lost["y_target_m"], lost["z_target_m"]  # the wall looks to -x, its middle is the origin
    behind = (lost["face"] == wall) & right.between(0.3, 1.7) & height.between(0.0, 1.2)
    assert behind.sum() > 300
    assert (~behind).sum() < 20
    assert (lost.loc[~behind, "edge_weight"] < 0.05).all()
    left = masked[masked["face"] == wall]
    assert not ((-left["y_target_m"]).between(0.55, 1.45) & left["z_target_m"].between(-2.0, 0.95)).any()
    soundings = [int((one["soundings_labelled"]["face"] == wall).sum()) for one in labels]
    assert 0.6 < soundings[1] / soundings[0] < 0.95
    counts = pd.read_parquet(folder / "segment" / "counts.parquet")
    assert (counts.loc[counts["reason"] == "masked", "count"] > 100).sum() == 2


@pytest.mark.parametrize("damaged", ["", "[1]", '{"key": "', '{"key": 1, "found": {}}'])
def test_a_damaged_memory_is_none(dock: Path, tmp_path: Path, damaged: str) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / FOUND).write_text(damaged, encoding="utf-8")
    told = begun(dock, config(tmp_path), folder)
    assert told.status == 0, told.err
    assert set(json.loads((folder / FOUND).read_text(encoding="utf-8"))) == {"key", "found"}


def test_what_says_nothing_true_is_refused(dock: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    unknown = config(tmp_path, strike=["wall-1", "wall-9"])
    one_line(run(dock, unknown, folder), "target.strike", "'wall-9'", "wall-1, wall-2, wall-3")
    everything = config(tmp_path, strike=["wall-1", "wall-2", "wall-3"])
    one_line(run(dock, everything, folder), "target.strike", "no face is left")
    one_line(run(dock, config(tmp_path, depth_m=-4), folder), "target.depth_m")
    for name, mask, words in (
        ("wall-9", {"along_m": [0.0, 1.0]}, "target.masks: 'wall-9': no such face was found, but wall-1, wall-2"),
        ("wall-1", {"along_m": [1.0, 0.0]}, "along_m: [1, 0]: the first must be the smaller one"),
        ("wall-1", {}, "needs along_m, height_m, or both; to leave out the whole face, strike it"),
    ):
        one_line(run(dock, config(tmp_path, masks={name: [mask]}), folder), "target.masks", words)
    one_line(run(dock, config(tmp_path, faces={}), folder), "target.faces")
    assert begun(dock, config(tmp_path), folder).status == 0  # the folder is as good as new
    one_line(run(dock, config(tmp_path), dock / "run"), "lies in the session folder")
    assert not (dock / "run").exists()


def test_a_command_and_a_config_have_the_same_depth() -> None:
    assert Found(kind="found").depth_m == DEPTH_M
    assert f"default: {DEPTH_M:g}" in poolcal("target", "--help").out


def test_before_anything_is_sailed_there_is_nothing_to_find(dock: Path, tmp_path: Path) -> None:
    plan = tmp_path / "plan.yaml"
    plan.write_text("passes: [{distance_m: 5}]\n", encoding="utf-8")
    told = poolcal("plan", plan, "--session", dock, "--config", config(tmp_path))
    one_line(told, "target.kind", "poolcal target")


def test_a_check_finds_the_target_too(dock: Path, tmp_path: Path) -> None:
    told = poolcal("check", dock, "--config", config(tmp_path))
    assert told.status == 0, told.out
    for face in ("wall-1", "wall-2", "wall-3"):
        assert f"\n{face} " in told.out  # soundings expected and found on it


def test_a_laser_is_not_calibrated_on_what_it_saw_itself(dock: Path, tmp_path: Path) -> None:
    """Its own error is in the planes: they would confirm any coarse mount."""
    folder, written = tmp_path / "run", tmp_path / "wall.yaml"
    one_line(poolcal("laser", dock, "--config", config(tmp_path), "--run", folder), "target", "surveyed")
    assert poolcal("target", dock, "--out", written).status == 0
    one_line(poolcal("laser", dock, "--config", written, "--run", folder), "target", "surveyed")
    assert not folder.exists()
