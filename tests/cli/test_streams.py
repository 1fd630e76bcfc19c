"""What the command line writes to which stream: terminals, plain output, nobody who listens, a full disk."""

import os
import pty
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from stages.cli import call
from stages.commands.entry import status_of
from tests.support.places import POOLCAL, Told
from tests.support.toy_commands import TOY, run_words, set_outcome, toy_poolcal
from tests.support.toy_run import Pool


def test_names_cannot_command_the_terminal(pool: Pool, toy: Callable[..., Told]) -> None:
    set_outcome(pool, 1)
    text = (pool.session / "session.yaml").read_text()
    (pool.session / "session.yaml").write_text(text.replace("name: toy", 'name: "a\\e[2Jb"'))
    (pool.session / "laser" / "\x1b[31m.bin").write_bytes(b"")
    assert toy(*run_words(pool)).out == "a\\x1b[2Jb: accepted\n"
    (pool.session / "laser" / "\x1b[31m.bin").write_bytes(bytes(8))
    assert "take: laser/\\x1b[31m.bin changed" in toy(*run_words(pool)).err


def test_a_path_that_is_closed_to_us_is_no_bug(capsys: pytest.CaptureFixture[str]) -> None:
    def closed() -> None:
        raise PermissionError(13, "Permission denied", "data/水池/s")

    assert status_of(closed, debug=False) == 2
    assert capsys.readouterr().err == (
        "poolcal: data/水池/s: cannot be used (Permission denied); correct its permissions\n"
    )


def test_nobody_listens(pool: Pool) -> None:
    set_outcome(pool, 2)
    read, write = os.pipe()
    os.close(read)
    command = [*TOY, *map(str, run_words(pool))]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert done.returncode == 1
    assert "Broken" not in done.stderr
    assert "Traceback" not in done.stderr


def test_a_terminal_sees_a_bar(pool: Pool) -> None:
    set_outcome(pool, 1)
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen([*TOY, *map(str, run_words(pool))], stderr=theirs, stdout=theirs, env=environment) as process:
        os.close(theirs)
        seen = b""
        while True:
            try:
                piece = os.read(ours, 65536)
            except OSError:
                break
            if not piece:
                break
            seen += piece
    os.close(ours)
    assert process.returncode == 0
    assert b"rows/s" in seen
    assert b"left" in seen
    assert b"take: done in" in seen


def test_plain_output_has_no_control_characters(pool: Pool) -> None:
    set_outcome(pool, 1)
    done = toy_poolcal(*run_words(pool), env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert done.stderr.replace("\n", "").isprintable()


# --- streams that cannot be written ----------------------------------------------------------------------------------
@pytest.mark.parametrize("code", [1, 2])
def test_a_log_that_cannot_be_written_changes_nothing(pool: Pool, code: int) -> None:
    """A full disk under the log: the run goes on, and its status is the answer."""
    set_outcome(pool, code)
    command = [*TOY, *map(str, run_words(pool))]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=full, text=True, check=False)
    assert (done.returncode, done.stdout) == (code - 1, f"toy: {('accepted', 'rejected')[code - 1]}\n")
    assert (pool.run_folder / "report" / "manifest.json").is_file()


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["verify"], ["run"]])
def test_an_answer_that_cannot_be_written_is_one_line(
    pool: Pool, toy: Callable[..., Told], words: list[str]
) -> None:
    set_outcome(pool, 1)
    if words == ["verify"]:
        toy(*run_words(pool))
    given = {"verify": ["verify", pool.run_folder], "run": list(run_words(pool))}.get(words[-1], words)
    command = POOLCAL if words[0].startswith("--") else TOY
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*command, *map(str, given)], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 2
    assert last.startswith("poolcal: standard output: cannot be written (No space left on device)")
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


def test_no_temporary_folder_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import tempfile

    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", lambda: [str(tmp_path / "none")])
    monkeypatch.setattr("stages.commands.view.compare_runs", lambda *_: {})
    assert call(["view", str(tmp_path), str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("poolcal: no temporary folder can be made")
    assert "TMPDIR=" in said
    assert said.count("\n") == 1
