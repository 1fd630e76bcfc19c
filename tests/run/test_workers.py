"""An ordered map: lazy, bounded, and quick to give up."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.errors import ConfigError, RawDataError
from pipeline.run import workers as module
from pipeline.run.workers import SERIAL, NoWorkers, Workers, default_jobs, workers


def test_results_come_in_order() -> None:
    def late(k: int) -> int:
        time.sleep(0.002 * (5 - k % 5))
        return k * k

    with workers(3) as three:
        assert list(three.map(late, range(40))) == [k * k for k in range(40)]


def test_several_arguments_as_in_map() -> None:
    with workers(2) as two:
        assert list(two.map(pow, [2, 3], [3, 2])) == list(SERIAL.map(pow, [2, 3], [3, 2])) == [8, 9]


def test_it_does_not_run_ahead() -> None:
    taken: list[int] = []

    def items() -> "list[int]":
        return [taken.append(k) or k for k in range(1000)]

    started: list[int] = []
    with workers(2) as two:
        results = iter(two.map(lambda k: started.append(k) or k, items()))
        assert next(results) == 0
        time.sleep(0.05)
        assert len(started) <= 6


def test_an_error_comes_out_as_it_is_and_ends_the_rest() -> None:
    started: list[int] = []
    with workers(2) as two:

        def work(k: int) -> int:
            started.append(k)
            if k == 3:
                raise RawDataError("part 3")
            while k > 3 and not two.stop.wait(0.01):
                pass
            return k

        begin = time.monotonic()
        with pytest.raises(RawDataError, match="part 3"):
            list(two.map(work, range(1000)))
        assert len(started) < 10
        assert not two.stop.is_set()
        assert time.monotonic() - begin < 5


def test_a_map_inside_a_map_does_not_lock_up() -> None:
    with workers(2) as two:
        nested = two.map(lambda k: sum(two.map(lambda m: m * k, range(5))), range(20))
        assert list(nested) == [10 * k for k in range(20)]


def test_a_stream_folds_over_workers() -> None:
    import numpy as np

    parts = tuple(MemoryPart(str(k), {"x_m": np.full(10, float(k))}) for k in range(20))
    with workers(2) as two:
        found = Stream(parts, two.map).fold(lambda batch, factor: float(batch["x_m"].sum()) * factor, 2.0)
        assert list(found) == [20.0 * k for k in range(20)]


def test_one_job_works_in_this_thread() -> None:
    with workers(1) as one:
        assert list(one.map(lambda _: threading.current_thread().name, range(2))) == ["MainThread"] * 2


def test_how_many() -> None:
    assert 1 <= default_jobs() <= 4
    with workers() as some:
        assert isinstance(some, Workers)
        assert some.jobs == default_jobs()
    with pytest.raises(ConfigError, match="--jobs 0: must be 1 or more"), workers(0):
        pass


def test_a_cluster_without_its_library_or_scheduler_is_one_line() -> None:
    refusal = r"dask.distributed is not installed|no scheduler answers"
    with pytest.raises(ConfigError, match=refusal), workers(address="tcp://127.0.0.1:9"):
        pass


class Client:
    """A cluster's client, whose workers' cores are the next of a list; an error instead of a number is raised."""

    def __init__(self, *cores: int | OSError) -> None:
        self._cores = list(cores)

    def ncores(self) -> dict[str, int]:
        cores = self._cores.pop(0)
        if isinstance(cores, OSError):
            raise cores
        return {"tcp://a:1": cores} if cores else {}


def test_a_cluster_without_workers_is_waited_for_and_then_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    seconds = iter([0.0, 50.0, 70.0, 80.0, 139.0, 141.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(seconds))
    watched = module._Watched("tcp://s:1", Client(0, 0, 2, 0, 0, 0))  # at 70 s a worker is there again
    for _ in range(5):
        watched.check()
    with pytest.raises(NoWorkers, match=r"tcp://s:1: its last worker has ended; start workers"):
        watched.check()


def test_a_scheduler_that_does_not_answer_ends_the_run() -> None:
    with pytest.raises(NoWorkers, match="the scheduler has ended; start it"):
        module._Watched("tcp://s:1", Client(OSError("timed out"))).check()


def test_work_that_nobody_does_any_more_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WATCH_S", 0.01)
    free = threading.Event()

    def watch() -> None:
        raise NoWorkers("none")

    def work(_: int) -> bool:
        return free.wait(30)

    with ThreadPoolExecutor(1) as executor:
        begin = time.monotonic()
        with pytest.raises(NoWorkers):
            list(Workers(1, executor, local=False, watch=watch).map(work, range(5)))
        assert time.monotonic() - begin < 5
        free.set()
