"""Workers process the parts of streams: in this thread, in parallel threads, or on a dask.distributed cluster.

A cluster's workers must see the session and the run folder under the same paths, and each must run one BLAS thread, as
workers started by dask's own command do.

Workers on this machine are threads, not processes: numpy, pyarrow and laspy release the interpreter's lock, no data are
copied between workers, and no process is left when the program is killed. Results come back in order. Therefore they
do not depend on the number of workers.
"""

import concurrent.futures
import contextlib
import itertools
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pipeline.artefacts.streams import Mapper, serial
from pipeline.errors import ConfigError

T = TypeVar("T")
WATCH_S, WAIT_S = 1.0, 60.0  # how often the workers of a cluster are counted, and how long a run waits for a new one
_inside = threading.local()


class Stopped(Exception):
    """The run has failed or was interrupted elsewhere: this ends the work on one part, and never reaches the caller."""


class NoWorkers(ConfigError):
    """A cluster that has lost all its workers, or its scheduler."""


@dataclass(frozen=True)
class Workers:
    """An ordered map over an executor. ``jobs`` items are processed at once.

    On this machine one more waits in the queue: results wait in memory. On a cluster the same number waits.
    """

    jobs: int
    executor: Executor | None = None  # None: this thread
    local: bool = True  # whether functions see this process's memory
    watch: Callable[[], None] = lambda: None  # raises an error if no worker is left; called while results are awaited
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
            for arguments in itertools.islice(work, self.jobs + 1 if self.local else 2 * self.jobs):
                waiting.append(executor.submit(call, function, arguments))
            while waiting:
                self._wait(waiting[0])
                result = waiting[0].result()
                waiting.popleft()
                for arguments in itertools.islice(work, 1):
                    waiting.append(executor.submit(call, function, arguments))
                yield result
        finally:
            self._abandon(waiting)

    def _wait(self, future: Future[Any]) -> None:
        """Wait until a task has ended. Nobody else would notice that the last worker of a cluster has ended."""
        while not future.done():
            concurrent.futures.wait([future], timeout=None if self.local else WATCH_S)
            if not future.done():
                self.watch()

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
        with contextlib.suppress(NoWorkers):  # then nothing is left that could write
            for future in waiting:
                if not future.cancelled():
                    self._wait(future)
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
        from distributed import CancelledError, Client, KilledWorker  # an optional extra
        from distributed.comm import CommClosedError
    except ImportError as error:
        raise ConfigError(
            f"--executor {address}: dask.distributed is not installed; install poolcal with its extra 'dask'"
        ) from error
    for name in ("distributed", "distributed.client"):  # what ends is said once, in one line
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client: Any = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--executor {address}: no scheduler answers ({error}); check the address") from error
    watched = _Watched(address, client)
    with client:
        if not watched.cores():
            raise ConfigError(f"--executor {address}: the scheduler has no workers; start some")
        try:
            yield Workers(watched.cores(), client.get_executor(pure=False), local=False, watch=watched.check)
        except KilledWorker as error:
            raise ConfigError(
                f"--executor {address}: worker after worker ended at the same work; look at their logs, they may lack "
                "memory, and run again"
            ) from error
        except (CancelledError, CommClosedError) as error:
            raise watched.without_scheduler() from error


class _Watched:
    """A cluster's workers, and since when there has been none."""

    def __init__(self, address: str, client: Any) -> None:
        self._address, self._client = address, client
        self._none_since: float | None = None

    def cores(self) -> int:
        """Return the number of the workers' cores."""
        return sum(self._client.ncores().values())

    def check(self) -> None:
        """Raise an error if there has been no worker for WAIT_S, or if the scheduler does not answer."""
        now = time.monotonic()
        try:
            if self.cores():
                self._none_since = None
                return
        except OSError as error:
            raise self.without_scheduler() from error
        self._none_since = now if self._none_since is None else self._none_since
        if now - self._none_since > WAIT_S:
            raise NoWorkers(f"--executor {self._address}: its last worker has ended; start workers, and run again")

    def without_scheduler(self) -> NoWorkers:
        """Return the error of a scheduler that does not answer."""
        return NoWorkers(
            f"--executor {self._address}: the scheduler has ended; start it and its workers, and run again"
        )
