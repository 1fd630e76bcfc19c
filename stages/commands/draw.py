"""No command: this module draws the report's page and a recording of each stage, from a run's files.

Drawing begins when the answer is on the screen. With two jobs or more, separate processes draw
(:mod:`stages.commands.draw_worker`): if a library crashes or memory is short, one of these ends, and not the run.
"""

import contextlib
import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.results.pages.currency import is_page_outdated
from pipeline.run import folder
from pipeline.run.results import PAGE, agreeing, recording_path
from pipeline.run.settings import read_settings
from stages import ORDER, names_in
from stages.commands import child
from stages.commands.one_drawing import RECORDINGS, DrawingFailure, draw_one, kind_of_drawing

DECIDES = "angle_iterate"  # its result decides which tabs there are
WORKER = (*child.PYTHON, "stages.commands.draw_worker")


@dataclass(frozen=True)
class Drawings:
    """What to draw: the report's page, and the recordings of the stages."""

    report: bool
    recordings: bool

    @property
    def kinds(self) -> list[str]:
        """The kinds of drawings to make, by their names in messages."""
        return [kind for kind, wanted in ((PAGE, self.report), (RECORDINGS, self.recordings)) if wanted]


def draw_missing(run: Path, wanted: Drawings, jobs: int = 1) -> list[DrawingFailure]:
    """Draw the page and the recordings that are missing or out of date.

    Parameters
    ----------
    run
        A run folder; its results are only read.
    wanted
        What to draw.
    jobs
        1: this process draws. 2 or 3: one worker process draws. 4 or more: two worker processes draw, one of them the
        page, which takes longer than all recordings. Each worker process must load the libraries again.

    Returns
    -------
    list
        The failures, at most one for each kind of drawing.
    """
    if not wanted.kinds:
        return []
    try:
        read_settings(run)  # fails for a folder that is no run folder, before it is locked
        if not missing_drawings(run, wanted):
            return []
        with folder.locked(run, ORDER):
            return _draw_all(run, missing_drawings(run, wanted), jobs // 2)
    except Exception as error:  # a failed drawing, whatever its cause, must not end a run that has its result
        return [DrawingFailure.of(" and ".join(wanted.kinds), error)]


def missing_drawings(run: Path, wanted: Drawings) -> list[str]:
    """Return the names of the drawings to make: PAGE, and stages without a recording; their results must agree."""
    stages = names_in(run)
    page = [PAGE] if wanted.report and is_page_outdated(run, stages) else []
    if not wanted.recordings:
        return page
    done = agreeing(run, stages)
    if DECIDES in done and not recording_path(run, DECIDES).is_file():
        return page + list(done)  # its new result can change the tabs, and every recording contains them
    return page + [stage for stage in done if not recording_path(run, stage).is_file()]


def _draw_all(run: Path, names: Sequence[str], processes: int) -> list[DrawingFailure]:
    """Draw with 0 worker processes (in this one), with 1, or page and recordings with 2; return the failures."""
    failures = None
    if processes and names:
        by_kind = [[name for name in names if kind_of_drawing(name) == kind] for kind in (PAGE, RECORDINGS)]
        shares = [share for share in by_kind if share] if processes > 1 else [list(names)]
        with contextlib.suppress(OSError):  # if no process can be started, this one draws
            failures = _drawn_by_workers(run.absolute(), shares)
    if failures is None:
        failures = [failure for name in names if (failure := draw_one(run, name)) is not None]
    return list({failure.kind: failure for failure in reversed(failures)}.values())


def _drawn_by_workers(run: Path, shares: Sequence[Sequence[str]]) -> list[DrawingFailure]:
    """Draw each share in a separate process, and return the failures.

    Ctrl-C reaches only this process, which then kills the workers. A file is written whole or not at all.
    """
    with contextlib.ExitStack() as stack:
        workers = []
        for share in shares:
            workers.append(stack.enter_context(_started([*WORKER, str(run), *share])))
            stack.callback(workers[-1].kill)  # runs before the wait for its end; after its answer, it has no work left
        return [failure for worker, share in zip(workers, shares, strict=True) for failure in _answer(worker, share)]


def _started(command: Sequence[str]) -> "subprocess.Popen[str]":
    pipe, env = subprocess.PIPE, child.environment()
    return subprocess.Popen(
        command, stdin=pipe, stdout=pipe, encoding="utf-8", errors="replace", start_new_session=True, env=env
    )


def _answer(worker: "subprocess.Popen[str]", share: Sequence[str]) -> list[DrawingFailure]:
    assert worker.stdout is not None
    last = worker.stdout.read().rstrip().rpartition("\n")[2]
    if not last:
        return [DrawingFailure(" and ".join(dict.fromkeys(map(kind_of_drawing, share))), "its process has ended")]
    return [DrawingFailure(**failure) for failure in json.loads(last)]
