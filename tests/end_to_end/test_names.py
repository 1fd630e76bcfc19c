"""Whatever people call their folders and files."""

import json
import shutil
from pathlib import Path

import pytest
import yaml

from tests.support.effort import often
from tests.support.places import Place, digests, poolcal, poolcal_process

NAMES = [
    "水池 标定 2026 – ½, it's \"quoted\" <script>alert(1)</script>",
    "-rf [0] * ? %s {brace} $HOME `id`",
]


@pytest.mark.parametrize("name", often(NAMES[:1], NAMES))
def test_names(name: str, small: Path, tmp_path: Path, right: dict[str, str]) -> None:
    """Session folder, session, raw files and run folder all called so: the same tables, the name in the result."""
    place = Place(small, tmp_path)
    session, run = tmp_path / name.replace("/", "_"), tmp_path / "runs" / ("a " + name.replace("/", "_"))
    place.mend()
    place.session.rename(session)
    text = yaml.safe_load((session / "session.yaml").read_text(encoding="utf-8"))
    text["name"] = name
    for sensor in ("ins", "laser", "mbes"):
        for path in sorted((session / sensor).iterdir()):
            path.rename(path.with_name(f"{path.stem} {name.replace('/', '_')}{path.suffix}"))
    (session / "session.yaml").write_text(yaml.safe_dump(text, allow_unicode=True), encoding="utf-8")
    told = poolcal("run", "--config", place.config, "--run", run, "--jobs", 1, "--", session)
    assert told.status == 0, told.err
    assert told.out.startswith(f"{name}: ACCEPTED\n")
    result = json.loads((run / "report" / "calibration.json").read_text(encoding="utf-8"))
    assert result["session"] == name
    assert all(name.replace("/", "_") in file for file in result["inputs"])
    same = {path: digest for path, digest in right.items() if path != "ingest/files.parquet"}  # it names the files
    assert same.items() <= digests(run).items()


def test_complaints_about_odd_names_stay_one_line(small: Path, tmp_path: Path) -> None:
    place = Place(small, tmp_path)
    place.mend()
    path = place.raw("laser")
    odd = path.with_name("线 1\n\x1b[2J.las")
    shutil.copy(path, odd)
    odd.write_bytes(b"")
    told = place.calibrate()
    assert told.status == 2
    assert len(told.complaints) == 1
    assert "\x1b" not in told.err


def test_a_terminal_that_knows_no_chinese(small: Path, tmp_path: Path) -> None:
    place = Place(small, tmp_path / "水池")
    place.folder.mkdir()
    place.mend()
    place.edit_config("target", c=-1.0)
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"}
    told = poolcal_process(*place.words(), **plain)
    assert told.status == 2
    assert len(told.complaints) == 1
    assert "target.c = -1.0" in told.err
