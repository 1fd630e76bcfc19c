"""What people look at, drawn from a run's files: the recordings as stages finish, the report's page after the verdict.

Drawing needs heavy libraries and cannot share the interpreter with itself. A process of its own
(:mod:`stages.commands.draw_process`) loads them while the stages run, in the time these leave. It prepares recordings
of finished stages, and keeps them: nothing is written before the verdict, so that pictures never take the room that a
stage needs. Then it is told to draw, writes, and answers with what went wrong.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.artefacts.streams import Mapper, serial
from pipeline.atomic_files import write_bytes
from pipeline.errors import PoolcalError
from pipeline.results.pages.currency import is_page_outdated
from pipeline.run import folder, manifest
from pipeline.run.results import PAGE, agreeing, recording_path
from pipeline.run.settings import read_settings
from stages import ORDER, names_in

RECORDINGS = "recordings"
PATIENCE_S, ENDING_S = 600, 10
PREPARE, DRAW = "prepare", "draw"
TOO_EARLY = ORDER[:1]  # what follows the first stage needs every processor as well
BESIDE_THE_PAGE = ORDER[-2:]  # recordings for which the page would have to wait
DECIDES = "angle_iterate"  # on which tabs there are
ALLOCATION = {  # one thread, for the process is to fork; one allocator, and large pages where the system has them
    "OPENBLAS_NUM_THREADS": "1",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1",
}


@dataclass(frozen=True)
class Failure:
    """What could not be drawn, and why; ``trace``: of a bug."""

    what: str
    reason: str
    trace: str = ""

    @classmethod
    def of(cls, what: str, error: Exception) -> "Failure":
        expected = isinstance(error, (PoolcalError, OSError))
        trace = "" if expected else "".join(traceback.format_exception(error)).rstrip()
        first = str(error).partition("\n")[0]
        return cls(what, f"{type(error).__name__}: {first}", trace)


class Painters:
    """What is to be drawn, and the process that loads what it takes and draws; without one, this process draws."""

    def __init__(self, report: bool, recordings: bool, beside: bool = False) -> None:
        self._wanted = [what for what, wanted in ((PAGE, report), (RECORDINGS, recordings)) if wanted]
        self._beside = beside and bool(self._wanted)
        self._process: subprocess.Popen[str] | None = None
        self._finished: list[str] = []

    def begin(self, run: Path, stage: str) -> None:
        """Have a finished stage's recording prepared while others run. If that fails, :meth:`draw` does it again.

        The process is started when the files have been read and placed: that needs every processor, what follows less.
        """
        self._finished.append(stage)
        if not self._beside or stage in TOO_EARLY:
            return
        if self._process is None:
            try:
                self._process = _start(self._wanted)
            except OSError:  # no room for another process
                self._beside = False
                return
        names = [name for name in self._finished if name not in BESIDE_THE_PAGE]
        self._finished.clear()
        if RECORDINGS in self._wanted and names:
            _tell(self._process, PREPARE, run, names)

    def draw(self, run: Path) -> list[Failure]:
        """Draw what is not drawn yet. A finished result is never touched; what could not be drawn comes back."""
        if not self._wanted:
            return []
        try:
            read_settings(run)  # never lock, and so make, a folder that is no run's
            if not self._missing(run):
                return []
            with folder.locked(run, ORDER):
                missing = self._missing(run)
                if self._process is None or not missing:
                    return paint(run, missing)
                return _drawn_by(self._process, run, missing)
        except Exception as error:
            return [Failure.of(" and ".join(self._wanted), error)]

    def _missing(self, run: Path) -> list[str]:
        """Names of what is not drawn yet: the page, or stages; of stages that agree with each other alone."""
        stages = names_in(run)
        page = [PAGE] if PAGE in self._wanted and is_page_outdated(run, stages) else []
        if RECORDINGS not in self._wanted:
            return page
        done = agreeing(run, stages)
        if DECIDES in done and not recording_path(run, DECIDES).is_file():
            return page + list(done)  # with its result the tabs may come or go, and every recording names them
        return page + [stage for stage in done if not recording_path(run, stage).is_file()]

    def close(self) -> None:
        if self._process is not None:
            if self._process.poll() is None:
                os.killpg(self._process.pid, signal.SIGKILL)  # with its copies: they are a group of their own
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.communicate(timeout=ENDING_S)


def _start(wanted: Sequence[str]) -> "subprocess.Popen[str]":
    """-P: nothing in the folder one happens to stand in is code of this program."""
    command = [sys.executable, "-P", "-m", "stages.commands.draw_process", str(os.getpid()), *wanted]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True, text=True, env=_environment()
    )


def _environment() -> dict[str, str]:
    """With the program's own root first, for where it was not installed."""
    root = str(Path(__file__).parent.parent)
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": path} | ALLOCATION


def _tell(process: "subprocess.Popen[str]", order: str, run: Path, names: Sequence[str]) -> None:
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):  # it has ended: there will be no answer
        print(json.dumps([order, str(run.absolute()), names]), file=process.stdin, flush=True)


def _drawn_by(process: "subprocess.Popen[str]", run: Path, names: Sequence[str]) -> list[Failure]:
    _tell(process, DRAW, run, names)
    what = " and ".join(dict.fromkeys(RECORDINGS if name in ORDER else name for name in names))
    try:
        answer, _ = process.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return [Failure(what, f"not done within {PATIENCE_S} s")]
    told = answer.rpartition("\n")[2]
    return [Failure(**one) for one in json.loads(told)] if told else [Failure(what, "its process has ended")]


@contextlib.contextmanager
def painters(report: bool, recordings: bool, beside: bool) -> Iterator[Painters]:
    """Painters for the time of a run; ``beside``: as a process of its own."""
    found = Painters(report, recordings, beside)
    try:
        yield found
    finally:
        found.close()


# --- drawing ---------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Prepared:
    """A recording, the manifest of the stage that is shown, and the tabs in which it is shown."""

    shown: bytes
    tabs: tuple[str, ...]
    recording: bytes

    @classmethod
    def of(cls, run: Path, stage: str) -> "Prepared":
        from stages.views.blueprint import tabs_of
        from stages.views.recording import record

        tabs = tabs_of(run)
        shown = (run / stage / manifest.NAME).read_bytes()
        return cls(shown, tabs, record(run, stage, tabs))

    def still(self, run: Path, stage: str) -> bool:
        """Whether it shows the stage as it is now."""
        from stages.views.blueprint import tabs_of

        return self.shown == (run / stage / manifest.NAME).read_bytes() and self.tabs == tabs_of(run)


def paint(
    run: Path, names: Sequence[str], mapper: Mapper = serial, prepared: Mapping[str, Prepared] | None = None
) -> list[Failure]:
    """Draw the page, its pictures through ``mapper``, and stages' recordings; what went wrong."""
    failed: list[Failure] = []
    pictures = None
    if PAGE in names:
        with _noting(failed, PAGE):
            pictures = _pictures(run, mapper)
    with _noting(failed, RECORDINGS):
        for stage in names:
            if stage != PAGE:
                _write_recording(run, stage, (prepared or {}).get(stage))
    if pictures is not None:
        with _noting(failed, PAGE):
            _write_page(run, pictures)
    return failed


@contextlib.contextmanager
def _noting(failed: list[Failure], what: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        failed.append(Failure.of(what, error))


def _pictures(run: Path, mapper: Mapper) -> Iterable[Any]:
    from pipeline.results.pages.plots import draw_picture, picture_names

    return mapper(partial(draw_picture, run), picture_names(run))


def _write_page(run: Path, pictures: Iterable[Any]) -> None:
    from pipeline.results.pages.report import write_report_page

    write_report_page(run, names_in(run), pictures)


def _write_recording(run: Path, stage: str, ready: Prepared | None) -> None:
    if ready is None or not ready.still(run, stage):
        ready = Prepared.of(run, stage)
    write_bytes(recording_path(run, stage), ready.recording)
