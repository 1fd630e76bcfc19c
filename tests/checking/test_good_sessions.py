"""poolcal check: good sessions stay clean, and what people are shown of them."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from pipeline.checking import excerpts
from tests.support.checks import SBET, checked
from tests.support.effort import often
from tests.support.places import poolcal

pytestmark = pytest.mark.usefixtures("calibrated_where_marked")


@pytest.mark.calibrates
@pytest.mark.parametrize("scenario", ["messy", *often([], ["default", "azimuth_163", "drift", "small_target"])])
def test_a_good_session_is_clean(good: Callable[..., Path], scenario: str) -> None:
    assert checked(good(scenario)) == (0, [])


@pytest.mark.calibrates
def test_a_good_session_of_which_only_pieces_are_read(
    good: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    session = good()
    monkeypatch.setattr(excerpts, "POINTS", 16_000)
    monkeypatch.setattr(excerpts, "STRETCH", 500)
    monkeypatch.setattr(excerpts, "BYTES", {"ins": 150_000, "mbes": 200_000})
    monkeypatch.setattr(excerpts, "LEAST", {"ins": 10_000, "mbes": 20_000})
    monkeypatch.setattr(excerpts, "HEAD", 20_000)
    told = poolcal("check", session, "--config", session / "pool.yaml", "--json")
    content = json.loads(told.out)
    assert [found["words"] for found in content["findings"]] == []
    assert all(file["share_read"] < 1.0 for file in content["files"]), content["files"]
    assert all(passed["ran"] == {"laser": 1.0, "mbes": 1.0} for passed in content["passes"])


def test_a_good_session_with_points_in_a_crs_and_odd_names(spoilt: Callable[..., Path]) -> None:
    session = spoilt(laser={"frame": "EPSG:4978", "format": "las", "point_rate_hz": 2000.0})
    path = session / "laser" / "pass_0.las"
    path.rename(path.with_name("pass #0.las"))
    assert checked(session) == (0, [])


@pytest.mark.parametrize(("ins_s", "severity"), [((2.0, 100.0), "look"), ((40.0, 100.0), "fault")])
def test_sensors_that_ran_before_the_ins_are_no_clocks(
    spoilt: Callable[..., Path], ins_s: tuple[float, float], severity: str
) -> None:
    """Switched on a little sooner: nothing lost. A pass without it: its file is missing."""
    session = spoilt(**SBET)
    path = session / "ins" / "ins.sbet"
    records = np.fromfile(path, "<f8").reshape(-1, 17)
    since = records[:, 0] - records[0, 0]
    records[(since >= ins_s[0] + 8.0) & (since <= ins_s[1])].tofile(path)
    status, found = checked(session)
    assert {one["severity"] for one in found if one["question"] == "ins missing"} <= {severity}
    assert not [one for one in found if one["question"] == "clock"], found
    assert status == (severity == "fault")


def test_a_target_that_nobody_surveyed_is_looked_at(good: Callable[..., Path], tmp_path: Path) -> None:
    content = yaml.safe_load((good() / "pool.yaml").read_text("utf-8"))
    del content["as_built"]
    pool = tmp_path / "pool.yaml"
    pool.write_text(yaml.safe_dump(content), "utf-8")
    told = poolcal("check", good(), "--config", pool, "--json")
    (found,) = json.loads(told.out)["findings"]
    assert (found["question"], found["severity"], told.status) == ("survey", "look", 0)
    assert "surveyed one by one, to 0.5 mm, with the pool filled; say how yours was (as_built)" in found["words"]


def test_people_see_files_passes_and_that_nothing_was_found(good: Callable[..., Path]) -> None:
    told = poolcal("check", good(), "--config", good() / "pool.yaml")
    lines = told.out.splitlines()
    assert [line.split()[:2] for line in lines[1:4]] == [
        ["ins", "ins/ins.gps"], ["laser", "laser/pass_0.las"], ["laser", "laser/pass_1.las"],
    ]
    assert "100 Hz" in lines[1]
    assert lines[-1] == "Nothing found."
    assert sum("100%    100%" in line for line in lines) == 2
    unasked = poolcal("check", good()).out.splitlines()
    assert unasked[-2] == "Nothing found."
    assert unasked[-1].startswith("Target, mounts and soundings were not checked: give")


@pytest.mark.calibrates
def test_soundings_are_as_many_as_the_passes_should_give(good: Callable[..., Path]) -> None:
    told = poolcal("check", good("small_target"), "--config", good("small_target") / "pool.yaml", "--json")
    faces = json.loads(told.out)["soundings"]
    assert {face["family"] for face in faces} == {"P1", "P2", "P3", "H"}
    by_family = {name: [face for face in faces if face["family"] == name] for name in ("P1", "P2", "P3")}
    for name, some in by_family.items():
        expected, found = (sum(face[key] for face in some) for key in ("expected", "found"))
        assert expected > 300
        assert found == pytest.approx(expected, rel=0.3), name


def test_without_a_config_nothing_is_asked_of_the_target(good: Callable[..., Path]) -> None:
    told = poolcal("check", good(), "--json")
    assert told.status == 0
    assert json.loads(told.out)["passes"] == []
