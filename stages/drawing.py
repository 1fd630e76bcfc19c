"""What people look at, drawn from a run's files: the recordings as stages finish, the report's page after the verdict.

Drawing needs heavy libraries and cannot share the interpreter with itself. A process of its own loads them while the
stages run, in the time these leave, and draws when it is told to: ``python -m stages.drawing`` draws what each line
names, and at the end of its input answers with what went wrong in drawing the last.
"""

import contextlib
import ctypes
import gc
import json
import os
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pipeline import folder
from pipeline.drawn import PAGE, agreeing, page_to_draw, recording_path
from pipeline.errors import PoolcalError
from pipeline.streams import Mapper, serial
from stages import ORDER

RECORDINGS = "recordings"
PATIENCE_S = 600
DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG
NICE = 10  # the stages come first, but a busy machine draws as well
SIDE_BY_SIDE = 2  # pictures of the page
BESIDE_THE_PAGE = ORDER[-2:]  # recordings for which the page would have to wait


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

    def begin(self, run: Path, stage: str) -> None:
        """Have a finished stage's recording drawn while others run. If that fails, :meth:`draw` does it again.

        The process is started by the first: reading the files needs every processor, what follows does not.
        """
        if not self._beside:
            return
        if self._process is None:
            try:
                self._process = _start(self._wanted)
            except OSError:  # no room for another process
                self._beside = False
                return
        if RECORDINGS in self._wanted and stage not in BESIDE_THE_PAGE:
            _tell(self._process, run, [stage])

    def draw(self, run: Path) -> list[Failure]:
        """Draw what is not drawn yet. A finished result is never touched; what could not be drawn comes back."""
        if not self._wanted:
            return []
        try:
            folder.read_settings(run)  # never lock, and so make, a folder that is no run's
            with folder.locked(run, ORDER):
                missing = [name for what in self._wanted for name in _missing(run, what)]
                if self._process is None:
                    return paint(run, missing)
                return _drawn_by(self._process, run, missing) if missing else []
        except Exception as error:
            return [Failure.of(" and ".join(self._wanted), error)]

    def close(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()


def _start(wanted: Sequence[str]) -> "subprocess.Popen[str]":
    """-P: nothing in the folder one happens to stand in is code of this program."""
    command = [sys.executable, "-P", "-m", "stages.drawing", *wanted]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True, text=True, env=_environment()
    )


ALLOCATION = {  # no threads, for the process is to fork; memory kept, and in large pages where the system has them
    "OPENBLAS_NUM_THREADS": "1",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1",
}


def _environment() -> dict[str, str]:
    """With the program's own root first, for where it was not installed."""
    root = str(Path(__file__).parent.parent)
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": path} | ALLOCATION


def _tell(process: "subprocess.Popen[str]", run: Path, names: Sequence[str]) -> None:
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):  # it has ended: there will be no answer
        print(json.dumps([str(run.absolute()), names]), file=process.stdin, flush=True)


def _drawn_by(process: "subprocess.Popen[str]", run: Path, names: Sequence[str]) -> list[Failure]:
    _tell(process, run, names)
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


def _missing(run: Path, what: str) -> list[str]:
    """Names of what is not drawn yet: the page, or stages; of stages that agree with each other alone."""
    if what == PAGE:
        return [PAGE] if page_to_draw(run, ORDER) else []
    return [stage for stage in agreeing(run, ORDER) if not recording_path(run, stage).is_file()]


def paint(run: Path, names: Sequence[str], mapper: Mapper = serial) -> list[Failure]:
    """Draw the page, its pictures through ``mapper``, and stages' recordings; what went wrong."""
    failed: list[Failure] = []
    pictures = None
    if PAGE in names:
        with _noting(failed, PAGE):
            pictures = _pictures(run, mapper)
    if stages := [name for name in names if name != PAGE]:
        with _noting(failed, RECORDINGS):
            _record(run, stages)
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
    from pipeline.pages.pictures import PICTURES, draw

    return mapper(partial(draw, run), PICTURES)


def _write_page(run: Path, pictures: Iterable[Any]) -> None:
    from pipeline.pages.report import write_page

    write_page(run, ORDER, pictures)


def _record(run: Path, stages: Sequence[str]) -> None:
    from stages.views import record

    for stage in stages:
        record(run, stage)


# --- the process -----------------------------------------------------------------------------------------------------
def main(wanted: Sequence[str]) -> None:
    """Load, draw line by line, answer.

    Nothing that it makes need be collected before it ends: looking for that would take a fifth of its time.
    """
    _end_with_parent()
    os.nice(NICE)
    gc.disable()
    with _others() if PAGE in wanted else contextlib.nullcontext(serial) as mapper:
        if RECORDINGS in wanted:  # after the others are made: this library runs threads, which do not go with a fork
            for module in ("rerun", *(f"stages.views.{stage}" for stage in ORDER)):
                import_module(module)
        failed: list[Failure] = []
        for line in sys.stdin:
            run, names = json.loads(line)
            failed = paint(Path(run), names, mapper)
    sys.stdout.write("\n" + json.dumps([asdict(one) for one in failed]))
    sys.stdout.flush()
    os._exit(0)  # taking everything down again piece by piece takes as long as drawing a picture


@contextlib.contextmanager
def _others() -> Iterator[Mapper]:
    """Copies of this process, with everything loaded that the page takes."""
    import_module("pipeline.pages.report")
    with ProcessPoolExecutor(SIDE_BY_SIDE, get_context("fork"), _ready) as executor:
        executor.submit(int).result()  # makes all of them
        yield executor.map


def _ready() -> None:
    from pipeline.pages import prepare

    _end_with_parent()
    prepare()


def _end_with_parent() -> None:
    ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)


if __name__ == "__main__":
    main(sys.argv[1:])
