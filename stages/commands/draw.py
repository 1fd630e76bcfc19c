"""Draw what people look at, from a run's files: the report's page, and a recording of each stage.

Drawing begins when the answer is on the screen. Processes of their own draw (:mod:`stages.commands.draw_worker`): a
crash in a library that draws, or a lack of memory, ends one of them and not the run.
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.results.pages.currency import is_page_outdated
from pipeline.run import folder
from pipeline.run.results import PAGE, agreeing, recording_path
from pipeline.run.settings import read_settings
from stages import ORDER, names_in
from stages.commands.one_drawing import RECORDINGS, DrawingFailure, draw_one, kind_of_drawing

DECIDES = "angle_iterate"  # on which tabs there are
WORKER = [sys.executable, "-P", "-m", "stages.commands.draw_worker"]  # -P: no code of the working folder is run


@dataclass(frozen=True)
class Drawings:
    """What is wanted: the report's page, the stages' recordings."""

    report: bool
    recordings: bool

    @property
    def kinds(self) -> list[str]:
        """Return the names of what is wanted, as messages name them."""
        return [kind for kind, wanted in ((PAGE, self.report), (RECORDINGS, self.recordings)) if wanted]


def draw_missing(run: Path, wanted: Drawings, jobs: int = 1) -> list[DrawingFailure]:
    """Draw what is not drawn yet, or not as the run is now.

    Parameters
    ----------
    run
        A run folder; its results are only read.
    wanted
        What is to be drawn.
    jobs
        With one, this process draws; with two or three, one worker process; with more two, one of which draws the page,
        which takes longer than all recordings. Each loads the libraries anew.

    Returns
    -------
    list
        What could not be drawn, at most one entry a kind.
    """
    if not wanted.kinds:
        return []
    try:
        read_settings(run)  # never lock, and so make, a folder that is no run's
        if not missing_drawings(run, wanted):
            return []
        with folder.locked(run, ORDER):
            return _draw_all(run, missing_drawings(run, wanted), jobs // 2)
    except Exception as error:  # a failed drawing, whatever its cause, must not end a run that has its result
        return [DrawingFailure.of(" and ".join(wanted.kinds), error)]


def missing_drawings(run: Path, wanted: Drawings) -> list[str]:
    """Return what is not drawn yet: the page's name, and names of stages, of those alone that agree with each other."""
    stages = names_in(run)
    page = [PAGE] if wanted.report and is_page_outdated(run, stages) else []
    if not wanted.recordings:
        return page
    done = agreeing(run, stages)
    if DECIDES in done and not recording_path(run, DECIDES).is_file():
        return page + list(done)  # with its result the tabs may come or go, and every recording names them
    return page + [stage for stage in done if not recording_path(run, stage).is_file()]


def _draw_all(run: Path, names: Sequence[str], processes: int) -> list[DrawingFailure]:
    """Draw page and recordings side by side where there may be two processes, and else one after the other."""
    failures = None
    if processes and names:
        by_kind = [[name for name in names if kind_of_drawing(name) == kind] for kind in (PAGE, RECORDINGS)]
        shares = [share for share in by_kind if share] if processes > 1 else [list(names)]
        with contextlib.suppress(OSError):  # where no process can be started, this one draws
            failures = _drawn_by_workers(run.absolute(), shares)
    if failures is None:
        failures = [failure for name in names if (failure := draw_one(run, name)) is not None]
    return list({failure.kind: failure for failure in reversed(failures)}.values())


def _drawn_by_workers(run: Path, shares: Sequence[Sequence[str]]) -> list[DrawingFailure]:
    """Draw each share in a process of its own; return the failures.

    Ctrl-C reaches this process alone, which then kills the others. A file is written whole or not at all.
    """
    with contextlib.ExitStack() as stack:
        workers = []
        for share in shares:
            workers.append(stack.enter_context(_started([*WORKER, str(run), *share])))
            stack.callback(workers[-1].kill)  # before it is waited for; once it has answered, its work is done
        return [failure for worker, share in zip(workers, shares, strict=True) for failure in _answer(worker, share)]


def _started(command: Sequence[str]) -> "subprocess.Popen[str]":
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, stdin=pipe, stdout=pipe, encoding="utf-8", errors="replace", start_new_session=True, env=_environment()
    )


def _answer(worker: "subprocess.Popen[str]", share: Sequence[str]) -> list[DrawingFailure]:
    assert worker.stdout is not None
    last = worker.stdout.read().rstrip().rpartition("\n")[2]
    if not last:
        return [DrawingFailure(" and ".join(dict.fromkeys(map(kind_of_drawing, share))), "its process has ended")]
    return [DrawingFailure(**failure) for failure in json.loads(last)]


def _environment() -> dict[str, str]:
    """Return this process's environment, with the program's own root first, for where it was not installed."""
    root = str(Path(__file__).parents[2])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": path}
