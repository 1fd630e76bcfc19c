"""The rows of a campaign on disk: a line of JSON each during the campaign, a Parquet file at its end."""

import json
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

Task = TypeVar("Task")


def collect_rows(
    path: Path,
    row_of: Callable[[Task], dict[str, Any]],
    tasks: Sequence[Task],
    jobs: int,
    resume: bool,
    tasks_of_a_worker: int,
) -> pd.DataFrame:
    """Return a campaign's rows, computed by worker processes, and write them.

    Each row is written as soon as it and all before it are there, so that an interruption loses only what was being
    computed. The rows are the same for any number of workers and of interruptions.

    Parameters
    ----------
    path
        The Parquet file. During the campaign the rows stand beside it, with the suffix .jsonl.
    row_of
        Function that computes the row of a task; of a module, because workers import it. Its values are numbers and
        text.
    tasks
        A task for each row.
    jobs
        Number of workers.
    resume
        Keep the rows that an interrupted campaign has left, which must have had the same tasks, and compute the others.
    tasks_of_a_worker
        After so many a worker is replaced by a new process.
    """
    lines = path.with_suffix(".jsonl")
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = _whole_rows(lines) if resume else []
    lines.write_text("".join(map(_line, rows)), "utf-8")
    if tasks[len(rows) :]:
        with processes(jobs, tasks_of_a_worker) as pool:
            for row in in_order(pool, row_of, tasks[len(rows) :], jobs):
                rows.append(row)
                with lines.open("a", encoding="utf-8") as file:
                    file.write(_line(row))
    table = pd.DataFrame(rows[: len(tasks)])
    table.to_parquet(path, index=False)
    return table


@contextmanager
def processes(jobs: int, tasks_of_a_worker: int | None = None) -> Iterator[Pool]:
    """Yield a pool of worker processes, which end by themselves, after an error too.

    A worker that is ended while it hands over its row keeps the lock of the way back, and the pool waits for ever.
    """
    with get_context("spawn").Pool(jobs, maxtasksperchild=tasks_of_a_worker) as pool:
        try:
            yield pool
        except Exception:
            _end(pool)
            raise
        _end(pool)


def _end(pool: Pool) -> None:
    pool.close()
    pool.join()


def in_order(
    pool: Pool, row_of: Callable[[Task], dict[str, Any]], tasks: Sequence[Task], jobs: int
) -> Iterator[dict[str, Any]]:
    """Yield the rows in order; few tasks wait in the pool, so that an error ends it soon."""
    waiting, further = deque[Any](), iter(tasks)
    for task in islice(further, 2 * jobs):
        waiting.append(pool.apply_async(row_of, (task,)))
    while waiting:
        row: dict[str, Any] = waiting.popleft().get()
        for task in islice(further, 1):
            waiting.append(pool.apply_async(row_of, (task,)))
        yield row


def _line(row: dict[str, Any]) -> str:
    return json.dumps(row) + "\n"


def _whole_rows(lines: Path) -> list[dict[str, Any]]:
    """Return the rows that were written to their end; none if there is no file."""
    text = lines.read_text("utf-8") if lines.is_file() else ""
    return [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]
