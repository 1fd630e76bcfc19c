"""Drawing: beside a run, and never in the way of a calibration."""

import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import stages.commands.draw_process
import stages.views.recording
from pipeline.artefacts.streams import serial
from pipeline.run.folder import locked
from stages import ORDER
from stages.commands.draw import Painters, Prepared, paint, painters
from stages.views.blueprint import tabs_of
from tests.support.effort import often
from tests.support.places import Place, digests, poolcal
from tests.support.recordings import points, read

MARK = f"STARTED_BY_TEST_{os.getpid()}"


@pytest.fixture(autouse=True)
def marked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(MARK, "yes")


def painting() -> list[Path]:
    """The processes that draw, of those started by these tests, wherever they hang."""
    return [place for place in Path("/proc").glob("[0-9]*") if _draws(place)]


def assert_all_end() -> None:
    """What was told to end takes a moment."""
    deadline = time.monotonic() + 10
    while painting() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not painting()


def _draws(process: Path) -> bool:
    try:
        words, given = (process / "cmdline").read_bytes(), (process / "environ").read_bytes()
    except OSError:  # gone, or not ours
        return False
    return b"stages.commands.draw_process" in words and MARK.encode() in given


def test_a_failure_to_draw_spoils_nothing(place: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason on one line; a bug keeps its traceback as well."""
    for error, traced in ((OSError("no room\nfor pictures"), False), (ValueError("no room\nfor pictures"), True)):

        def fails(*_: object, error: Exception = error) -> bool:
            raise error

        monkeypatch.setattr(stages.views.recording, "record", fails)
        told = place.calibrate("--recordings")
        assert told.status == 0
        last = f"recordings: not drawn ({type(error).__name__}: no room); the calibration is complete"
        assert told.complaints[-1] == last
        assert ("Traceback" in told.err) == traced
        assert (len(told.complaints) > 1) == traced
        assert digests(place.run) == right


def test_painters_beside_the_run(place: Place, right: dict[str, str], drawn: Path) -> None:
    """With two workers the pictures come from processes of their own: the same ones, and no process stays behind."""
    told = poolcal(*place.words()[:-1], 2, "--report", "--recordings")
    assert told.status == 0
    assert told.complaints == []
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)
    one, other = (re.findall("<img .*?>", (run / "report" / "report.html").read_text()) for run in (place.run, drawn))
    assert one == other
    assert len(one) == 7
    assert digests(place.run) == right
    assert_all_end()
    here, there = (read(run, "adjust")["/after/P2"] for run in (place.run, drawn))
    np.testing.assert_array_equal(points(here), points(there))


def test_nothing_is_started_where_nothing_is_to_be_drawn(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    assert done.calibrate("--report", "--recordings").status == 0
    monkeypatch.setattr(subprocess, "Popen", None)
    assert poolcal(*done.words()[:-1], 2, "--report", "--recordings").complaints == []


def test_recordings_are_prepared_as_stages_finish_and_written_after_the_verdict(done: Place) -> None:
    """So that they never take the room on the disk that a stage needs."""
    with painters(report=True, recordings=True, beside=True) as found:
        for stage in ORDER:
            found.begin(done.run, stage)
        time.sleep(2.0)  # long enough to have prepared some
        assert not list(done.run.glob("*/*.rrd"))
        assert not (done.run / "report" / "report.html").exists()
        assert found.draw(done.run) == []
    assert sorted(path.stem for path in done.run.glob("*/*.rrd")) == sorted(ORDER)
    assert (done.run / "report" / "report.html").is_file()


def test_what_was_prepared_is_written_only_beside_the_tables_that_it_shows(done: Place) -> None:
    shown = (done.run / "ingest" / "manifest.json").read_bytes()
    tabs = tabs_of(done.run)
    current, stale = Prepared(shown, tabs, b"prepared"), Prepared(shown + b" ", tabs, b"of tables that are gone")
    other = Prepared(shown, tabs[1:], b"beside tabs that are gone")
    assert paint(done.run, ["ingest", "offsets"], prepared={"ingest": current, "offsets": stale}) == []
    assert (done.run / "ingest" / "ingest.rrd").read_bytes() == b"prepared"
    assert "/curves/turns/angles" in read(done.run, "offsets")
    (done.run / "ingest" / "ingest.rrd").unlink()
    assert paint(done.run, ["ingest"], prepared={"ingest": other}) == []
    assert "/quality/attitude/roll" in read(done.run, "ingest")


def test_what_fails_while_stages_run_is_drawn_after_them(place: Place) -> None:
    with painters(report=False, recordings=True, beside=True) as found:
        found.begin(place.run, "georeference")  # not there yet
        assert place.calibrate().status == 0
        assert found.draw(place.run) == []
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)


def test_a_painter_that_dies_is_said(done: Place) -> None:
    with painters(report=True, recordings=True, beside=True) as found:
        found.begin(done.run, "adjust")
        assert found._process is not None
        found._process.kill()
        failed = found.draw(done.run)
    assert_all_end()
    assert [(one.what, one.trace) for one in failed] == [("report.html and recordings", "")]
    assert not list(done.run.rglob("*.new"))
    assert not list(done.run.rglob("*.partial"))


@pytest.mark.parametrize("wait_s", often([0.3], [0.0, 0.3, 1.0]))
def test_without_its_copies_it_draws_all_the_same(done: Place, wait_s: float) -> None:
    """They may be killed at any moment, by a system short of memory: while they load, or with a picture half done."""
    with painters(report=True, recordings=True, beside=True) as found:
        found.begin(done.run, "georeference")
        deadline = time.monotonic() + 60
        while len(copies := _children(found)) < 2 and time.monotonic() < deadline:
            time.sleep(0.005)
        time.sleep(wait_s)
        for copy in copies:
            os.kill(copy, signal.SIGKILL)
        assert found.draw(done.run) == []
    assert (done.run / "report" / "report.html").is_file()
    assert sorted(path.stem for path in done.run.glob("*/*.rrd")) == sorted(ORDER)


@pytest.mark.parametrize("wait_s", often([0.001], [0.0, 0.001, 0.01]))
def test_a_painter_killed_while_it_forks_leaves_nothing(done: Place, wait_s: float) -> None:
    with painters(report=True, recordings=True, beside=True) as found:
        found.begin(done.run, "georeference")
        assert found._process is not None
        deadline = time.monotonic() + 60
        while not _children(found) and time.monotonic() < deadline:
            pass
        time.sleep(wait_s)
        found._process.kill()
        assert [one.trace for one in found.draw(done.run)] == [""]
    assert_all_end()


def test_no_shared_memory_no_copies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a pool of processes cannot be made the process draws alone."""

    def none(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(stages.commands.draw_process, "ProcessPoolExecutor", none)
    assert stages.commands.draw_process._others() is serial


def _children(found: Painters) -> list[int]:
    assert found._process is not None
    place = Path(f"/proc/{found._process.pid}/task/{found._process.pid}/children")
    return [int(word) for word in place.read_text().split()]


def test_nothing_stays_behind_of_a_killed_run(place: Place) -> None:
    command = [Path(sys.executable).with_name("poolcal"), *map(str, place.words()[:-1]), "2"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while len(painting()) < 3 and time.monotonic() < deadline:  # loaded, and with its copies
            time.sleep(0.01)
        assert len(painting()) == 3
        process.kill()
    assert_all_end()


def test_nothing_in_the_working_directory_is_run(place: Place) -> None:
    """Neither code nor settings of a folder that came from somewhere."""
    for name in ("numpy.py", "rerun.py", "matplotlib.py"):
        (place.folder / name).write_text("open('run by mistake', 'w').write('x')\n")
    (place.folder / "matplotlibrc").write_text("text.usetex: True\n")
    command = [Path(sys.executable).with_name("poolcal"), *map(str, place.words()[:-1]), "2"]
    done = subprocess.run(command, cwd=place.folder, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    assert "not drawn" not in done.stderr
    assert (place.run / "report" / "report.html").is_file()
    assert len(list(place.run.glob("*/*.rrd"))) == len(ORDER)
    assert not (place.folder / "run by mistake").exists()


def test_a_full_disk_is_one_line_and_no_stump(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    failed = Painters(report=False, recordings=True).draw(done.run)
    assert [one.trace for one in failed] == [""]
    assert "make room" in failed[0].reason
    assert not [path for path in done.run.rglob("*") if path.suffix in (".rrd", ".new", ".partial")]


@pytest.mark.thorough
def test_no_room_for_another_process(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr(subprocess, "Popen", none)
    assert poolcal(*place.words()[:-1], 2, "--report", "--recordings").complaints == []
    assert (place.run / "report" / "report.html").is_file()


def test_nothing_missing_nothing_said(done: Place) -> None:
    """A folder that is in use, or that cannot be written, is looked at all the same."""
    assert done.calibrate("--recordings").status == 0
    with locked(done.run, ORDER):
        assert Painters(report=False, recordings=True).draw(done.run) == []
        (done.run / "adjust" / "adjust.rrd").unlink()
        (failed,) = Painters(report=False, recordings=True).draw(done.run)
    assert "is in use" in failed.reason


def test_a_mistyped_run_is_refused_and_not_made(place: Place) -> None:
    told = poolcal("view", place.folder / "typo")
    assert (told.status, len(told.err.splitlines())) == (2, 1)
    assert not (place.folder / "typo").exists()


def test_none_when_not_wanted(place: Place) -> None:
    assert place.calibrate("--no-recordings").status == 0
    assert not list(place.run.rglob("*.rrd"))
    assert poolcal("view", place.folder / "nowhere").status == 2
    told = poolcal("view", place.run, "--stage", "../elsewhere")
    assert (told.status, "is no stage" in told.err) == (2, True)
