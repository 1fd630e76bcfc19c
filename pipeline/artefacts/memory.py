"""Memory of the process: heaps that keep little, and free memory that is given back.

What a stage no longer needs lies in pieces between what stays. glibc gives back the end of its heap alone, unless it is
asked. Other C libraries have neither call.

Arrow has a heap of its own. Its usual one, mimalloc, keeps free memory of each thread: after 80 million points it held
200 MB, of which Arrow had never used more than 40 MB at a time.
"""

import contextlib
import ctypes
import os
import sys

ARENA_MAX = -8  # M_ARENA_MAX in malloc.h of glibc


def use_small_heaps() -> None:
    """Let all threads share one heap: with a heap for each, glibc keeps more memory that is free, a seventh of all.

    Arrow, which must not be loaded yet, shall use jemalloc; its builds for Linux have it.
    """
    if sys.platform == "linux":
        os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "jemalloc")
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).mallopt(ARENA_MAX, 1)


def give_back_memory() -> None:
    """Give free memory back to the machine."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
