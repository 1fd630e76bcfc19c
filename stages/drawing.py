"""What people look at, drawn from a finished run after its verdict: the report's page and the recordings.

Drawing needs heavy libraries and cannot share the interpreter with itself, so processes of its own load them while the
stages run, and draw when they are told to: ``python -m stages.drawing`` reads one line, draws, and answers with one.
"""

import contextlib
import ctypes
import json
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

from pipeline import folder, manifest
from pipeline.drawn import PAGE, page_to_draw
from pipeline.errors import PoolcalError
from stages import ORDER

RECORDINGS = "recordings"
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
        return cls(PAGE if name == PAGE else RECORDINGS, f"{type(error).__name__}: {first}", trace)


class Painters:
    """One process for the page and one for the recordings, loading; or none, and this process draws."""

    def __init__(self, report: bool, recordings: bool, beside: bool = False) -> None:
        self._wanted = {PAGE: report, RECORDINGS: recordings}
        command = [sys.executable, "-m", "stages.drawing"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "start_new_session": True, "text": True}
        self._processes: dict[str, subprocess.Popen[str]] = {
            what: subprocess.Popen([*command, what], **pipes)  # type: ignore[call-overload]
            for what, wanted in self._wanted.items()
            if wanted and beside
        }

    def draw(self, run: Path) -> list[Failure]:
        """Draw what is not drawn yet. A finished result is never touched; what could not be drawn comes back."""
        try:
            with folder.locked(run, ORDER):
                missing = {what: _missing(run, what) for what, wanted in self._wanted.items() if wanted}
                if not self._processes:
                    return [one for names in missing.values() for one in paint(run, names)]
                return self._elsewhere(run, {what: names for what, names in missing.items() if names})
        except (PoolcalError, OSError) as error:  # the folder is in use, or cannot be written
            return [Failure.of("", error)]

    def _elsewhere(self, run: Path, missing: dict[str, list[str]]) -> list[Failure]:
        for what, names in missing.items():
            pipe = self._processes[what].stdin
            assert pipe is not None
            with contextlib.suppress(BrokenPipeError):  # it has ended: there will be no answer
                print(json.dumps([str(run.absolute()), names]), file=pipe, flush=True)
        answers = {what: self._processes[what].communicate()[0] for what in missing}
        found = []
        for what, answer in answers.items():
            told = answer.rpartition("\n")[2] if answer else ""
            found += [Failure(**one) for one in json.loads(told)] if told else [Failure(what, "its process has ended")]
        return found

    def close(self) -> None:
        for process in self._processes.values():
            process.kill()
            process.communicate()


@contextlib.contextmanager
def painters(report: bool, recordings: bool, beside: bool) -> Iterator[Painters]:
    """Painters for the time of a run; ``beside``: as processes of their own."""
    found = Painters(report, recordings, beside)
    try:
        yield found
    finally:
        found.close()


def _missing(run: Path, what: str) -> list[str]:
    """Names of what is not drawn yet: the page, or stages."""
    if what == PAGE:
        return [PAGE] if page_to_draw(run, ORDER) else []
    finished = [stage for stage in ORDER if manifest.read(run / stage) is not None]
    return [stage for stage in finished if not (run / stage / f"{stage}.rrd").is_file()]


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
