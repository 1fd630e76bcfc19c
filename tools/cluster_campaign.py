"""Run over a dask cluster on this machine: the same bytes as with threads, the gain of workers, and their sudden end.

A cluster here is a scheduler and workers of one thread each, all processes of this machine. The program calibrates a
session with threads, then over clusters of one and of two workers, in turns; every Parquet file must have the same
bytes. Then it kills one of two workers (SIGKILL, without a nanny that would start another) at a random time of each of
several runs, and once all workers, and once the scheduler. Such a run must end as if nothing had happened, or with
status 2 and one line; in the latter case the same command is given again with a new cluster. In the end every Parquet
file must have the same bytes.

    python -m tools.cluster_campaign SESSION [--repeats 3] [--kills 10] [--seed 1]
"""

import argparse
import contextlib
import os
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tools.kill_campaign import POOLCAL, ROOT, digests

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
VICTIMS = {"a worker": slice(1, 2), "all workers": slice(1, None), "the scheduler": slice(1)}
START_S = 30.0  # in this time a scheduler and its workers have started
Process = subprocess.Popen[bytes]


@dataclass(frozen=True)
class Cluster:
    """A scheduler's address, and the processes: the scheduler first, then its workers."""

    address: str
    processes: list[Process]


@contextlib.contextmanager
def cluster(workers: int) -> Iterator[Cluster]:
    """Start a scheduler and workers, and end them."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    scheduler = _started("scheduler", "--host", "127.0.0.1", "--port", str(port))
    processes = [scheduler]
    try:
        processes += [_started("worker", address, "--nthreads", "1", "--no-nanny") for _ in range(workers)]
        _wait_for(address, workers)
        yield Cluster(address, processes)
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def _started(kind: str, *words: str) -> Process:
    command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *words, "--no-dashboard"]
    environment = os.environ | ONE_THREAD | {"PYTHONPATH": str(ROOT)}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=environment, cwd=ROOT, stdout=quiet, stderr=quiet)


def _wait_for(address: str, workers: int) -> None:
    from distributed import Client

    with Client(address, timeout=START_S) as client:
        client.wait_for_workers(workers, timeout=START_S)


def calibration(session: Path, run: Path, *more: str) -> list[str]:
    """Return the command line that calibrates."""
    places = [str(session), "--config", str(session / "pool.yaml"), "--run", str(run)]
    return [*POOLCAL, "run", *places, "--no-report", "--no-recordings", *more]


def timed(command: list[str]) -> float:
    """Run a command, which must end with status 0 or 1, and return its seconds."""
    start = time.monotonic()
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"status {done.returncode}: {done.stderr}")
    return time.monotonic() - start


def gain(session: Path, folder: Path, repeats: int, right: dict[str, str]) -> str:
    """Return the medians of the seconds with one and with two workers, and the median of their ratios."""
    seconds: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(repeats):
        for workers, of_number in seconds.items():
            with cluster(workers) as here:
                of_number.append(timed(calibration(session, folder / "run", "--executor", here.address)))
            if digests(folder / "run") != right:
                raise SystemExit(f"{workers} workers: other bytes than with threads")
            shutil.rmtree(folder / "run")
    ratios = [one / two for one, two in zip(seconds[1], seconds[2], strict=True)]
    one, two = (statistics.median(of_number) for of_number in seconds.values())
    return f"1 worker {one:.1f} s, 2 workers {two:.1f} s: {statistics.median(ratios):.2f} times as fast; same bytes"


def killed(session: Path, folder: Path, what: str, after_s: float, right: dict[str, str]) -> str:
    """Kill processes of a cluster of two workers during a run, and return what followed, in some words.

    ``what``: a key of VICTIMS.
    """
    run = folder / "run"
    with cluster(2) as here:
        process = subprocess.Popen(
            calibration(session, run, "--executor", here.address),
            cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        time.sleep(after_s)
        for victim in here.processes[VICTIMS[what]]:
            victim.send_signal(signal.SIGKILL)
        done = sorted(path.parent.name for path in run.glob("*/manifest.json"))
        _, text = process.communicate()
    lines = [line for line in text.splitlines() if line.startswith("poolcal: ")]
    answer = f"status {process.returncode}"
    if process.returncode not in (0, 1):
        if process.returncode != 2 or len(lines) != 1 or "Traceback" in text:
            raise SystemExit(f"{what} killed after {after_s:.1f} s: {answer}\n{text}")
        with cluster(2) as here:
            timed(calibration(session, run, "--executor", here.address))
        answer += f" ({lines[0]}), then again to the end"
    same = digests(run) == right
    shutil.rmtree(run)
    if not same:
        raise SystemExit(f"{what} killed after {after_s:.1f} s: other bytes")
    return f"{what} killed after {after_s:.1f} s, {len(done)} stages done: {answer}; same bytes"


def main() -> None:
    """Run the campaign and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path, metavar="SESSION", help="folder of a session with pool.yaml")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each number of workers; default: 3")
    parser.add_argument("--kills", type=int, default=10, help="number of runs whose worker is killed; default: 10")
    parser.add_argument("--seed", type=int, default=1, help="seed of the times of the kills; default: 1")
    options = parser.parse_args()
    session, random = options.session.absolute(), np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory(prefix="poolcal-cluster-") as name:
        folder = Path(name)
        for run in ("first", "threads"):  # the first may compile
            seconds = timed(calibration(session, folder / run, "--jobs", "2"))
        right = digests(folder / "threads")
        if digests(folder / "first") != right:
            raise SystemExit("threads: other bytes the second time")
        print(f"threads {seconds:.1f} s")
        print(gain(session, folder, options.repeats, right), flush=True)
        for what in [*["a worker"] * options.kills, "all workers", "the scheduler"]:
            print(killed(session, folder, what, random.uniform(0.5, seconds), right), flush=True)


if __name__ == "__main__":
    main()
