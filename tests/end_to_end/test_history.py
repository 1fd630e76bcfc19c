"""poolcal history: every run in a folder, in order of time, with jumps; hostile names; broken runs."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.end_to_end.pages import Page
from tests.end_to_end.places import Told, poolcal

HOSTILE = '<script>alert("x")</script> & 水池 ' + "n" * 100


def planted(folder: Path, template: Path, name: str, day: int, **changes: Any) -> None:
    """A run folder with nothing but its result, changed."""
    result = json.loads((template / "report" / "calibration.json").read_text(encoding="utf-8"))
    result["session"] = changes.get("session", name)
    result["verdict"] = changes.get("verdict", "accepted")
    result["passes"][0]["start_utc"] = f"2026-05-{day:02d}T{changes.get('hour', 8):02d}:00:00Z"
    if changes.get("laser"):
        result["calibrated"] = "laser"
    shift = changes.get("z_m", 0.0)
    for block in (result["mbes"], result["methods"]["adjustment"]):
        block["lever_arm_m"][2] += shift
        block["mount"]["z_m"] += shift
    if changes.get("nothing"):
        for block in (result["mbes"], result["methods"]["adjustment"]):
            block.update(dict.fromkeys(block))
    (folder / name / "report").mkdir(parents=True)
    text = json.dumps(result, ensure_ascii=False)
    (folder / name / "report" / "calibration.json").write_text(text, encoding="utf-8")


@pytest.fixture
def runs(undisturbed: tuple[Path, Told], tmp_path: Path) -> Path:
    folder, template = tmp_path / "runs", undisturbed[0]
    planted(folder, template, "b_first", 1)
    planted(folder, template, "a_second", 2, session=HOSTILE)
    planted(folder, template, "refused", 3, verdict="rejected", z_m=0.5)
    planted(folder, template, "moved", 4, z_m=0.01)
    planted(folder, template, "after", 5, z_m=0.01, session='=HYPERLINK("x")')
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


def test_names_are_text(runs: Path) -> None:
    poolcal("history", runs)
    page = (runs / "history" / "history.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;alert(&#34;x&#34;)&lt;/script&gt; &amp; 水池" in page
    assert page.count("<img ") == 1
    assert 'class="quiet"' in page


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
