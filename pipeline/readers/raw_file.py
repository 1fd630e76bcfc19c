"""Raw files as bytes: opening them, and looking into them without holding them in memory."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from pipeline.errors import RawDataError

BLOCK = 1 << 20


@contextmanager
def opened(path: Path, name: str) -> Iterator[BinaryIO]:
    """The file, open for reading bytes; whatever the operating system refuses is a RawDataError."""
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise RawDataError(f"{name}: cannot be read ({error.strerror or error}); check the file") from error


def size_of(file: BinaryIO) -> int:
    """Size in bytes; the position is left at the start."""
    size = file.seek(0, 2)
    file.seek(0)
    return size


def read_at(file: BinaryIO, offset: int, count: int) -> bytes:
    """At most ``count`` bytes from ``offset``."""
    file.seek(offset)
    return file.read(count)


def find(file: BinaryIO, pattern: bytes, start: int) -> int:
    """Where ``pattern`` occurs first at or after ``start``; -1 where it does not. Looks farther bit by bit."""
    count = 4096
    while True:
        block = read_at(file, start, count)
        if (found := block.find(pattern)) >= 0:
            return start + found
        if len(block) < count:
            return -1
        start += count - len(pattern) + 1
        count = min(2 * count, BLOCK)
