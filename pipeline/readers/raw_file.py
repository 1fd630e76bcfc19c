"""Open raw files, and read their bytes at any place without loading a whole file into memory."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from pipeline.errors import RawDataError

_BLOCK = 1 << 20


@contextmanager
def opened(path: Path, name: str) -> Iterator[BinaryIO]:
    """Open a file for reading bytes; an error of the operating system becomes a RawDataError."""
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise RawDataError(f"{name}: cannot be read ({error.strerror or error}); check the file") from error


def size_of(file: BinaryIO) -> int:
    """Return the size in bytes, and set the position to the start."""
    size = file.seek(0, 2)
    file.seek(0)
    return size


def read_at(file: BinaryIO, offset: int, count: int) -> bytes:
    """Return at most ``count`` bytes from ``offset``."""
    file.seek(offset)
    return file.read(count)


def find(file: BinaryIO, pattern: bytes, start: int) -> int:
    """Return the first place of a pattern; the file is read in blocks of growing length.

    Parameters
    ----------
    file : BinaryIO
        The file.
    pattern : bytes
        The bytes to look for.
    start : int
        Byte at which to begin.

    Returns
    -------
    int
        Byte at or after ``start`` at which the pattern begins; -1 if the file does not contain it.
    """
    count = 4096
    while True:
        block = read_at(file, start, count)
        if (place := block.find(pattern)) >= 0:
            return start + place
        if len(block) < count:
            return -1
        start += count - len(pattern) + 1
        count = min(2 * count, _BLOCK)
