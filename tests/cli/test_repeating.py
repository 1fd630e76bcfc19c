"""poolcal repeat with toy stages: statuses, what is said, a second call, sessions that end badly beside good ones."""

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from pipeline.run import folder
from tests.support.places import Told
from tests.support.toy_commands import TOY, set_outcome
from tests.support.toy_run import Pool

Toy = Callable[..., Told]


@dataclass(frozen=True)
class Fleet:
    """Toy sessions whose outcomes are set by their names, for instance good-1."""

    folder: Path
    pool: Pool

    @property
    def file(self) -> Path:
        return self.folder / "fleet.yaml"

    def run(self, name: str) -> Path:
        return self.folder / "runs" / name

    def add(self, name: str, outcome: int) -> None:
        """A session in data/, and its config."""
        shutil.copytree(self.pool.session, self.folder / "data" / name)
        self.set(name, outcome)

    def set(self, name: str, outcome: int) -> None:
        self.pool.config = self.folder / f"{name}.yaml"
        set_outcome(self.pool, outcome)

    def write(self, *names: str) -> None:
        lines = [f"  - {{session: data/{name}, config: {name}.yaml}}\n" for name in names]
        self.file.write_text("runs: runs\nsessions:\n" + "".join(lines))

    def words(self) -> list[str]:
        return ["repeat", str(self.file), "--jobs", "1"]

    def started(self) -> "subprocess.Popen[str]":
        """The command as a process of its own, in a group that a Ctrl-C reaches as a whole."""
        pipe = subprocess.PIPE
        return subprocess.Popen(
            [*TOY, *self.words()], stdout=pipe, stderr=pipe, text=True, cwd=self.folder, start_new_session=True
        )


@pytest.fixture
def fleet(pool: Pool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fleet:
    made = Fleet(tmp_path / "船队", pool)
    made.folder.mkdir()
    monkeypatch.chdir(made.folder)
    return made


def _cells(told: Told) -> dict[str, tuple[str, str]]:
    """Verdict in the table, and what the line at the session's end says was done, by the session's name."""
    table = told.out.split("\n\n")[0].splitlines()[1:]
    verdicts = {line.split()[0].removeprefix("data/"): line.split()[1] for line in table}
    ends = [line.partition(": ") for line in told.err.splitlines() if line.endswith(" s)")]
    done = {label.removeprefix("data/"): words.rpartition(" (")[0].rpartition("; ")[2] for label, _, words in ends}
    finished = ("accepted", "rejected")
    return {name: (verdict, done[name] if verdict in finished else "") for name, verdict in verdicts.items()}


def test_all_kinds_of_ends_then_a_second_call(fleet: Fleet, toy: Toy) -> None:
    kinds = {"good": 1, "bad": 2, "bug": 3, "crash": 6, "lost": 1, "locked": 1, "last": 1}
    for name, outcome in kinds.items():
        fleet.add(name, outcome)
    (fleet.folder / "lost.yaml").write_text("target: [\n")
    fleet.write(*kinds)
    with folder.locked(fleet.run("locked"), ()):
        told = toy(*fleet.words())
    assert told.status == 3
    assert _cells(told) == {
        "good": ("accepted", "ran take, sift, report"),
        "bad": ("rejected", "ran take, sift, report"),
        "bug": ("bug", ""),
        "crash": ("bug", ""),
        "lost": ("refused", ""),
        "locked": ("refused", ""),
        "last": ("accepted", "ran take, sift, report"),
    }
    below = told.out.split("\n\n")[1].splitlines()
    assert below[0] == "data/bad: rejected: toy"
    assert below[1] == "data/bug: bug: ZeroDivisionError: a toy bug; see runs/bug.repeat.log"
    assert below[2] == "data/crash: bug: its process crashed (SIGSEGV); see runs/crash.repeat.log"
    assert below[3].startswith("data/lost: refused: lost.yaml: not valid YAML")
    assert below[4].startswith(f"data/locked: refused: runs/locked: is in use by process {os.getpid()}")
    assert "7 sessions: 2 accepted, 1 rejected, 2 could not run, 2 ended by a bug." in told.out
    assert "Traceback" in (fleet.folder / "runs" / "bug.repeat.log").read_text()
    log = (fleet.folder / "runs" / "good.repeat.log").read_text()
    assert log.startswith("poolcal repeat: data/good\ntake: done in")
    begins = [line for line in told.err.splitlines() if ": begins, " in line]
    assert begins == [f"data/{name}: begins, {number} of 7" for number, name in enumerate(kinds, 1)]
    assert toy("verify", fleet.run("good")).status == 0
    _second_call(fleet, toy)


def _second_call(fleet: Fleet, toy: Toy) -> None:
    """All is mended but one session, which stays rejected; that the history cannot be written makes it status 2."""
    for name in ("bug", "crash", "lost"):
        fleet.set(name, 1)
    shutil.rmtree(fleet.folder / "runs" / "history")
    (fleet.folder / "runs" / "history").touch()
    before = {path: path.read_bytes() for path in fleet.run("good").glob("*/**/*") if path.is_file()}
    told = toy(*fleet.words())
    assert told.status == 2
    cells = _cells(told)
    assert cells["good"] == ("accepted", "up to date")
    assert cells["bad"] == ("rejected", "up to date")
    assert cells["bug"] == cells["crash"] == ("accepted", "ran report")
    assert cells["lost"] == cells["locked"] == ("accepted", "ran take, sift, report")
    assert told.out.splitlines()[-1] == "7 sessions: 6 accepted, 1 rejected; 3 up to date."
    assert "no history: runs/history: cannot be written" in told.err
    assert {path: path.read_bytes() for path in before} == before
    assert {path.name for path in before} >= {"calibration.json", "means.parquet", "manifest.json"}


def test_refused_before_anything_runs(fleet: Fleet, toy: Toy) -> None:
    fleet.add("a", 1)
    fleet.write("a", "a")
    told = toy(*fleet.words())
    assert (told.status, told.out) == (2, "")
    assert told.err.startswith(f"poolcal: {fleet.file}: line 4: sessions.1.session = 'data/a': data/a would go into")
    assert told.err.count("\n") == 1
    assert not (fleet.folder / "runs").exists()


def _wait_for(path: Path) -> None:
    deadline = time.monotonic() + 30
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.02)


def _free(run: Path) -> None:
    """Wait until nothing holds the lock of a run folder."""
    deadline = time.monotonic() + 10
    while True:
        try:
            with folder.locked(run, ()):
                return
        except folder.ArtefactError:
            assert time.monotonic() < deadline
            time.sleep(0.05)


@pytest.mark.parametrize(("number", "outcome"), [(signal.SIGINT, 1), (signal.SIGKILL, 2)], ids=["Ctrl-C", "killed"])
def test_stopped_in_the_middle_and_called_again(number: int, outcome: int, fleet: Fleet, toy: Toy) -> None:
    """Nothing goes on behind the user's back, the folder is free, and what was complete is not computed again."""
    fleet.add("first", 1)
    fleet.add("hangs", 5)
    fleet.write("first", "hangs")
    with fleet.started() as process:
        _wait_for(fleet.run("hangs") / "report.partial")
        process.send_signal(number)
        out, err = process.communicate(timeout=20)
    assert out == ""
    assert "data/first: accepted; ran take, sift, report (" in err
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert err.splitlines()[-1] == "poolcal: interrupted; what was complete is kept"
        assert "Traceback" not in err
        assert not (fleet.run("hangs") / "report.partial").exists()
    else:
        assert process.returncode == -number
    _free(fleet.run("hangs"))
    fleet.set("hangs", outcome)
    told = toy(*fleet.words())
    assert told.status == outcome - 1
    verdict = {1: "accepted", 2: "rejected"}[outcome]
    assert _cells(told) == {"first": ("accepted", "up to date"), "hangs": (verdict, "ran report")}
    assert not (fleet.run("hangs") / "report.partial").exists()
