"""poolcal alone, and words that are no command: what to do next."""

import subprocess
import sys
from pathlib import Path

import pytest

from stages.cli import call
from stages.cli.application import app
from stages.commands.guide import WAY, next_step
from stages.commands.usage import MEANT, meant
from tests.support.roots import ROOT

COMMANDS = [info.name for info in app.registered_commands if info.name]


def test_alone_it_tells_the_way_of_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call([]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert len(out.splitlines()) <= 13
    there = [name for name, _, _ in WAY if name in COMMANDS]
    places = [out.index(f"poolcal {name} ") for name in there]
    assert places == sorted(places)
    assert {"init", "coarse", "check", "run"} <= set(there)
    assert "Next: poolcal init FOLDER" in out
    for name, _, _ in WAY:
        assert (f"poolcal {name} " in out) == (name in COMMANDS)  # no command is named that there is not


def test_alone_it_is_quick() -> None:
    code = (
        "import sys; from stages.cli import call; status = call([]);"
        "heavy = {'numpy', 'pandas', 'pyarrow', 'pydantic', 'scipy', 'open3d', 'rich'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else status)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_next_step_is_the_folders(tmp_path: Path) -> None:
    session = tmp_path / "session.yaml"
    session.write_text("ins: {files: [a], format: FILL_IN}\n")
    assert "fill in session.yaml (1 x FILL_IN); then poolcal check . --config POOL.yaml" in next_step(tmp_path)
    session.write_text("ins: {files: [a], format: sbet}\n")
    (tmp_path / "pool.yaml").write_text("target: {a: FILL_IN, b: FILL_IN}\n")
    assert "fill in pool.yaml (2 x FILL_IN); then poolcal check . --config pool.yaml" in next_step(tmp_path)
    (tmp_path / "pool.yaml").write_text("target: {a: 1}\n")
    assert "poolcal check . --config pool.yaml, then poolcal run ." in next_step(tmp_path)
    session.write_text("ins: [FILL_IN\n")
    assert "not valid YAML" in next_step(tmp_path)
    (tmp_path / "run.yaml").write_text("")
    assert "did not end" in next_step(tmp_path)
    (tmp_path / "report").mkdir()
    (tmp_path / "report" / "calibration.json").write_text("{}")
    assert "report/report.html" in next_step(tmp_path)


def test_words_of_others_name_the_command() -> None:
    assert not MEANT.keys() & set(COMMANDS)
    known = {name for name, _, _ in WAY} | set(COMMANDS)
    assert {name for names in MEANT.values() for name in names} <= known
    assert meant("export2", ["run"]) == ""
    assert meant("convert", ["run"]) == ""  # no command is named that there is not
    assert meant("CALIBRATE", ["run"]) == "did you mean poolcal run? "


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["calibrate", "x"], "No such command 'calibrate'; did you mean poolcal run? see poolcal --help"),
        (["start"], "did you mean poolcal init?"),
        (["chek"], "did you mean poolcal check?"),
        (["zzz"], "No such command 'zzz'; see poolcal --help"),
        (["run"], "--run RUN: the folder for the results, outside the session folder; poolcal init FOLDER writes"),
        (["run", "x"], "--run RUN: the folder for the results, outside the session folder; poolcal init FOLDER writes"),
        (["run", "x", "--run", "y"], "poolcal init begins one; see poolcal run --help"),
        (["check", "."], "poolcal init . writes it from the raw files"),
    ],
)
def test_bad_usage_says_what_to_do(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(words) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
