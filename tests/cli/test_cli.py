"""The command line as users and scripts meet it: exit status, what goes to which stream, and how fast it answers."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import pipeline
from stages import ORDER
from stages.cli import call
from stages.commands.entry import raise_if_interrupted
from tests.support.roots import ROOT
from tests.support.toy_run import Pool

COMMANDS = ("simulate", "run", "stage", "verify", "view", "diff", "history", "check", "plan", "coarse", "compare")
TOY = [sys.executable, str(ROOT / "tests" / "support" / "toy_poolcal.py")]


def _toy(*words: object, **options: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([*TOY, *map(str, words)], capture_output=True, text=True, timeout=60, **options)


def _words(pool: Pool) -> tuple[object, ...]:
    return ("run", pool.session, "--config", pool.config, "--run", pool.run_folder)


def _told(pool: Pool, code: int) -> None:
    pool.margin(0.05)
    pool.config.write_text(pool.config.read_text() + f"verdict: {{max_sigma_m: {code}}}\n")


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
        (["stage", "wash", "z"], "NAME 'wash': is no stage; the stages are ingest"),
        (["stage", "ingest", "z", "--session", "x"], "--session and --config: give both"),
        (["simulate", "x", "--seed", "-1"], "--seed -1: must not be negative"),
        (["verify", "z"], "z: holds no run.yaml"),
        (["coarse", "marks.yaml"], "missing: --session SESSION: the folder with session.yaml"),
        (["coarse", "marks.yaml", "--session", "missing"], "missing: is no folder; SESSION is the folder that holds"),
        (["compare", "z", "truth.json"], "calibration.json: cannot be read"),
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


# --- running ---------------------------------------------------------------------------------------------------------
def test_accepted_then_nothing_to_do_then_rejected(pool: Pool) -> None:
    _told(pool, 1)
    done = _toy(*_words(pool))
    assert (done.returncode, done.stdout) == (0, "toy: accepted\n")
    assert done.stderr.startswith("take: done in")
    assert "no result yet" not in done.stderr
    done = _toy(*_words(pool))
    assert done.returncode == 0
    assert done.stderr == "take: up to date\nsift: up to date\nreport: up to date\n"
    _told(pool, 2)
    done = _toy(*_words(pool), "--jobs", 2)
    assert (done.returncode, done.stdout) == (1, "toy: rejected\n")
    assert "report: verdict.max_sigma_m 1.0 -> 2.0\n" in done.stderr
    assert _toy("stage", "report", pool.run_folder).returncode == 1
    assert _toy("stage", "sift", pool.run_folder).returncode == 0
    assert _toy("verify", pool.run_folder).returncode == 0


def test_another_sessions_run_is_replaced_only_when_asked(pool: Pool) -> None:
    _told(pool, 1)
    _toy(*_words(pool))
    (pool.run_folder / "report" / "report.html").write_text("<p>ours</p>")
    before = (pool.run_folder / "report" / "calibration.json").read_bytes()
    pool.session = pool.session.rename(pool.session.with_name("other"))
    for number, path in enumerate(sorted(pool.session.rglob("*.bin"))):
        path.write_bytes(bytes(8 * (100 + number)))
    done = _toy(*_words(pool))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"poolcal: {pool.run_folder}: holds the run of another session, 'toy' in ")
    assert "poolcal run --overwrite" in done.stderr
    assert (pool.run_folder / "report" / "calibration.json").read_bytes() == before
    done = _toy(*_words(pool), "--overwrite")
    assert (done.returncode, done.stdout) == (0, "toy: accepted\n")
    kept = pool.run_folder / "report.1"
    assert f"report: the accepted result that was there is kept in {kept}\n" in done.stderr
    assert (kept / "calibration.json").read_bytes() == before
    assert (kept / "report.html").read_text() == "<p>ours</p>"
    assert _toy("verify", pool.run_folder).returncode == 0


def test_the_report_learns_what_it_was_made_from(pool: Pool) -> None:
    _told(pool, 1)
    _toy(*_words(pool))
    told = json.loads((pool.run_folder / "report" / "calibration.json").read_text())
    assert set(told["inputs"]) == {"ins/0.bin", "laser/0.bin", "laser/1.bin", "mbes/0.bin"}
    assert {"poolcal", "python", "numpy"} <= set(told["software"])
    (pool.session / "ins" / "0.bin").write_bytes(b"")
    assert "report: ins/0.bin changed" in _toy(*_words(pool)).stderr


def test_verify_says_what_is_wrong(pool: Pool) -> None:
    _told(pool, 1)
    _toy(*_words(pool))
    (pool.run_folder / "sift" / "means.parquet").write_bytes(b"")
    done = _toy("verify", pool.run_folder)
    assert done.returncode == 1
    assert done.stdout == "sift: its result means.parquet was edited\n1 problem\n"


def test_a_bug_keeps_its_traceback(pool: Pool) -> None:
    _told(pool, 3)
    done = _toy(*_words(pool))
    assert done.returncode == 3
    assert "Traceback" in done.stderr
    assert "ZeroDivisionError: a toy bug" in done.stderr
    assert sorted(p.name for p in pool.run_folder.glob("[a-z]*")) == ["digests.json", "run.yaml", "sift", "take"]


def test_bad_input_is_one_line_and_debug_shows_more(pool: Pool) -> None:
    pool.config.write_text("target: 3\n")
    done = _toy(*_words(pool))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "target = 3" in done.stderr
    done = _toy(*_words(pool), "--debug")
    assert done.returncode == 2
    assert "Traceback" in done.stderr


def test_interrupted(pool: Pool) -> None:
    _told(pool, 4)
    done = _toy(*_words(pool))
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "poolcal: interrupted; what was complete is kept"
    assert "Traceback" not in done.stderr
    assert not (pool.run_folder / "report.partial").exists()


def test_killed_and_run_again(pool: Pool) -> None:
    _told(pool, 5)
    with subprocess.Popen([*TOY, *map(str, _words(pool))], stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 30
        while not (pool.run_folder / "report.partial").exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    _told(pool, 1)
    done = _toy(*_words(pool))
    assert done.returncode == 0
    assert "sift: up to date" in done.stderr
    assert not (pool.run_folder / "report.partial").exists()


def test_names_cannot_command_the_terminal(pool: Pool) -> None:
    _told(pool, 1)
    text = (pool.session / "session.yaml").read_text()
    (pool.session / "session.yaml").write_text(text.replace("name: toy", 'name: "a\\e[2Jb"'))
    (pool.session / "laser" / "\x1b[31m.bin").write_bytes(b"")
    assert _toy(*_words(pool)).stdout == "a\\x1b[2Jb: accepted\n"
    (pool.session / "laser" / "\x1b[31m.bin").write_bytes(bytes(8))
    assert "take: laser/\\x1b[31m.bin changed" in _toy(*_words(pool)).stderr


def test_nobody_listens(pool: Pool) -> None:
    _told(pool, 2)
    read, write = os.pipe()
    os.close(read)
    command = [*TOY, *map(str, _words(pool))]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert done.returncode == 1
    assert "Broken" not in done.stderr
    assert "Traceback" not in done.stderr


def test_a_terminal_sees_a_bar(pool: Pool) -> None:
    _told(pool, 1)
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen([*TOY, *map(str, _words(pool))], stderr=theirs, stdout=theirs, env=environment) as process:
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
    _told(pool, 1)
    done = _toy(*_words(pool), env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert done.stderr.replace("\n", "").isprintable()


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


# --- streams that cannot be written ----------------------------------------------------------------------------------
@pytest.mark.parametrize("code", [1, 2])
def test_a_log_that_cannot_be_written_changes_nothing(pool: Pool, code: int) -> None:
    """A full disk under the log: the run goes on, and its status is the answer."""
    _told(pool, code)
    command = [*TOY, *map(str, _words(pool))]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=full, text=True, check=False)
    assert (done.returncode, done.stdout) == (code - 1, f"toy: {('accepted', 'rejected')[code - 1]}\n")
    assert (pool.run_folder / "report" / "manifest.json").is_file()


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["verify"], ["run"]])
def test_an_answer_that_cannot_be_written_is_one_line(pool: Pool, words: list[str]) -> None:
    _told(pool, 1)
    if words == ["verify"]:
        _toy(*_words(pool))
    given = {"verify": ["verify", pool.run_folder], "run": list(_words(pool))}.get(words[-1], words)
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*TOY, *map(str, given)], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
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
