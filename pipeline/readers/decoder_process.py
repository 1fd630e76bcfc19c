"""Native decoders in a process of their own, for damaged files that end the process instead of raising.

A worker writes to its standard output, native byte order: per batch an int64 count, then that many float64 of each
column; at the end a count of 0. An error is -1, an int64 length, and that many bytes of UTF-8. Any other output, or
none, is a RawDataError of the file.
"""

import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError

REMEDY = "copy or export it again"
DecodedColumns = tuple[NDArray[np.float64], ...]


def decoded_batches(program: Path, arguments: list[str], name: str, width: int, batch: int) -> Iterator[DecodedColumns]:
    """Yield the columns that a worker decodes, batch by batch.

    Parameters
    ----------
    program : Path
        The worker's Python file.
    arguments : list of str
        Its command line.
    name : str
        The raw file's path in the session folder, for messages.
    width : int
        Number of columns.
    batch : int
        Largest number of rows in a batch.

    Yields
    ------
    tuple of ``width`` (n,) arrays

    Raises
    ------
    RawDataError
        The file is damaged: the worker reports an error, or ends without the final count.
    """
    with _started(program, arguments) as stream:
        while count := _count(stream, name, batch):
            numbers = np.frombuffer(_exactly(stream, width * 8 * count, name), np.float64)
            yield tuple(numbers.reshape(width, count))


def decoded_text(program: Path, arguments: list[str], name: str, most: int) -> str:
    """Return the text that a worker writes: an int64 length, and that many bytes of UTF-8.

    Parameters
    ----------
    program, arguments, name
        As for :func:`decoded_batches`.
    most : int
        Largest length of the text, bytes.
    """
    with _started(program, arguments) as stream:
        return _exactly(stream, _count(stream, name, most), name).decode("utf-8", "replace")


@contextmanager
def _started(program: Path, arguments: list[str]) -> Iterator[IO[bytes]]:
    command = [sys.executable, "-P", str(program), *arguments]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as worker:
        try:
            assert worker.stdout is not None
            yield worker.stdout
        finally:
            worker.kill()


def _count(stream: IO[bytes], name: str, most: int) -> int:
    (count,) = struct.unpack("=q", _exactly(stream, 8, name))
    if 0 <= count <= most:
        return int(count)
    (length,) = struct.unpack("=q", _exactly(stream, 8, name))
    reason = _exactly(stream, min(max(length, 0), 4096), name).decode("utf-8", "replace")
    raise RawDataError(f"{name}: is damaged ({reason}); {REMEDY}")


def _exactly(stream: IO[bytes], count: int, name: str) -> bytes:
    data = stream.read(count)
    if len(data) < count:
        raise RawDataError(f"{name}: is damaged: unpacking it ended the unpacking program; {REMEDY}")
    return data
