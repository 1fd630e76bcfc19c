"""The command line's answers: help, version, and bad usage in one line."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

import pipeline
from stages import ORDER
from stages.cli import call

COMMANDS = (
    "init", "simulate", "run", "stage", "verify", "view", "diff", "history", "check", "plan", "coarse", "compare",
    "export", "check-entry", "mount", "repeat", "report",
)  # fmt: skip


# --- answering -------------------------------------------------------------------------------------------------------
def test_help_is_quick_and_imports_nothing_that_computes() -> None:
    code = (
        "import sys; from stages.cli import call; status = call(['--help']);"
        "heavy = {'numpy', 'pandas', 'pyarrow', 'pydantic', 'scipy', 'open3d', 'rich'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else status)"
    )
    start = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert time.monotonic() - start < 1.0
    for command in COMMANDS:
        assert command in done.stdout


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["--version"]) == 0
    assert capsys.readouterr().out == f"poolcal {pipeline.__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call([command, "--help"]) == 0
    assert "Usage: poolcal" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["runn"], "No such command 'runn'"),
        (["run"], "Missing argument 'SESSION'"),
        (["run", "x"], "missing: --config FILE: the pool's YAML file"),
        (["run", "x", "--config", "y", "--run", "z", "--jobs", "many"], "--jobs"),
        (["run", "x", "--config", "y", "--run", "z", "--jobs", "0"], "--jobs 0: must be 1 or more"),
        (["run", "x", "--config", "missing.yaml", "--run", "z"], "missing.yaml: cannot be read"),
        (["repeat", "missing.yaml"], "missing.yaml: cannot be read"),
        (["repeat", "x", "--jobs", "0"], "--jobs"),
        (["stage", "wash", "z"], "NAME 'wash': is no stage; the stages are ingest"),
        (["stage", "ingest", "z", "--session", "x"], "--session and --config: give both"),
        (["simulate", "x", "--seed", "-1"], "--seed -1: must not be negative"),
        (["verify", "z"], "z: holds no run.yaml"),
        (["coarse", "marks.yaml"], "missing: --session SESSION: the folder with session.yaml"),
        (["coarse", "marks.yaml", "--session", "missing"], "missing: is no folder; SESSION is the folder that holds"),
        (["compare", "z", "truth.json"], "calibration.json: cannot be read"),
        (["export"], "export: give RUN and --to NAME; poolcal export --list shows the names"),
        (["export", "z", "--to", "qinsy"], "z: holds no run.yaml"),
        (["export", "z", "--to", "qinsy", "--ins-point", "1", "2"], "--ins-point"),
        (["mount", "f", "--from", "qinsy"], "missing: --session SESSION: the folder with session.yaml"),
        (["mount", "f", "--from", "qinsy", "--session", "missing"], "missing: is no folder"),
        (["--wrong"], "No such option"),
    ],
)
def test_bad_usage_is_one_line(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(words) == 2
    out, err = capsys.readouterr()
    assert said in err
    assert err.startswith("poolcal: ")
    assert err.count("\n") == 1
    assert out == ""
    assert list(tmp_path.iterdir()) == []


def test_the_order_is_the_contracts() -> None:
    assert " ".join(ORDER) == "ingest georeference segment fit_planes angle_iterate offsets adjust report"
