"""poolcal diff: a run with itself, with other settings, a moved sonar, whose errors count how, nothing comparable."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.results.diff_text import own_faces_counted
from tests.support.places import Place, Told, poolcal, simulate


def compared(first: Path, second: Path, *more: object) -> tuple[int, dict[str, Any]]:
    told = poolcal("diff", first, second, "--json", *more)
    assert told.err == ""
    return told.status, json.loads(told.out)


def run_of(session: Path) -> Path:
    run = session.with_name(session.name + ".run")
    told = poolcal("run", session, "--config", session / "pool.yaml", "--run", run, "--jobs", 1)
    assert told.status in (0, 1), told.err
    return run


@pytest.fixture(scope="module")
def wider(small: Path, undisturbed: tuple[Path, Told], tmp_path_factory: pytest.TempPathFactory) -> Place:
    """The small session with another margin. Nobody changes it."""
    place = Place(small, tmp_path_factory.mktemp("wider"))
    place.mend()
    shutil.copytree(undisturbed[0], place.run)
    place.edit_config("segment", margin_m=0.05)
    place.edit_session("about", vessel="Haice 7")  # is no setting that a result depends on
    assert place.calibrate().status == 0
    return place


def test_with_itself_nothing(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    status, found = compared(run, run, "--tolerance-deg", 0, "--tolerance-mm", 0)
    assert status == 0
    for key in ("config", "inputs", "software", "counts", "planes", "not_compared", "beyond_tolerance"):
        assert found[key] == [], key
    assert not any(row["difference"] for row in found["parameters"])
    assert found["joint"]["probability"] == 1.0
    told = poolcal("diff", run, run)
    assert told.status == 0
    assert told.out.splitlines()[:2] == ["The same result in both.", ""]


def test_other_settings_are_named(undisturbed: tuple[Path, Told], wider: Place) -> None:
    status, found = compared(undisturbed[0], wider.run)
    assert status == 0, found["sentence"]
    assert found["config"] == [{"key": "segment.margin_m", "a": 0.015, "b": 0.05}]
    assert found["inputs"] == []
    assert {row["stage"] for row in found["counts"]} == {"segment"}
    assert found["planes"]
    assert found["answer"] == "no_movement_shown"  # of the same raw files, whatever could be seen
    assert found["sentence"].startswith("no movement shown: all six differences are within their errors")
    assert "both runs are of the same raw files, with the same noise" in found["sentence"]
    assert found["visible"] == ""
    largest = max(abs(row["difference"]) for row in found["parameters"] if row["unit"] == "deg")
    for factor, expected in ((0.99, 1), (1.01, 0)):
        status, found = compared(undisturbed[0], wider.run, "--tolerance-deg", largest * factor)
        assert (status, bool(found["beyond_tolerance"])) == (expected, bool(expected))


def test_a_sonar_that_moved_is_found_and_named_another_day(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    """A movement of what can be seen without a cast is told apart from the water's layers; the answer comes first."""
    moved = {"roll_deg": -48.55, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.316, "y_m": 0.20, "z_m": -2.01}
    run = run_of(simulate(tmp_path / "session", 2, mbes={"mount": moved, "ping_rate_hz": 8.0}))
    status, found = compared(undisturbed[0], run)
    assert (status, found["answer"]) == (1, "moved")
    rows = {row["parameter"]: row for row in found["parameters"]}
    assert rows["roll"]["difference"] == pytest.approx(0.25, abs=0.025)
    assert rows["lever arm x"]["difference"] == pytest.approx(0.016, abs=0.003)
    assert [name for name, row in rows.items() if row["moved"]] == ["roll", "lever arm x"]
    assert "roll by +0.2" in found["sentence"]
    assert "lever arm x by +" in found["sentence"]
    assert "the rest within its errors" in found["sentence"]
    lines = poolcal("diff", undisturbed[0], run).out.splitlines()
    assert lines[0].startswith("The sonar has moved, roll by +0.2")
    assert lines[1].startswith("Found with a probability of 95 %, whatever moves beside it: roll 0.")
    assert rows["roll"]["mostly"] == "change of the sound speed with depth"
    assert all(row["detectable"] >= row["detectable_alone"] > row["sigma"] for row in rows.values())
    assert {"mbes_latency", "sound_speed", "sound_speed_gradient", "laser_latency"} <= set(found["errors"]["own"])
    assert {"laser_rotation_x", "mbes_range", "wet_P2_shift"} <= set(found["errors"]["common"])
    assert not found["errors"]["differing"]


def test_what_it_cannot_see_it_says(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    """The same truth on another day: neither moved nor shown to stay, until the tolerance admits what is unseen."""
    run = run_of(simulate(tmp_path / "session", 2))
    status, found = compared(undisturbed[0], run)
    assert (status, found["answer"]) == (0, "too_uncertain")
    unseen = {row["parameter"]: row["mostly"] for row in found["parameters"] if row["uncertain"]}
    assert unseen["roll"] == "change of the sound speed with depth"
    assert all(row["uncertain"] == (row["detectable"] > row["limit"]) for row in found["parameters"])
    assert found["sentence"].startswith("too uncertain to say: all six differences are within their errors")
    for name, source in unseen.items():
        assert f" in {name}" in found["sentence"].partition("may be hidden in them")[0]
        assert source in found["sentence"].partition("most of the uncertainty")[2]
    status, found = compared(undisturbed[0], run, "--tolerance-deg", 0.5, "--tolerance-mm", 80)
    assert (status, found["answer"]) == (0, "no_movement_shown")
    assert "same raw files" not in found["sentence"]


def test_another_mount_of_the_laser_and_another_target_share_nothing(
    undisturbed: tuple[Path, Told], done: Place
) -> None:
    """Their errors are then each session's own, which is told, and the sigmas are larger."""
    _, before = compared(undisturbed[0], done.run)
    done.edit_session("laser", mount={"x_m": 0.212})
    done.edit_config("as_built", offset_sigma_m=0.0012)
    assert done.calibrate().status == 0
    status, found = compared(undisturbed[0], done.run)
    assert found["errors"]["differing"] == ["the laser's mount", "the target"]
    notes = poolcal("diff", undisturbed[0], done.run).out
    assert "The laser's mount is not the same in both: its errors were counted as each session's own." in notes
    assert "laser_lever_arm_x" in found["errors"]["own"]
    x = [next(row for row in one["parameters"] if row["parameter"] == "lever arm x") for one in (before, found)]
    effect = 0.0015**2 * 2  # of the laser's lever arm, in either session; wet faces come on top
    assert x[1]["sigma"] ** 2 - x[0]["sigma"] ** 2 > effect
    assert x[1]["sigma"] ** 2 - x[0]["sigma"] ** 2 < 4 * effect
    assert (status, x[1]["difference"]) == (0, pytest.approx(0.002, abs=0.0005))  # the sonar follows the laser


def test_a_result_of_an_older_version_is_compared_with_caution(done: Place) -> None:
    path = done.run / "report" / "calibration.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    whole = np.sqrt(2 * np.diag(content["mbes"]["covariance_total"]))
    del content["systematic"], content["limits"]
    path.write_text(json.dumps(content), encoding="utf-8")
    status, found = compared(done.run, done.run)
    assert (status, found["errors"]["cautious"]) == (0, True)
    x = next(row for row in found["parameters"] if row["parameter"] == "lever arm x")
    assert x["sigma"] == pytest.approx(whole[3], rel=1e-9)
    assert "poolcal run again makes the test sharper" in poolcal("diff", done.run, done.run).out


@pytest.mark.thorough
def test_another_target_compares_the_mount_alone(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    origin = {"latitude_deg": 36.1, "longitude_deg": 120.3, "height_m": 20.0}
    target = {"a": 6.0, "b": 2.4, "c": 0.8, "e": 0.4, "azimuth_deg": 30.0, "origin": origin}
    run = run_of(simulate(tmp_path / "session", 3, target=target))
    status, found = compared(undisturbed[0], run)
    assert status == 0, found["sentence"]
    assert found["errors"]["differing"] == ["the target"]
    assert found["planes"] == []
    assert found["not_compared"] == ["planes: the targets differ (target.a, target.b, target.c, target.e)"]
    assert found["joint"]["probability"] > 0.01


def test_faces_of_one_run_alone_are_counted_and_others_are_listed() -> None:
    rows: list[dict[str, Any]] = [
        {"key": "target.faces.foot.corners", "a": None, "b": [[0, 0, 0]]},
        {"key": "target.faces.foot.seen", "a": None, "b": "wet"},
        {"key": "target.faces.foot-2.corners", "a": [[0, 0, 0]], "b": [[0, 0, 1]]},
        {"key": "target.faces.wall.role", "a": None, "b": "P2"},
    ]
    kept, told = rows[2:], {"key": "target.faces", "a": "0 faces of its own", "b": "1 face of its own"}
    assert list(own_faces_counted(rows)) == [*kept, told]
    assert list(own_faces_counted(kept)) == kept


def test_a_rejected_run_answers_nothing(undisturbed: tuple[Path, Told], wider: Place, place: Place) -> None:
    """Its values must not be used, so they say neither yes nor no; unless they are the same."""
    shutil.copytree(wider.run, place.run)
    shutil.copy(wider.config, place.config)
    place.edit_config("verdict", max_sigma_deg=1e-6)
    assert place.calibrate().status == 1
    status, found = compared(undisturbed[0], place.run)
    assert (status, found["answered"]) == (1, False)
    assert found["sentence"].startswith("no answer: b (2026-05-12_small) was rejected")
    status, found = compared(place.run, place.run)
    assert (status, found["answered"]) == (0, True)
    assert found["sentence"].startswith("the same result in both; a (")


def test_a_folder_that_is_no_run_is_refused(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    assert "there is no such folder" in poolcal("diff", undisturbed[0], tmp_path / "nowhere").err
    told = poolcal("diff", undisturbed[0], tmp_path)
    assert told.status == 2
    assert "no complete result" in told.err
    assert len(told.err.splitlines()) == 1


@pytest.mark.parametrize("key", ["mbes", "methods", "inputs", "software", "session", "passes", "target", "geometry"])
def test_a_crafted_result_is_one_line(done: Place, key: str, tmp_path: Path) -> None:
    """Whatever the comparison, its page or its recording would take out of it."""
    path = done.run / "report" / "calibration.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    del content[key]
    path.write_text(json.dumps(content if key in ("session", "inputs") else content | {key: 3}), encoding="utf-8")
    told = poolcal("diff", done.run, done.run, "--rrd", tmp_path / "pair.rrd")
    assert told.status == 2
    assert told.err == f"poolcal: {done.run}: its calibration.json is not as poolcal writes it; run it again\n"
    assert not (tmp_path / "pair.rrd").exists()
