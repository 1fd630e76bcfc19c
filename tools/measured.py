"""Seconds, processor seconds and memory of commands."""

import os
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Spent:
    """What a command took: seconds, processor seconds with those of its processes, peak MiB of its own; its output."""

    wall_s: float
    cpu_s: float
    mib: float
    output: str


def measured(command: list[str]) -> Spent:
    """Run a command, which must end with status 0 or 1."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    output = process.stdout.read() if process.stdout else ""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(command)} ended with {process.returncode}")
    spent = time.perf_counter() - start
    return Spent(spent, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, output)


def memory_together(command: list[str]) -> float:
    """Return the peak MiB of a command and its child processes together.

    A memory page that several processes share is counted once. The sampling takes time of its own, so this is no
    measurement of seconds.
    """
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    peak = 0.0
    while process.poll() is None:
        peak = max(peak, sum(_share_mib(pid) for pid in _family(process.pid)))
        time.sleep(0.05)
    return peak


def _family(pid: int) -> list[int]:
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    except OSError:
        return [pid]
    return [pid, *(descendant for child in children for descendant in _family(int(child)))]


def _share_mib(pid: int) -> float:
    try:
        status = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) / 1024 for line in status.splitlines() if line.startswith("Pss:"))
