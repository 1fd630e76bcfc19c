"""What people look at, drawn from a finished run after its verdict: the report's page and the recordings.

Drawing needs heavy libraries and cannot share the interpreter with itself, so processes of its own load them while the
stages run, and draw when they are told to: ``python -m stages.drawing`` reads one line, draws, and answers with one.
"""

import contextlib
import ctypes
import json
import os
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

from pipeline import folder
from pipeline.drawn import PAGE, agreeing, page_to_draw
from pipeline.errors import PoolcalError
from stages import ORDER

RECORDINGS = "recordings"
PATIENCE_S = 600
DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG


@dataclass(frozen=True)
class Failure:
    """What could not be drawn, and why; ``trace``: of a bug."""

    what: str
    reason: str
    trace: str = ""

    @classmethod
    def of(cls, name: str, error: Exception) -> "Failure":
        expected = isinstance(error, (PoolcalError, OSError))
        trace = "" if expected else "".join(traceback.format_exception(error)).rstrip()
        first = str(error).partition("\n")[0]
        return cls(RECORDINGS if name in ORDER else name, f"{type(error).__name__}: {first}", trace)


class Painters:
    """One process for the page and one for the recordings, loading; or none, and this process draws."""

    def __init__(self, report: bool, recordings: bool, beside: bool = False) -> None:
        self._wanted = [what for what, wanted in ((PAGE, report), (RECORDINGS, recordings)) if wanted]
        self._processes: dict[str, subprocess.Popen[str]] = {}
        if beside:
            with contextlib.suppress(OSError):  # no room for another process: this one draws
                for what in self._wanted:
                    self._processes[what] = _start(what)

    def draw(self, run: Path) -> list[Failure]:
        """Draw what is not drawn yet. A finished result is never touched; what could not be drawn comes back."""
        if not self._wanted:
            return []
        try:
            folder.read_settings(run)  # never lock, and so make, a folder that is no run's
            with folder.locked(run, ORDER):
                missing = {what: names for what in self._wanted if (names := _missing(run, what))}
                for what, names in missing.items():
                    if what in self._processes:
                        _tell(self._processes[what], run, names)
                return [one for what, names in missing.items() for one in self._drawn(what, run, names)]
        except Exception as error:
            return [Failure.of(" and ".join(self._wanted), error)]

    def _drawn(self, what: str, run: Path, names: Sequence[str]) -> list[Failure]:
        if what not in self._processes:
            return paint(run, names)
        try:
            answer, _ = self._processes[what].communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            return [Failure(what, f"not done within {PATIENCE_S} s")]
        told = answer.rpartition("\n")[2]
        return [Failure(**one) for one in json.loads(told)] if told else [Failure(what, "its process has ended")]

    def close(self) -> None:
        for process in self._processes.values():
            process.kill()
            process.communicate()


def _start(what: str) -> "subprocess.Popen[str]":
    """-P: nothing in the folder one happens to stand in is code of this program."""
    command = [sys.executable, "-P", "-m", "stages.drawing", what]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True, text=True, env=_environment()
    )


def _environment() -> dict[str, str]:
    """With the program's own root first, for where it was not installed."""
    root = str(Path(__file__).parent.parent)
    return os.environ | {"PYTHONPATH": os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])}


def _tell(process: "subprocess.Popen[str]", run: Path, names: Sequence[str]) -> None:
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):  # it has ended: there will be no answer
        print(json.dumps([str(run.absolute()), names]), file=process.stdin, flush=True)


@contextlib.contextmanager
def painters(report: bool, recordings: bool, beside: bool) -> Iterator[Painters]:
    """Painters for the time of a run; ``beside``: as processes of their own."""
    found = Painters(report, recordings, beside)
    try:
        yield found
    finally:
        found.close()


def _missing(run: Path, what: str) -> list[str]:
    """Names of what is not drawn yet: the page, or stages; of stages that agree with each other alone."""
    if what == PAGE:
        return [PAGE] if page_to_draw(run, ORDER) else []
    return [stage for stage in agreeing(run, ORDER) if not (run / stage / f"{stage}.rrd").is_file()]


def paint(run: Path, names: Sequence[str]) -> list[Failure]:
    """Draw the page, or stages' recordings; what went wrong."""
    failed = []
    for name in names:
        try:
            if name == PAGE:
                from pipeline.pages.report import write_page

                write_page(run, ORDER)
            else:
                from stages.views import record

                record(run, name)
        except Exception as error:
            failed.append(Failure.of(name, error))
            break
    return failed


def main(what: str) -> None:
    """The process: load, wait for the word, draw, answer. It ends with its parent."""
    ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)
    for module in ("pipeline.pages.report",) if what == PAGE else ("rerun", *(f"stages.views.{s}" for s in ORDER)):
        import_module(module)
    line = sys.stdin.readline()
    if line:
        run, names = json.loads(line)
        sys.stdout.write("\n" + json.dumps([asdict(one) for one in paint(Path(run), names)]))


if __name__ == "__main__":
    main(sys.argv[1])
