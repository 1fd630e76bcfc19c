"""poolcal history: every run in a folder, in order of time, with jumps; hostile names; broken runs."""

import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.support.pages import Page
from tests.support.places import Told, poolcal
from tests.support.planted_runs import planted

HOSTILE = '<script>alert("x")</script> & 水池 ' + "n" * 100


@pytest.fixture
def runs(undisturbed: tuple[Path, Told], tmp_path: Path) -> Path:
    folder, template = tmp_path / "runs", undisturbed[0]
    planted(folder, template, "b_first", 1)
    planted(folder, template, "a_second", 2, session=HOSTILE)
    planted(folder, template, "refused", 3, verdict="rejected", z_m=0.5)
    planted(folder, template, "moved", 4, z_m=0.06)
    planted(folder, template, "after", 5, z_m=0.06, session='=HYPERLINK("x")')
    planted(folder, template, "nothing", 6, verdict="rejected", nothing=True)
    return folder


def table_of(folder: Path) -> pd.DataFrame:
    return pd.read_parquet(folder / "history" / "history.parquet")


def test_in_order_of_time_with_the_jump_alone(runs: Path) -> None:
    told = poolcal("history", runs)
    assert (told.status, told.err) == (0, "")
    table = table_of(runs)
    assert table["run"].tolist() == ["b_first", "a_second", "refused", "moved", "after", "nothing"]
    assert table["moved"].tolist() == ["", "", "", "lever arm z", "", ""]
    assert table["probability"].notna().tolist() == [False, True, False, True, True, False]
    assert np.isnan(table["roll_deg"].iloc[-1])
    text = pd.read_csv(runs / "history" / "history.csv")
    assert text["session"].str.removeprefix("'").tolist() == table["session"].tolist()
    assert "'=HYPERLINK" in (runs / "history" / "history.csv").read_text(encoding="utf-8")  # no formula
    np.testing.assert_allclose(text["z_m"], table["z_m"], rtol=1e-12)


@pytest.mark.usefixtures("unpainted")
def test_each_comparison_says_what_it_could_have_seen(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    """As poolcal diff says it; a result of an older version is compared by its total covariance, and sees less."""
    folder, template = tmp_path / "runs", undisturbed[0]
    planted(folder, template, "first", 1)
    planted(folder, template, "second", 2)
    planted(folder, template, "older", 3, without=("systematic", "limits"))
    planted(folder, template, "moved", 4, z_m=0.06)
    assert poolcal("history", folder).status == 0
    table = table_of(folder).set_index("run")
    assert table["answer"].tolist() == ["", "too uncertain", "too uncertain", "moved"]
    found = json.loads(poolcal("diff", template, template, "--json").out)["parameters"]
    keys = {"roll": "roll_deg", "pitch": "pitch_deg", "lever arm y": "y_m"}
    for row in found:
        if row["parameter"] in keys:
            name = f"detectable_{keys[row['parameter']]}"
            assert table[name]["second"] == pytest.approx(row["detectable"], rel=1e-12)
            assert table[name]["older"] > table[name]["second"]
    assert table["detectable_x_m"]["older"] > 1.5 * table["detectable_x_m"]["second"]  # the laser's lever arm cancels
    assert np.isnan(table["detectable_x_m"]["first"])
    rows = Page((folder / "history" / "history.html").read_text(encoding="utf-8")).table("no.", "date (UTC)")
    assert [row[-1] for row in rows] == ["", "uncertain", "uncertain", "lever arm z"]
    assert rows[0][-2] == ""
    assert rows[1][-2].startswith("0.2")
    assert "°, " in rows[1][-2]
    assert rows[1][-2].endswith(" mm")


def test_names_are_text(runs: Path) -> None:
    poolcal("history", runs)
    page = (runs / "history" / "history.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;alert(&#34;x&#34;)&lt;/script&gt; &amp; 水池" in page
    assert page.count("<img ") == 1
    assert 'class="quiet"' in page


@pytest.mark.usefixtures("unpainted")
def test_filters(runs: Path, tmp_path: Path) -> None:
    for words, expected in (
        (("--name", "MO*"), ["moved"]),
        (("--since", "2026-05-04"), ["moved", "after", "nothing"]),
        (("--until", "2026-05-01"), ["b_first"]),
        (("--name", "no such"), []),
    ):
        out = tmp_path / "out"
        assert poolcal("history", runs, "--out", out, *words).status == 0
        assert pd.read_parquet(out / "history.parquet")["run"].tolist() == expected
        shutil.rmtree(out)


@pytest.mark.usefixtures("unpainted")
def test_broken_runs_are_named_and_left_out(runs: Path) -> None:
    (runs / "moved" / "report" / "calibration.json").write_text("{")
    (runs / "after" / "report" / "calibration.json").write_text('{"verdict": "accepted", "mbes": 3}')
    damaged = runs / "b_first" / "report" / "calibration.json"
    content = json.loads(damaged.read_text(encoding="utf-8"))
    content["methods"]["adjustment"]["covariance"] = [[1.0]]
    damaged.write_text(json.dumps(content), encoding="utf-8")
    told = poolcal("history", runs)
    assert told.status == 0
    assert len(told.err.splitlines()) == 3
    assert "moved" in told.err
    assert "is not as poolcal writes it" in told.err
    assert len(table_of(runs)) == 3


def content_of(run: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((run / "report" / "calibration.json").read_text(encoding="utf-8"))
    return content


def spoilt(runs: Path, contents: list[Any]) -> None:
    """Beside the six runs one more for each of these contents of its calibration.json; text is written as it is."""
    for number, content in enumerate(contents):
        run = runs / f"spoilt_{number}"
        shutil.copytree(runs / "moved", run)
        text = content if isinstance(content, str) else json.dumps(content)
        (run / "report" / "calibration.json").write_text(text, encoding="utf-8")


STARTS = ("=1+$x_{$", "2026-05-04", "2026-13-04T08:00:00Z", "", 3, None, "x" * 10_000)


@pytest.mark.usefixtures("unpainted")
def test_a_start_that_is_no_time_leaves_its_run_out(runs: Path) -> None:
    """It would be a formula in the table, and mathematics in the chart."""
    contents = [content_of(runs / "moved") for _ in STARTS]
    for content, start in zip(contents, STARTS, strict=True):
        content["passes"][0]["start_utc"] = start
    spoilt(runs, contents)
    told = poolcal("history", runs)
    assert told.status == 0
    for number in range(len(STARTS)):
        why = "its calibration.json is not as poolcal writes it"
        assert f"left out: {runs / f'spoilt_{number}'}: {why}" in told.err, STARTS[number]
    assert table_of(runs)["run"].tolist() == ["b_first", "a_second", "refused", "moved", "after", "nothing"]


@pytest.mark.usefixtures("unpainted")
def test_crafted_runs_do_not_stop_the_others(runs: Path) -> None:
    spoilt(runs, ["[" * 100_000, '{"verdict": "accepted", "methods": [1]}'])
    told = poolcal("history", runs)
    assert told.status == 0
    for number, line in enumerate(told.err.splitlines()):
        assert line.startswith(f"left out: {runs / f'spoilt_{number}'}")
    assert told.err.count("\n") == 2
    assert len(table_of(runs)) == 6


@pytest.mark.usefixtures("unpainted")
def test_numbers_beyond_all_bounds_are_left_out(runs: Path) -> None:
    values = (10**400, "1e400", "inf")
    contents = [content_of(runs / "moved") for _ in values]
    for content, value in zip(contents, values, strict=True):
        content["methods"]["adjustment"]["mount"]["roll_deg"] = value
    spoilt(runs, contents)
    said = poolcal("history", runs).err
    for number in range(len(values)):
        assert f"left out: {runs / f'spoilt_{number}'}" in said
    assert len(table_of(runs)) == 6


@pytest.mark.usefixtures("unpainted")
def test_a_result_that_may_not_be_entered_is_left_out(runs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (runs / "closed" / "report").mkdir(parents=True)
    (runs / "closed" / "run.yaml").write_text("")
    stat = os.stat

    def refuse(path: Any, **options: Any) -> os.stat_result:
        if str(path).startswith(str(runs / "closed" / "report")):
            raise PermissionError(13, "Permission denied", str(path))
        return stat(path, **options)

    monkeypatch.setattr(os, "stat", refuse)
    told = poolcal("history", runs)
    assert told.status == 0, told.err
    why = "its result cannot be read (Permission denied); correct its permissions"
    assert told.err == f"left out: {runs / 'closed'}: {why}\n"


@pytest.mark.usefixtures("unpainted")
def test_no_link_is_written_through(runs: Path, tmp_path: Path) -> None:
    mine = tmp_path / "thesis.tex"
    mine.write_text("two years of work")
    (runs / "history").mkdir()
    for name in ("parquet", "csv", "html"):
        (runs / "history" / f"history.{name}.new").symlink_to(mine)
        (runs / "history" / f"history.{name}").symlink_to(mine)
    assert poolcal("history", runs).status == 0
    assert mine.read_text() == "two years of work"
    assert len(table_of(runs)) == 6


@pytest.mark.usefixtures("unpainted")
def test_what_was_kept_of_a_replaced_run_is_no_run_of_its_own(runs: Path) -> None:
    shutil.copytree(runs / "moved" / "report", runs / "moved" / "report.1")
    assert poolcal("history", runs).status == 0
    assert len(table_of(runs)) == 6


def test_a_folder_without_runs_is_refused_and_nothing_is_written(runs: Path, small: Path, tmp_path: Path) -> None:
    """A session's folder, say, where a page would lie among raw files; or the run itself."""
    session = tmp_path / "session"
    shutil.copytree(small, session)
    (runs / "moved" / "run.yaml").write_text("")
    for folder, remedy in ((session, "name the folder that holds them"), (runs / "moved", "it is one itself")):
        before = sorted(folder.rglob("*"))
        told = poolcal("history", folder)
        assert (told.status, told.out) == (2, "")
        assert told.err.startswith(f"poolcal: {folder}: holds no run folder")
        assert remedy in told.err
        assert told.err.count("\n") == 1
        assert sorted(folder.rglob("*")) == before


def test_no_folder(tmp_path: Path) -> None:
    told = poolcal("history", tmp_path / "none")
    assert told.status == 2
    assert "RUNS_DIR" in told.err


def test_sessions_of_one_day_are_told_apart_lasers_named(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    folder, template = tmp_path / "runs", undisturbed[0]
    planted(folder, template, "12_harbour_launch_north", 1, hour=8)
    planted(folder, template, "afternoon", 1, hour=14)
    planted(folder, template, "laser_alone", 2, laser=True)
    told = poolcal("history", folder)
    assert (told.status, told.err) == (0, "")
    lines = told.out.splitlines()
    assert lines[0] == "1 laser run not shown: laser_alone"
    assert lines[1].startswith("2 sessions: ")
    html = (folder / "history" / "history.html").read_text(encoding="utf-8")
    assert "1 laser run not shown: laser_alone." in html
    assert "12_<wbr>harbour_<wbr>launch_<wbr>north" in html  # a name is broken between words alone
    times = [row[1] for row in Page(html).table("no.", "date (UTC)")]
    assert times == ["2026-05-01 08:00", "2026-05-01 14:00"]
