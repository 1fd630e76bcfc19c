"""A run from the command line as users and scripts meet it: exit status, what is kept, interrupts and bugs."""

import json
import signal
import subprocess
import time
from collections.abc import Callable

import pytest

from stages.cli import call
from stages.commands.entry import raise_if_interrupted
from tests.support.places import Told
from tests.support.toy_commands import TOY, run_words, set_outcome, toy_poolcal
from tests.support.toy_run import Pool

Toy = Callable[..., Told]  # the command line in this process; toy_poolcal: as a process of its own

# --- running ---------------------------------------------------------------------------------------------------------
def test_accepted_then_nothing_to_do_then_rejected(pool: Pool, toy: Toy) -> None:
    set_outcome(pool, 1)
    done = toy_poolcal(*run_words(pool))
    assert (done.returncode, done.stdout) == (0, "toy: accepted\n")
    assert done.stderr.startswith("take: done in")
    assert "no result yet" not in done.stderr
    done = toy(*run_words(pool))
    assert done.status == 0
    assert done.err == "take: up to date\nsift: up to date\nreport: up to date\n"
    set_outcome(pool, 2)
    done = toy(*run_words(pool), "--jobs", 2)
    assert (done.status, done.out) == (1, "toy: rejected\n")
    assert "report: verdict.max_sigma_m 1.0 -> 2.0\n" in done.err
    assert toy("stage", "report", pool.run_folder).status == 1
    assert toy("stage", "sift", pool.run_folder).status == 0
    assert toy("verify", pool.run_folder).status == 0


def test_another_sessions_run_is_replaced_only_when_asked(pool: Pool, toy: Toy) -> None:
    set_outcome(pool, 1)
    toy(*run_words(pool))
    (pool.run_folder / "report" / "report.html").write_text("<p>ours</p>")
    before = (pool.run_folder / "report" / "calibration.json").read_bytes()
    pool.session = pool.session.rename(pool.session.with_name("other"))
    for number, path in enumerate(sorted(pool.session.rglob("*.bin"))):
        path.write_bytes(bytes(8 * (100 + number)))
    done = toy(*run_words(pool))
    assert (done.status, done.out) == (2, "")
    assert done.err.count("\n") == 1
    assert done.err.startswith(f"poolcal: {pool.run_folder}: holds the run of another session, 'toy' in ")
    assert "poolcal run --overwrite" in done.err
    assert (pool.run_folder / "report" / "calibration.json").read_bytes() == before
    done = toy(*run_words(pool), "--overwrite")
    assert (done.status, done.out) == (0, "toy: accepted\n")
    kept = pool.run_folder / "report.1"
    assert f"report: the accepted result that was there is kept in {kept}\n" in done.err
    assert (kept / "calibration.json").read_bytes() == before
    assert (kept / "report.html").read_text() == "<p>ours</p>"
    assert toy("verify", pool.run_folder).status == 0


def test_the_report_learns_what_it_was_made_from(pool: Pool, toy: Toy) -> None:
    set_outcome(pool, 1)
    toy(*run_words(pool))
    told = json.loads((pool.run_folder / "report" / "calibration.json").read_text())
    assert set(told["inputs"]) == {"ins/0.bin", "laser/0.bin", "laser/1.bin", "mbes/0.bin"}
    assert {"poolcal", "python", "numpy"} <= set(told["software"])
    (pool.session / "ins" / "0.bin").write_bytes(b"")
    assert "report: ins/0.bin changed" in toy(*run_words(pool)).err


def test_verify_says_what_is_wrong(pool: Pool, toy: Toy) -> None:
    set_outcome(pool, 1)
    toy(*run_words(pool))
    (pool.run_folder / "sift" / "means.parquet").write_bytes(b"")
    done = toy("verify", pool.run_folder)
    assert done.status == 1
    assert done.out == "sift: its result means.parquet was edited\n1 problem\n"


def test_a_bug_keeps_its_traceback(pool: Pool, toy: Toy) -> None:
    set_outcome(pool, 3)
    done = toy(*run_words(pool))
    assert done.status == 3
    assert "Traceback" in done.err
    assert "ZeroDivisionError: a toy bug" in done.err
    assert sorted(p.name for p in pool.run_folder.glob("[a-z]*")) == ["digests.json", "run.yaml", "sift", "take"]


def test_bad_input_is_one_line_and_debug_shows_more(pool: Pool, toy: Toy) -> None:
    pool.config.write_text("target: 3\n")
    done = toy(*run_words(pool))
    assert done.status == 2
    assert done.err.count("\n") == 1
    assert "target = 3" in done.err
    done = toy(*run_words(pool), "--debug")
    assert done.status == 2
    assert "Traceback" in done.err


def test_interrupted(pool: Pool) -> None:
    set_outcome(pool, 4)
    done = toy_poolcal(*run_words(pool))
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "poolcal: interrupted; what was complete is kept"
    assert "Traceback" not in done.stderr
    assert not (pool.run_folder / "report.partial").exists()


def test_killed_and_run_again(pool: Pool, toy: Toy) -> None:
    set_outcome(pool, 5)
    with subprocess.Popen([*TOY, *map(str, run_words(pool))], stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 30
        while not (pool.run_folder / "report.partial").exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    set_outcome(pool, 1)
    done = toy(*run_words(pool))
    assert done.status == 0
    assert "sift: up to date" in done.err
    assert not (pool.run_folder / "report.partial").exists()


def test_an_interrupt_that_a_library_made_an_error_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C while a compiled module is being loaded comes out as an ImportError."""

    def fails(*_: object, **__: object) -> None:
        raise ImportError("initialization failed")

    monkeypatch.setattr("stages.cli.app", fails)
    assert call(["run"]) == 3
    monkeypatch.setattr("stages.commands.entry.interrupts", [2])
    capsys.readouterr()
    assert call(["run"]) == 130
    assert capsys.readouterr().err == "poolcal: interrupted; what was complete is kept\n"


def test_an_interrupt_that_python_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the clean-up after a lock, say: nothing comes of it there, so the run ends after the stage."""
    raise_if_interrupted()
    monkeypatch.setattr("stages.commands.entry.interrupts", [2])
    with pytest.raises(KeyboardInterrupt):
        raise_if_interrupted()
