"""The process that draws: ``python -m stages.commands.draw_process PARENT WHAT...`` reads orders, line by line, and
answers.

Orders: JSON ``[order, run, names]``, to prepare recordings of finished stages, or to draw. See
:mod:`stages.commands.draw`.
"""

import contextlib
import ctypes
import gc
import json
import os
import signal
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from dataclasses import asdict
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

from pipeline.artefacts.streams import Mapper, serial
from pipeline.run.results import PAGE
from stages import ORDER
from stages.commands.draw import DRAW, RECORDINGS, Failure, Prepared, paint

T = TypeVar("T")
LOADING_S = 20
DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG
NICE = 10  # the stages come first, but a busy machine draws as well
SIDE_BY_SIDE = 2  # pictures of the page


def main(parent: int, wanted: Sequence[str]) -> None:
    """Load, do what the lines say, answer.

    Nothing that it makes need be collected before it ends: looking for that would take a fifth of its time. Whatever
    fails in loading fails again in drawing, where it is said.
    """
    _end_with(parent)
    os.nice(NICE)
    gc.disable()
    mapper = _others() if PAGE in wanted else serial
    if RECORDINGS in wanted:  # after the others are made: this library runs threads, which do not go with a fork
        with contextlib.suppress(Exception):
            for module in ("rerun", *(f"stages.views.{stage}" for stage in ORDER)):
                import_module(module)
    prepared: dict[str, Prepared] = {}
    failed: list[Failure] = []
    for line in sys.stdin:
        order, run, names = json.loads(line)
        if order == DRAW:
            failed = paint(Path(run), names, mapper, prepared)
        else:
            with contextlib.suppress(Exception):
                prepared |= {stage: Prepared.of(Path(run), stage) for stage in names}
    with contextlib.suppress(BrokenPipeError):  # nobody waits for it any more
        sys.stdout.write("\n" + json.dumps([asdict(one) for one in failed]))
        sys.stdout.flush()
    os._exit(0)  # taking everything down again piece by piece takes as long as drawing a picture


def _others() -> Mapper:
    """Work for copies of this process, with all loaded that the page takes; where there can be none, for this one."""
    try:
        import_module("pipeline.results.pages.report")
        executor = ProcessPoolExecutor(SIDE_BY_SIDE, get_context("fork"), _ready, (os.getpid(),))
        executor.submit(int).result(timeout=LOADING_S)  # makes all of them
    except Exception:
        return serial

    def mapped(function: Callable[..., T], /, *items: Iterable[object]) -> Iterable[T]:
        each = list(zip(*items, strict=True))
        begun = [_begun(executor, function, work) for work in each]
        return (_made(future, function, work) for future, work in zip(begun, each, strict=True))

    return mapped


def _begun(executor: ProcessPoolExecutor, function: Callable[..., T], work: Sequence[object]) -> "Future[T] | None":
    try:
        return executor.submit(function, *work)
    except BrokenExecutor:
        return None


def _made(future: "Future[T] | None", function: Callable[..., T], work: Sequence[object]) -> T:
    """What a copy has made; what none can make any more is made here."""
    with contextlib.suppress(BrokenExecutor):
        if future is not None:
            return future.result()
    return function(*work)


def _ready(parent: int) -> None:
    """A copy: ends with the process that it was made from, and does not keep its answer open."""
    from pipeline.results.pages.rendering import prepare_drawing

    _end_with(parent)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    prepare_drawing()


def _end_with(parent: int) -> None:
    """Have the kernel end this process with its parent; at once, if that has ended before."""
    ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
