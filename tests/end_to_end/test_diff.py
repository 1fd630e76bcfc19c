"""poolcal diff: a run with itself, with other settings, with a moved sonar, and where nothing can be compared."""

import json
from pathlib import Path
from typing import Any

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


@pytest.fixture
def again(place: Place) -> Place:
    """The small session in a run folder of one's own."""
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
    assert told.out.splitlines()[-1] == "the same result in both."


def test_other_settings_are_named(undisturbed: tuple[Path, Told], again: Place) -> None:
    again.edit_config("segment", margin_m=0.05)
    assert again.calibrate().status == 0
    status, found = compared(undisturbed[0], again.run)
    assert status == 0, found["sentence"]
    assert found["config"] == [{"key": "segment.margin_m", "a": 0.03, "b": 0.05}]
    assert found["inputs"] == []
    assert {row["stage"] for row in found["counts"]} == {"segment"}
    assert found["planes"]
    assert "within their noise" in found["sentence"]
    largest = max(abs(row["difference"]) for row in found["parameters"] if row["unit"] == "deg")
    for factor, expected in ((0.99, 1), (1.01, 0)):
        status, found = compared(undisturbed[0], again.run, "--tolerance-deg", largest * factor)
        assert (status, bool(found["beyond_tolerance"])) == (expected, bool(expected))


def test_a_sonar_moved_by_little_is_found_and_named(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    moved = {"roll_deg": -48.75, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.302, "y_m": 0.20, "z_m": -2.01}
    run = run_of(simulate(tmp_path / "session", 2, mbes={"mount": moved, "ping_rate_hz": 8.0}))
    status, found = compared(undisturbed[0], run)
    assert status == 1
    rows = {row["parameter"]: row for row in found["parameters"]}
    assert rows["roll"]["difference"] == pytest.approx(0.05, abs=0.025)
    assert rows["lever arm x"]["difference"] == pytest.approx(0.002, abs=0.0012)
    assert [name for name, row in rows.items() if row["moved"]] == ["roll", "lever arm x"]
    assert "roll by +0.0" in found["sentence"]
    assert "lever arm x by +" in found["sentence"]
    assert "the rest within noise" in found["sentence"]


@pytest.mark.thorough
def test_another_target_compares_the_mount_alone(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    origin = {"latitude_deg": 36.1, "longitude_deg": 120.3, "height_m": 20.0}
    target = {"a": 6.0, "b": 2.4, "c": 0.8, "e": 0.4, "azimuth_deg": 30.0, "origin": origin}
    run = run_of(simulate(tmp_path / "session", 3, target=target))
    status, found = compared(undisturbed[0], run)
    assert status == 0, found["sentence"]
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


def test_a_rejected_run_answers_nothing(undisturbed: tuple[Path, Told], again: Place) -> None:
    """Its values must not be used, so they say neither yes nor no; unless they are the same."""
    again.edit_config("verdict", max_sigma_deg=1e-6)
    again.edit_config("segment", margin_m=0.05)
    assert again.calibrate().status == 1
    status, found = compared(undisturbed[0], again.run)
    assert (status, found["answered"]) == (1, False)
    assert found["sentence"].startswith("no answer: b (2026-05-12_small) was rejected")
    status, found = compared(again.run, again.run)
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
