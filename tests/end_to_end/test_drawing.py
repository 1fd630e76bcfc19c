"""Drawing: after the answer, and never in the way of a calibration."""

import errno
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import stages.commands.draw
import stages.views.recording
from pipeline.run.folder import locked
from stages import ORDER
from stages.commands.draw import Drawings, draw_missing
from tests.support.effort import often
from tests.support.places import Place, digests, poolcal
from tests.support.recordings import points, read
from tests.support.roots import ROOT

TELLING = """import sys
sys.stderr.write("begun\\n")  # in one piece: two processes write here
from pathlib import Path
from stages.commands.draw_worker import main
main(Path(sys.argv[1]), sys.argv[2:])
"""
PROGRAM = f"""import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # as in a terminal: a job in the background ignores it
from stages.cli import main
from stages.commands import draw
draw.WORKER = [sys.executable, "-c", {TELLING!r}]
main()
"""
BOTH = Drawings(report=True, recordings=True)
RECORDINGS = Drawings(report=False, recordings=True)


def drawn_in(run: Path) -> list[str]:
    return sorted(path.stem for path in run.glob("*/*.rrd"))


def test_a_failure_to_draw_spoils_nothing(done: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason on one line; a bug keeps its traceback as well."""
    for error, traced in ((OSError("no room\nfor pictures"), False), (ValueError("no room\nfor pictures"), True)):

        def fails(*_: object, error: Exception = error) -> bool:
            raise error

        monkeypatch.setattr(stages.views.recording, "record", fails)
        told = done.calibrate("--recordings")
        assert told.status == 0
        last = f"recordings: not drawn ({type(error).__name__}: no room); the calibration is complete"
        assert told.complaints[-1] == last
        assert ("Traceback" in told.err) == traced
        assert (len(told.complaints) > 1) == traced
        assert digests(done.run) == right


@pytest.mark.thorough
@pytest.mark.parametrize("jobs", often([4], [2, 4]))
def test_processes_of_their_own_draw_the_same(done: Place, right: dict[str, str], drawn: Path, jobs: int) -> None:
    """Whether one draws all, or one the page and one the recordings."""
    told = poolcal(*done.words()[:-1], jobs, "--report", "--recordings")
    assert told.status == 0
    assert told.complaints == []
    assert drawn_in(done.run) == sorted(ORDER)
    one, other = (re.findall("<img .*?>", (run / "report" / "report.html").read_text()) for run in (done.run, drawn))
    assert one == other
    assert len(one) == 8
    assert digests(done.run) == right
    here, there = (read(run, "adjust")["/after/P2"] for run in (done.run, drawn))
    np.testing.assert_array_equal(points(here), points(there))


def test_a_process_that_dies_is_said(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stages.commands.draw, "WORKER", [sys.executable, "-c", "import os; os.abort()"])
    (failure,) = draw_missing(done.run, BOTH, jobs=2)
    assert (failure.kind, failure.reason) == ("report.html and recordings", "its process has ended")
    assert [failure.kind for failure in draw_missing(done.run, BOTH, jobs=4)] == ["recordings", "report.html"]
    assert drawn_in(done.run) == []


def test_nothing_is_started_where_nothing_is_to_be_drawn(
    place: Place, drawn: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(drawn, place.run)
    monkeypatch.setattr(subprocess, "Popen", None)
    assert poolcal(*place.words()[:-1], 2, "--report", "--recordings").complaints == []


def test_no_room_for_another_process(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr(subprocess, "Popen", none)
    assert draw_missing(done.run, BOTH, jobs=2) == []
    assert (done.run / "report" / "report.html").is_file()
    assert drawn_in(done.run) == sorted(ORDER)


@pytest.mark.parametrize(("end", "status"), often([(signal.SIGINT, 130)], [(signal.SIGKILL, -9), (signal.SIGINT, 130)]))
def test_nothing_stays_behind_of_a_run_that_ends_while_it_draws(done: Place, end: signal.Signals, status: int) -> None:
    """Every process that it started holds its standard error open: that ends when the last of them has ended."""
    calibration = (done.run / "report" / "calibration.json").read_bytes()
    command = [sys.executable, "-c", PROGRAM, *map(str, done.words()[:-1]), "4"]
    quiet, pipe = subprocess.DEVNULL, subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, start_new_session=True, stdout=quiet, stderr=pipe, text=True) as process:
        assert process.stderr is not None
        assert "begun\n" in iter(process.stderr.readline, "")
        os.killpg(process.pid, end)  # as a terminal does it
        said = process.stderr.read()
    assert process.returncode == status
    assert "Traceback" not in said
    if end == signal.SIGINT:
        assert said.splitlines()[-1] == "poolcal: interrupted; what was complete is kept"
    assert (done.run / "report" / "calibration.json").read_bytes() == calibration
    for stage in drawn_in(done.run):
        assert read(done.run, stage)
    assert draw_missing(done.run, BOTH) == []
    assert drawn_in(done.run) == sorted(ORDER)


def test_nothing_in_the_working_directory_is_run(done: Place) -> None:
    """Neither code nor settings of a folder that came from somewhere."""
    for name in ("numpy.py", "rerun.py", "matplotlib.py", "json.py"):
        (done.folder / name).write_text("open('run by mistake', 'w').write('x')\n")
    (done.folder / "matplotlibrc").write_text("text.usetex: True\n")
    command = [Path(sys.executable).with_name("poolcal"), *map(str, done.words()[:-1]), "2"]
    told = subprocess.run(command, cwd=done.folder, capture_output=True, text=True, check=False, timeout=120)
    assert told.returncode == 0
    assert "not drawn" not in told.stderr
    assert (done.run / "report" / "report.html").is_file()
    assert drawn_in(done.run) == sorted(ORDER)
    assert not (done.folder / "run by mistake").exists()


def test_a_full_disk_is_one_line_and_no_stump(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    (failure,) = draw_missing(done.run, RECORDINGS)
    assert failure.trace == ""
    assert "make room" in failure.reason
    assert not [path for path in done.run.rglob("*") if path.suffix in (".rrd", ".new", ".partial")]


def test_nothing_missing_nothing_said(place: Place, drawn: Path) -> None:
    """A folder that is in use, or that cannot be written, is checked all the same."""
    shutil.copytree(drawn, place.run)
    with locked(place.run, ORDER):
        assert draw_missing(place.run, RECORDINGS) == []
        (place.run / "adjust" / "adjust.rrd").unlink()
        (failure,) = draw_missing(place.run, RECORDINGS)
    assert "is in use" in failure.reason


def test_a_mistyped_run_is_refused_and_not_made(place: Place) -> None:
    told = poolcal("view", place.folder / "typo")
    assert (told.status, len(told.err.splitlines())) == (2, 1)
    assert not (place.folder / "typo").exists()


def test_none_when_not_wanted(done: Place) -> None:
    assert done.calibrate("--no-recordings").status == 0
    assert not list(done.run.rglob("*.rrd"))
    assert poolcal("view", done.folder / "nowhere").status == 2
    told = poolcal("view", done.run, "--stage", "../elsewhere")
    assert (told.status, "is no stage" in told.err) == (2, True)
