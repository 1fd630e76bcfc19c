"""Workers process the parts of streams: in this thread, in parallel threads, or on a dask.distributed cluster.

A cluster's workers must see the session and the run folder under the same paths, and each must run one BLAS thread, as
workers started by dask's own command do.

Workers on this machine are threads, not processes: numpy, pyarrow and laspy release the interpreter's lock, no data are
copied between workers, and no process is left when the program is killed. Results come back in order. Therefore they
do not depend on the number of workers.
"""

import contextlib
import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pipeline.artefacts.streams import Mapper, serial
from pipeline.errors import ConfigError

T = TypeVar("T")
_inside = threading.local()


class Stopped(Exception):
    """The run has failed or was interrupted elsewhere: this ends the work on one part, and never reaches the caller."""


@dataclass(frozen=True)
class Workers:
    """An ordered map over an executor. ``jobs`` items are processed at once; the same number waits in the queue."""

    jobs: int
    executor: Executor | None = None  # None: this thread
    local: bool = True  # whether functions see this process's memory
    stop: threading.Event = field(default_factory=threading.Event)

    @property
    def here(self) -> Mapper:
        """Return a map that stays on this machine, for files that the workers of a cluster may not see."""
        return self.map if self.local else serial

    def map(self, function: Callable[..., T], *items: Iterable[object]) -> Iterable[T]:
        """Yield the result of ``function`` for each item, in order.

        A worker that calls this runs the function itself, so that no worker waits for another.
        """
        if self.executor is None or getattr(_inside, "worker", False):
            return map(function, *items)
        return self._ordered(self.executor, function, zip(*items, strict=True))

    def _ordered(
        self, executor: Executor, function: Callable[..., T], work: Iterator[tuple[object, ...]]
    ) -> Iterator[T]:
        call = _marked if self.local else _plain
        waiting: deque[Future[T]] = deque()
        try:
            for arguments in itertools.islice(work, 2 * self.jobs):
                waiting.append(executor.submit(call, function, arguments))
            while waiting:
                result = waiting[0].result()
                waiting.popleft()
                for arguments in itertools.islice(work, 1):
                    waiting.append(executor.submit(call, function, arguments))
                yield result
        finally:
            self._abandon(waiting)

    def _abandon(self, waiting: deque[Future[T]]) -> None:
        """Cancel the tasks that have not begun, stop the others, and wait until all have ended.

        Tasks on a cluster are neither cancelled nor stopped. They, too, are waited for (at most two for each worker),
        so that none writes into a folder that is being removed or made anew.
        """
        if not waiting:
            return
        self.stop.set()
        for future in waiting:
            if self.local:
                future.cancel()
        for future in waiting:
            if not future.cancelled():
                future.exception()
        self.stop.clear()


def _marked(function: Callable[..., T], arguments: tuple[object, ...]) -> T:
    _inside.worker = True
    return function(*arguments)


def _plain(function: Callable[..., T], arguments: tuple[object, ...]) -> T:
    return function(*arguments)


SERIAL = Workers(1)


def default_jobs() -> int:
    """Return the number of processors that this process may use, at most four: more rarely make reading faster."""
    return max(1, min(4, len(os.sched_getaffinity(0))))


@contextlib.contextmanager
def workers(jobs: int | None = None, address: str | None = None) -> Iterator[Workers]:
    """Provide the workers of a run: threads on this machine, or the cluster with the scheduler at ``address``."""
    if address is not None:
        yield from _cluster(address)
        return
    jobs = default_jobs() if jobs is None else jobs
    if jobs < 1:
        raise ConfigError(f"--jobs {jobs}: must be 1 or more")
    if jobs == 1:
        yield SERIAL
        return
    with ThreadPoolExecutor(jobs, thread_name_prefix="poolcal") as executor:
        yield Workers(jobs, executor)


def _cluster(address: str) -> Iterator[Workers]:
    try:
        from distributed import Client  # an optional extra
    except ImportError as error:
        raise ConfigError(
            f"--executor {address}: dask.distributed is not installed; install poolcal with its extra 'dask'"
        ) from error
    try:
        client: Any = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--executor {address}: no scheduler answers ({error}); check the address") from error
    with client:
        jobs = sum(client.ncores().values())
        if not jobs:
            raise ConfigError(f"--executor {address}: the scheduler has no workers; start some")
        yield Workers(jobs, client.get_executor(pure=False), local=False)
