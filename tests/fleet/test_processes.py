"""Processes that answer requests: order, their number, and one that crashes takes nothing but its own request along."""

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.errors import ArtefactError
from pipeline.fleet import processes
from pipeline.fleet.processes import Command, Reply, ask_all

# Each request is a word and an argument; a process answers with its number, so that a test sees which one it was.
PROGRAM = """
import os, signal, sys, threading, time
from pathlib import Path
for request in sys.stdin:
    word, _, argument = request.strip().partition(" ")
    print("said of", word, argument, file=sys.stderr, flush=True)
    if word == "wait":
        deadline = time.monotonic() + 20
        while not Path(argument).exists() and time.monotonic() < deadline:
            time.sleep(0.01)
    if word == "signal":
        os.kill(os.getpid(), int(argument))
    if word == "exit":
        sys.exit(int(argument))
    if word == "hang":
        signal.signal(signal.SIGINT, lambda *_: Path(argument).touch())
        print("begun", file=sys.stderr, flush=True)
        Path(argument + ".begun").touch()
        time.sleep(30)
    if word == "much":
        sys.stderr.write("x" * 300_000)
        print("y" * 200_000, end="")
    print(os.getpid(), flush=True)
"""
COMMAND = Command((sys.executable, "-c", PROGRAM), os.environ)


class Asked:
    """Requests, and what came of them, in the order in which it came."""

    def __init__(self, requests: list[str], jobs: int, keep: bool = True, command: Command = COMMAND) -> None:
        self.replies: dict[int, Reply] = {}
        self.events: list[str] = []
        self.keep = keep
        ask_all(command, requests, jobs, self._begun, self._replied)

    def _begun(self, number: int) -> None:
        self.events.append(f"begun {number}")

    def _replied(self, number: int, reply: Reply) -> bool:
        self.events.append(f"replied {number}")
        self.replies[number] = reply
        return self.keep and reply.line is not None


def _alive(number: int) -> bool:
    return Path(f"/proc/{number}").exists()


def test_one_process_answers_all_and_ends() -> None:
    asked = Asked(["a", "b", "c"], jobs=1)
    assert asked.events == ["begun 0", "replied 0", "begun 1", "replied 1", "begun 2", "replied 2"]
    (number,) = {reply.line for reply in asked.replies.values()}
    assert [asked.replies[k].said for k in range(3)] == ["said of a \n", "said of b \n", "said of c \n"]
    assert not _alive(int(number or 0))


def test_a_process_that_may_not_go_on_is_replaced() -> None:
    asked = Asked(["a", "b"], jobs=1, keep=False)
    assert len({reply.line for reply in asked.replies.values()}) == 2


def test_no_more_than_jobs_at_a_time_and_answers_as_they_come(tmp_path: Path) -> None:
    gate = tmp_path / "gate"

    class Opened(Asked):
        def _replied(self, number: int, reply: Reply) -> bool:
            if number == 2:
                gate.touch()
            return super()._replied(number, reply)

    asked = Opened([f"wait {gate}", "a", "b", "c"], jobs=2)
    assert asked.events[:2] == ["begun 0", "begun 1"]
    assert asked.events[2:6] == ["replied 1", "begun 2", "replied 2", "begun 3"]
    assert sorted(asked.events[6:]) == ["replied 0", "replied 3"]


@pytest.mark.parametrize(
    ("request_", "exit_code"),
    [
        (f"signal {int(signal.SIGSEGV)}", -signal.SIGSEGV),
        (f"signal {int(signal.SIGKILL)}", -signal.SIGKILL),
        ("exit 7", 7),
        ("exit 0", 0),
    ],
)
def test_an_end_without_an_answer_concerns_that_request_alone(request_: str, exit_code: int) -> None:
    asked = Asked(["a", request_, "b"], jobs=1)
    assert (asked.replies[1].line, asked.replies[1].exit_code) == (None, exit_code)
    assert asked.replies[1].said == f"said of {request_}\n"
    first, last = asked.replies[0].line, asked.replies[2].line
    assert first is not None
    assert last is not None
    assert first != last


def test_much_that_is_said_blocks_nobody() -> None:
    asked = Asked(["much", "a"], jobs=1)
    assert asked.replies[0].said.endswith("x" * 300_000)
    assert len(asked.replies[0].line or "") > 200_000
    assert asked.replies[1].said == "said of a \n"


def test_no_process_can_be_started() -> None:
    with pytest.raises(ArtefactError, match=r"no process can be started \(No such file or directory\)"):
        Asked(["a"], jobs=2, command=Command(("/nothing/here",), os.environ))


@pytest.fixture
def patience(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    return lambda seconds: monkeypatch.setattr(processes, "PATIENCE_S", seconds)


def test_ctrl_c_interrupts_and_then_kills(tmp_path: Path, patience: Callable[[float], None]) -> None:
    """One process ends when interrupted, the other has to be killed."""
    patience(0.5)
    stubborn = tmp_path / "stubborn"
    numbers: list[int] = []

    class Interrupted(Asked):
        def _begun(self, number: int) -> None:
            if number == 2:
                deadline = time.monotonic() + 20
                while not Path(f"{stubborn}.begun").exists() and time.monotonic() < deadline:
                    time.sleep(0.01)
                raise KeyboardInterrupt

        def _replied(self, number: int, reply: Reply) -> bool:
            numbers.append(int(reply.line or 0))
            return super()._replied(number, reply)

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        Interrupted([f"hang {stubborn}", "a", f"wait {tmp_path / 'never'}"], jobs=2)
    assert stubborn.exists()  # it was told, and took no notice
    assert time.monotonic() - start < 15
    assert not any(_alive(number) for number in numbers)
