"""``poolcal view`` opens the viewer: for this machine alone, telling nobody, and in one line where it cannot."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from stages import ORDER
from tests.support.places import poolcal

RERUN = Path(sys.executable).with_name("rerun")


def test_the_viewer_listens_on_this_machine_alone(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[list[str]] = []

    def run(command: list[object], **_: object) -> subprocess.CompletedProcess[str]:
        called.append([str(word) for word in command])
        return subprocess.CompletedProcess([], 0)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(subprocess, "run", run)
    assert poolcal("view", drawn).status == 0
    assert poolcal("view", drawn, drawn).status == 0
    assert poolcal("view", drawn, "--stage", "adjust").status == 0
    whole, pair, one = called
    assert all(words[1:3] == ["--bind", "127.0.0.1"] for words in called)
    assert len(whole) == 3 + len(ORDER)
    assert len(pair) == 4
    assert one[3:] == [str(drawn / "adjust" / "adjust.rrd")]


def test_the_viewer_tells_nobody_that_it_is_used(
    drawn: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asked itself, in the environment in which it is opened; the user's own choice stays what it is."""
    home = tmp_path / "home"
    home.mkdir()
    for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "CI"):  # where CI is set, nothing is ever sent
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("DISPLAY", ":0")
    really, answers = subprocess.run, []

    def config(**environment: Any) -> dict[str, Any]:
        told = really([RERUN, "analytics", "config"], capture_output=True, text=True, check=True, **environment)
        found: dict[str, Any] = json.loads(told.stdout)
        return found

    assert config()["analytics_enabled"]  # the viewer's default, written into this home
    before = {path: path.read_bytes() for path in home.rglob("*") if path.is_file()}

    def run(command: list[object], env: dict[str, str], **_: object) -> subprocess.CompletedProcess[str]:
        answers.append(config(env=env))
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", run)
    assert poolcal("view", drawn).status == 0
    assert poolcal("view", drawn, drawn).status == 0
    assert [answer["analytics_enabled"] for answer in answers] == [False, False]
    assert not any(Path(answer["data_dir_path"]).is_relative_to(home) for answer in answers)
    assert {path: path.read_bytes() for path in home.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("display", ["", ":987"], ids=["none", "none that answers"])
def test_without_a_display_one_line_says_what_to_do(
    drawn: Path, display: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    told = poolcal("view", drawn)
    assert (told.status, told.out) == (2, "")
    copy = f"copy {drawn}/*/*.rrd to a machine with one, or open {drawn}/report/report.html"
    assert told.err == f"poolcal: no display here: {copy}\n"
    pair = poolcal("view", drawn, drawn)
    assert pair.status == 2
    assert f"poolcal diff {drawn} {drawn} --rrd FILE" in pair.err


def test_what_else_stops_the_viewer_is_shown(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(command: list[object], stderr: Any, **_: object) -> subprocess.CompletedProcess[str]:
        stderr.write("no graphics adapter\n")
        return subprocess.CompletedProcess(command, 101)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(subprocess, "run", run)
    told = poolcal("view", drawn)
    assert (told.status, told.err) == (1, "no graphics adapter\n")
