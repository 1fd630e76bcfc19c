"""Limits within which a test ends, and not the machine that it runs on: what waits for ever, or reads without end."""

import contextlib
import resource
import signal
from collections.abc import Iterator
from pathlib import Path

GIB = 2**30


@contextlib.contextmanager
def limited(seconds: int = 60, more_bytes: int = GIB) -> Iterator[None]:
    """Raise TimeoutError after ``seconds``, and MemoryError beyond ``more_bytes`` above the present use."""

    def late(*_: object) -> None:
        raise TimeoutError

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before, memory = signal.signal(signal.SIGALRM, late), resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + more_bytes, memory[1]))
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
        resource.setrlimit(resource.RLIMIT_AS, memory)
