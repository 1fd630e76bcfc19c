"""What a run names as the next step, quoted for the shell."""

import shlex
import sys
from pathlib import Path

import pytest

from stages.commands.answer import say_next


def test_commands_on_any_run_folder_can_be_pasted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["/opt/my tools/poolcal", "run"])
    for run in ("runs/day 1", "-run; rm x", "水池"):
        say_next(Path(run))
        head, export, check = capsys.readouterr().out.splitlines()
        assert "poolcal export --list" in head
        place = f"./{run}" if run.startswith("-") else run
        assert shlex.split(export) == ["/opt/my tools/poolcal", "export", place, "--to", "NAME"]
        assert shlex.split(check) == ["/opt/my tools/poolcal", "check-entry", place, "SOUNDINGS"]
