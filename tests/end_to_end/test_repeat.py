"""poolcal repeat on simulated sessions: the bytes of poolcal run, the values of calibration.json, the histories."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from pipeline.maths.mount_parameters import SETTINGS
from tests.support.places import Told, digests, edit, poolcal, result_of

FLEET = """
runs: runs/甲
sessions:
  - {session: data/0*, config: pool.yaml}
  - {session: data/拒, config: pool.yaml, runs: runs/b}
  - {session: data/lost, config: pool.yaml}
"""


@pytest.fixture
def place(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two equal sessions of one boat, one of another with a planted latency, one with a file missing."""
    for name in ("01", "02", "拒", "lost"):
        shutil.copytree(small, tmp_path / "data" / name)
    shutil.copy(small / "pool.yaml", tmp_path)
    edit(tmp_path / "data" / "拒" / "session.yaml", "mbes", latency_s=0.3)
    shutil.rmtree(tmp_path / "data" / "lost" / "ins")
    (tmp_path / "fleet.yaml").write_text(FLEET, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _repeat() -> Told:
    return poolcal("repeat", "fleet.yaml", "--jobs", 2, "--no-recordings", "--no-report")


def test_as_single_runs_then_nothing_to_do(place: Path, right: dict[str, str]) -> None:
    told = _repeat()
    assert told.status == 2, told.err
    rows = {line.split()[0]: line.split() for line in told.out.split("\n\n")[0].splitlines()[1:]}
    assert list(rows) == ["data/01", "data/02", "data/拒", "data/lost"]
    for name in ("01", "02"):
        run = place / "runs" / "甲" / name
        assert digests(run) == right
        mount = result_of(run)["mbes"]["mount"]
        values = [f"{mount[key]:.{4 if key.endswith('_deg') else 3}f}" for key in SETTINGS]
        assert rows[f"data/{name}"][1:8] == ["accepted", *values]
        assert f"data/{name}: accepted; ran ingest to report (" in told.err
    assert rows["data/01"][8] == "-"
    assert " ".join(rows["data/02"][8:10]) == "too uncertain"  # two passes, without a cast: as poolcal diff says
    assert rows["data/拒"][1:9] == ["rejected", *"-------"]
    assert rows["data/lost"][1:9] == ["refused", *"-------"]
    assert "data/lost: refused: session.yaml: ins.files: 'ins/" in told.out
    history = {group: pd.read_parquet(place / "runs" / group / "history" / "history.parquet") for group in ("甲", "b")}
    assert history["甲"]["run"].tolist() == ["01", "02"]
    assert history["b"]["verdict"].tolist() == ["rejected"]
    assert "4 sessions: 2 accepted, 1 rejected, 1 could not run." in told.out
    before = json.loads((place / "runs" / "甲" / "01" / "report" / "manifest.json").read_text())
    again = _repeat()
    assert again.status == 2
    assert again.err.count("; up to date (") == 3
    assert "1 could not run; 3 up to date." in again.out
    assert again.out.count("too uncertain") == 1
    assert json.loads((place / "runs" / "甲" / "01" / "report" / "manifest.json").read_text()) == before
