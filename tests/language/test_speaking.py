"""What is said in Chinese: sentences are, commands to be typed are not."""

import io
from pathlib import Path

import pytest

from pipeline.language.speaking import say
from pipeline.starting.next_steps import command


@pytest.mark.parametrize("name", ["init", "coarse", "check", "run", "export", "report", "check-entry", "diff"])
@pytest.mark.parametrize("before", ["     ", "  2  "])
def test_a_command_is_typed_as_it_stands(monkeypatch: pytest.MonkeyPatch, name: str, before: str) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    typed, stream = before + command(name, Path("水池 1"), "--config", "POOL.yaml"), io.StringIO()
    say(f"{typed}\n{typed}   calibrate: verdict, values, RUN/report/report.html", stream)
    first, second = stream.getvalue().splitlines()
    assert first == typed
    assert second.startswith(f"{typed}   标定")


def test_a_sentence_on_a_command_is_translated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    stream = io.StringIO()
    say("Left to be done:", stream)
    assert stream.getvalue() == "待办：\n"
